"""Losses of a picture beside its painting, and the linear problems that stand for them."""
