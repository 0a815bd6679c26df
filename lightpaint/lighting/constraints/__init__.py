"""Constraints on lights: what people ask of them."""
