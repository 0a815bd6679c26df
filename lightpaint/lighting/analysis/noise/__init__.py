"""What noise does to an answer: error bars, outliers, directions, and a better answer."""
