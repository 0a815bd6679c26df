"""Does the scene really look like that? The relit XML, and an independent render of it."""
