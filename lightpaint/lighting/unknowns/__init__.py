"""Unknowns that constraints leave of the lights, and the solve in these."""
