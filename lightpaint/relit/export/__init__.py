"""Exports of the answer to other programs."""
