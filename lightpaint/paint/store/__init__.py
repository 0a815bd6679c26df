"""The session file: steps, looks and pixels in SQLite, and the recovery of a damaged one."""
