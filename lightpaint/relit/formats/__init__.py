"""The formats in which an answer can be exported, a class each."""
