"""Stored paths of camera samples, and the image of a light at any place along them."""
