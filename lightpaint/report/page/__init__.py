"""report.html with its sections and its mixer, and the output in notebooks."""
