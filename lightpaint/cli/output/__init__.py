"""What the terminal shows: tables, JSON documents, progress, and the words for them."""
