"""The version of lightpaint, written into every file it makes."""

__version__ = "1.0.0"
