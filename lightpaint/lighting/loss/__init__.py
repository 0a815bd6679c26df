"""Losses of a picture against its painting, and the linear problems that stand for them."""
