"""Layers of a painting: what each asks for, in which order, and the target that they come to."""
