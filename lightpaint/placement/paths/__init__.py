"""Paths of camera samples that are kept, and the picture of a light at any place along them."""
