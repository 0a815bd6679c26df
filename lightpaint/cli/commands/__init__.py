"""One function for each sub-command: call the corridor, and show what came out."""
