"""Constraints on lights."""
