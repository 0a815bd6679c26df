"""Better places of lights, and new lights: the search, and its results."""
