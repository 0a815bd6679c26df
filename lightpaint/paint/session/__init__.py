"""A painting in progress: its canvas, its lighting, its looks, and the messages about them."""
