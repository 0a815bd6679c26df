"""What a picture costs beside its painting, and the linear problems that stand for it."""
