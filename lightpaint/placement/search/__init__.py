"""The search: candidates by direct light, steps of all poses together, and judgement of changes."""
