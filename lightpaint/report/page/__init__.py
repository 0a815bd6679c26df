"""report.html and its sections, its mixer, and what notebooks show."""
