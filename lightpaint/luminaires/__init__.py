"""Luminaires: measured light distributions, their files, and emitters of Mitsuba that have them."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

#: Names of the emitters that lightpaint adds to Mitsuba: a point, and a flat shape.
POINT_PLUGIN, AREA_PLUGIN = "ies", "iesarea"
LUMINAIRE_PLUGINS = frozenset({POINT_PLUGIN, AREA_PLUGIN})

#: Unit of the emission of luminaires, which is a multiple of that at full.
FULL = "× at full"

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.luminaires.luminaire_request import (
        LUMINAIRE_KEYS, NUMBER_KEYS, PHOTOMETRY, LuminaireRequest, luminaires_in,
    )
    from lightpaint.luminaires.web import (
        EMITTER_FROM_WEB, PhotometricWeb, SpotPart, hanging_frame, spots_of, world_from_web,
    )
    from lightpaint.luminaires.web_file import flux_remark, read_web, unread_remark
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
