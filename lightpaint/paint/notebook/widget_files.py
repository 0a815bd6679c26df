"""The page for hosts that take one script and one style sheet: notebooks."""

from lightpaint.viewer.bundle import bundled, styles


def widget_script() -> str:
    """Return the painter as one ES module, whose default export is an anywidget's."""
    return bundled("paint/page/widget.js")


def widget_style() -> str:
    """Return the style sheet of the painter."""
    return styles("paint/page/style.css")
