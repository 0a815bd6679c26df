"""Engines that run work items, and what is parted among them: bases, sums, renders."""
