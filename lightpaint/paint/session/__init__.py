"""A painting in progress: its canvas, its lighting, its looks, and what pages hear of them."""
