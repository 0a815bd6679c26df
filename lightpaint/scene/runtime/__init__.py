"""Mitsuba in this process: its variant, LLVM, plugins, threads, and one render at a time."""
