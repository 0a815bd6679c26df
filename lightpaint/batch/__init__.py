"""Many looks in one run: read a manifest, plan its steps, run them, and show the results."""
