"""Modules that run in Dr.Jit: they import Mitsuba, whose variant has to be chosen before."""
