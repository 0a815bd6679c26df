"""Photometry of a scene: illuminance in lux on measuring planes, and glare, from every light."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.photometry.glare import LARGEST_ANGLE as LARGEST_ANGLE
    from lightpaint.photometry.glare import LEAST_ANGLE as LEAST_ANGLE
    from lightpaint.photometry.glare import LEAST_RATING as LEAST_RATING
    from lightpaint.photometry.glare import Glare as Glare
    from lightpaint.photometry.glare import GlareReading as GlareReading
    from lightpaint.photometry.illuminance import LARGEST_ERROR as LARGEST_ERROR
    from lightpaint.photometry.illuminance import NORMAL_95 as NORMAL_95
    from lightpaint.photometry.illuminance import PRESETS as PRESETS
    from lightpaint.photometry.illuminance import Illuminance as Illuminance
    from lightpaint.photometry.illuminance import LightCase as LightCase
    from lightpaint.photometry.illuminance import MeasuringPlane as MeasuringPlane
    from lightpaint.photometry.illuminance import PlaneReading as PlaneReading
    from lightpaint.photometry.illuminance import PowerBudget as PowerBudget
    from lightpaint.photometry.illuminance import plane_title as plane_title
    from lightpaint.photometry.illuminance import relative_intervals as relative_intervals
    from lightpaint.photometry.readings_file import PLANES as PLANES
    from lightpaint.photometry.readings_file import POINTS as POINTS
    from lightpaint.photometry.readings_file import false_colours as false_colours
    from lightpaint.photometry.readings_file import glare_document as glare_document
    from lightpaint.photometry.readings_file import measured_origin as measured_origin
    from lightpaint.photometry.readings_file import missed_wishes as missed_wishes
    from lightpaint.photometry.readings_file import readings_document as readings_document
    from lightpaint.photometry.readings_file import readings_files as readings_files
    from lightpaint.photometry.readings_file import write_readings as write_readings

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
