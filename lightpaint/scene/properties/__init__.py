"""Emission, pose, film and integrator: reading them from a scene, and changing them."""
