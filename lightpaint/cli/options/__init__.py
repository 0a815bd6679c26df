"""Options of the command line, and the jobs made from them."""
