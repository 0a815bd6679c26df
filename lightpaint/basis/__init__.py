"""What does each light do alone? A `Scene` becomes a `Basis`: one image per light."""
