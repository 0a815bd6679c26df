"""Folders and files of results: published together, read back strictly."""
