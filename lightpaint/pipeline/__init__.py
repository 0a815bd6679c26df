"""The pipeline: a job, its run, and its results."""
