"""Targets: a painting becomes a `Target`, an image with importance."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.target.painted_target import (
        PASS_RESIZE, Target, Wish, check_fits, separate, titled, write_painting,
    )
    from lightpaint.target.target_reader import Paint, read_over_look, read_target
    from lightpaint.target.template import (
        CLEAN, LIGHT_FILE, LIGHTS, MATTES, SHOWN_FILE, Template, files_in_the_way, texts_of,
        write_look, write_template,
    )
    from lightpaint.target.wish_finding import (
        extend_marked, extend_saturated, find_wishes, number_places, split_wishes,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
