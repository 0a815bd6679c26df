"""Targets: a painting becomes a `Target`, an image with importance."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.target.painted_target import PASS_RESIZE as PASS_RESIZE
    from lightpaint.target.painted_target import Target as Target
    from lightpaint.target.painted_target import Wish as Wish
    from lightpaint.target.painted_target import separate as separate
    from lightpaint.target.painted_target import titled as titled
    from lightpaint.target.painted_target import write_painting as write_painting
    from lightpaint.target.target_reader import Paint as Paint
    from lightpaint.target.target_reader import read_over_look as read_over_look
    from lightpaint.target.target_reader import read_target as read_target
    from lightpaint.target.template import CLEAN as CLEAN
    from lightpaint.target.template import LIGHT_FILE as LIGHT_FILE
    from lightpaint.target.template import LIGHTS as LIGHTS
    from lightpaint.target.template import MATTES as MATTES
    from lightpaint.target.template import SHOWN_FILE as SHOWN_FILE
    from lightpaint.target.template import Template as Template
    from lightpaint.target.template import files_in_the_way as files_in_the_way
    from lightpaint.target.template import texts_of as texts_of
    from lightpaint.target.template import write_look as write_look
    from lightpaint.target.template import write_template as write_template
    from lightpaint.target.wish_finding import extend_marked as extend_marked
    from lightpaint.target.wish_finding import extend_saturated as extend_saturated
    from lightpaint.target.wish_finding import find_wishes as find_wishes
    from lightpaint.target.wish_finding import number_places as number_places
    from lightpaint.target.wish_finding import split_wishes as split_wishes

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
