"""The gallery of a batch: a summary of each look, the page and the contact sheet."""
