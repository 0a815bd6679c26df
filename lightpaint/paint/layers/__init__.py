"""Layers of a painting: the request of each, their order, and the target that they add up to."""
