"""How sure an answer is, how it can be better, and why it is not closer."""
