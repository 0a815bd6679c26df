"""The manifest of a batch: its keys, and the looks that it asks for."""
