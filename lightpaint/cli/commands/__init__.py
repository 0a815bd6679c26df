"""The functions of the sub-commands: they call the library and print the results."""
