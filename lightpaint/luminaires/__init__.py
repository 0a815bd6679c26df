"""Luminaires: measured light distributions, their files, and emitters of Mitsuba that have them."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

#: Names of the emitters that lightpaint adds to Mitsuba: a point, and a flat shape.
POINT_PLUGIN, AREA_PLUGIN = "ies", "iesarea"
LUMINAIRE_PLUGINS = frozenset({POINT_PLUGIN, AREA_PLUGIN})

#: Unit of the emission of luminaires, which is a multiple of that at full.
FULL = "× at full"

if TYPE_CHECKING:
    from lightpaint.luminaires.luminaire_request import LUMINAIRE_KEYS as LUMINAIRE_KEYS
    from lightpaint.luminaires.luminaire_request import NUMBER_KEYS as NUMBER_KEYS
    from lightpaint.luminaires.luminaire_request import PHOTOMETRY as PHOTOMETRY
    from lightpaint.luminaires.luminaire_request import LuminaireRequest as LuminaireRequest
    from lightpaint.luminaires.luminaire_request import luminaires_in as luminaires_in
    from lightpaint.luminaires.web import EMITTER_FROM_WEB as EMITTER_FROM_WEB
    from lightpaint.luminaires.web import PhotometricWeb as PhotometricWeb
    from lightpaint.luminaires.web import SpotPart as SpotPart
    from lightpaint.luminaires.web import hanging_frame as hanging_frame
    from lightpaint.luminaires.web import spots_of as spots_of
    from lightpaint.luminaires.web import world_from_web as world_from_web
    from lightpaint.luminaires.web_file import flux_remark as flux_remark
    from lightpaint.luminaires.web_file import read_web as read_web
    from lightpaint.luminaires.web_file import unread_remark as unread_remark

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
