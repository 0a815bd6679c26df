"""The workers of a Dask cluster, and the files that travel to them and back."""
