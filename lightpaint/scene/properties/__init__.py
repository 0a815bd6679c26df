"""Emission, pose, film and integrator: how each is read from a scene, and how it is changed."""
