"""Basis files: parts, checksums, and planes whose rows are read on demand."""
