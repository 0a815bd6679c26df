"""The look of an answer beside its painting, and the reasons why it is not closer."""
