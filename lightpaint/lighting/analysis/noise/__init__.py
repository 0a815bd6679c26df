"""Noise in an answer: error bars, outliers, directions, and a better answer."""
