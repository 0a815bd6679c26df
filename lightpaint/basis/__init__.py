"""The basis of a `Scene`: one image per light."""
