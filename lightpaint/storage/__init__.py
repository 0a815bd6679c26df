"""Folders and files of results: published together, and read back strictly."""
