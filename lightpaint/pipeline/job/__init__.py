"""A job: the request of a run, checked once."""
