"""Rigs of fixtures, and the levels that a console sends them."""
