"""Many looks in one run: a manifest is read, planned, done and shown."""
