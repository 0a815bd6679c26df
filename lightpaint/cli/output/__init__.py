"""Output of the terminal: tables, JSON documents, progress, and the words for them."""
