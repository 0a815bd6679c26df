"""Suggestions of additional lights where they would help most."""
