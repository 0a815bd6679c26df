"""Photometry of a scene: illuminance in lux on measuring planes, and glare, from every light."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.photometry.glare import (
        LARGEST_ANGLE, LEAST_ANGLE, LEAST_RATING, Glare, GlareReading,
    )
    from lightpaint.photometry.illuminance import (
        LARGEST_ERROR, NORMAL_95, PRESETS, Illuminance, LightCase, MeasuringPlane, PlaneReading,
        PowerBudget, plane_title, relative_intervals,
    )
    from lightpaint.photometry.readings_file import (
        PLANES, POINTS, false_colours, glare_document, measured_origin, missed_wishes,
        readings_document, readings_files, write_readings,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
