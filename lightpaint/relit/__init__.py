"""The relit scene: its XML, and an independent render that verifies it."""
