"""The painter in a notebook: an anywidget over the same page and the same session."""
