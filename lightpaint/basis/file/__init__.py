"""The file of a basis: its parts, its checksums, and planes whose rows are read on demand."""
