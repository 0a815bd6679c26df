"""Paint light, and see the answer while the brush moves."""
