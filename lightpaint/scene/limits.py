"""Limits of what a scene may be asked for: larger numbers are typing errors."""

#: Maximum number of pixels of a film, and maximum samples per pixel.
MAX_PIXELS = 2**28
MAX_SPP = 2**20
#: Most texels of an image: each is a light with pictures of its own.
MAX_TEXELS = 4096
