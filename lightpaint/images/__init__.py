"""Pixels and colour at the edge of the program: files in and out, display encoding, ΔE."""
