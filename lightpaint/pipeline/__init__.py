"""The corridor: a job, its run, and the results that it leaves."""
