"""Display of linear light: exposure and view transforms."""
