"""Options of the command line: what each command takes, and the jobs made of it."""
