"""Convex quadratics between bounds: their optimum, and the proof that it is one."""
