"""A job: what a run is asked to do, checked once."""
