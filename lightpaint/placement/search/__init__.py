"""The search: candidates by direct light, steps of all poses together, and what is worth it."""
