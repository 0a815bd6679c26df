"""Pixels at the edge of the program: picture files in and out, and images with their noise."""
