"""Spectra of lights: reading them, their colours, and how they render the colours of things."""
