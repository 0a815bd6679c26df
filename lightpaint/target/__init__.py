"""What does the artist want, and where does it matter? A painted EXR becomes a `Target`."""
