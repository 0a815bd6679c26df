"""Modules with Dr.Jit code. They import Mitsuba, so its variant must be set before."""
