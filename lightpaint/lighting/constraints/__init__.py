"""Constraints on lights, and the unknowns that they leave."""
