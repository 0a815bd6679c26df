"""Drawings of the rig: where lights hang, in the picture, from above and from the side."""
