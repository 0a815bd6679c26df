"""Does the scene really look like that? Relit XML, verification, and the report."""
