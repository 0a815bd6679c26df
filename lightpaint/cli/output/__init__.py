"""Output: tables, JSON documents, progress, and the words for them."""
