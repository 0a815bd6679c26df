"""How an answer looks beside its painting, and what keeps it from looking closer."""
