"""The lights of a scene: its emitters, their emissions, and the file that groups them."""
