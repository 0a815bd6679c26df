"""Mitsuba in this process: variant, LLVM, plugins, threads, and one render at a time."""
