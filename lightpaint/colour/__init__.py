"""Colours as numbers: spaces, temperatures, view transforms, displays. Nothing here reads
pictures.
"""
