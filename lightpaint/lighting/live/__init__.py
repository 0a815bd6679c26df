"""The answer while the brush moves, and the sums that follow it."""
