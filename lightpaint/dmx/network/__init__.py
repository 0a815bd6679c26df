"""Levels on a network: to a console, and back."""
