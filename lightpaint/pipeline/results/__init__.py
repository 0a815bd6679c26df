"""The results of a run: its folder, and the files of its answer."""
