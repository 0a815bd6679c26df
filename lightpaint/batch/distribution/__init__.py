"""Engines that run work items, and the division of bases, sums and renders into items."""
