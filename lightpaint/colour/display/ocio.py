"""View transforms from an OpenColorIO configuration (the extra `lightpaint[ocio]`).

The configuration is the one named by the environment variable OCIO, or OpenColorIO's built-in
default. The values of its displays are interpreted like sRGB code values.
"""

import os
from functools import cache
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.display_text import some_names
from lightpaint.errors import ViewError
from lightpaint.files import first_line

#: Names of linear Rec.709 in OpenColorIO's built-in configurations and in others.
LINEAR_REC709 = (
    "Linear Rec.709 (sRGB)",
    "lin_rec709_scene",
    "lin_rec709",
    "lin_srgb",
    "Linear Rec.709",
    "Linear BT.709",
    "Utility - Linear - sRGB",
)

#: Maximum error of a grey after a round trip: one 8-bit step.
MAX_ROUND_TRIP_ERROR = 1 / 255

#: Relative step of numerical derivatives, a compromise between float32 noise and curvature.
STEP = 1e-2


def default_name() -> str:
    """Return the name of the configuration's default transform: `ocio:DISPLAY/VIEW`."""
    _, config = _library_and_config(os.environ.get("OCIO", ""))
    display = config.getDefaultDisplay()
    return f"ocio:{display}/{config.getDefaultView(display)}"


def ocio_encoding(display_and_view: str) -> "OcioEncoding":
    """Return the transform `ocio:DISPLAY/VIEW` of the configuration. Raises ViewError."""
    return _cached(display_and_view, os.environ.get("OCIO", ""))


@cache
def _cached(display_and_view: str, source: str) -> "OcioEncoding":
    return OcioEncoding(display_and_view, source)


class OcioEncoding:
    """A display and view. Raises ViewError if they do not exist, or cannot be inverted."""

    def __init__(self, display_and_view: str, source: str) -> None:
        self._name = f"ocio:{display_and_view}"
        ocio, config = _library_and_config(source)
        display, view = _display_and_view(display_and_view, config)
        try:
            self._to_display = _processors(ocio, config, display, view)
        except (ocio.Exception, ocio.ExceptionMissingFile) as error:
            raise ViewError(f"{self._name} cannot be used: {first_line(error)}") from error
        try:
            self._to_light = _processors(ocio, config, display, view, inverse=True)
        except (ocio.Exception, ocio.ExceptionMissingFile) as error:
            raise ViewError(
                f"{self._name} cannot be inverted, which reading a painting needs: "
                f"{first_line(error)}"
            ) from error
        self._check_round_trip()
        self.white = float(self.decode(np.ones((1, 1, 3), np.float32)).max())

    def encode(self, image: Floats) -> Floats:
        return np.clip(_applied(self._to_display, image), 0, 1)

    def decode(self, image_display: Floats) -> Floats:
        return _applied(self._to_light, image_display)

    def encode_planes(self, planes: Floats) -> Floats:
        return self.encode(planes.T).T

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        step = np.maximum(np.abs(planes).max(axis=0), 1e-4) * STEP
        columns = []
        for k in range(3):
            direction = np.zeros((3, 1))
            direction[k] = 1
            forward = self.encode((planes + step * direction).T)
            down = self.encode((planes - step * direction).T)
            columns.append((forward - down).T / (2 * step))
        return self.encode_planes(planes), np.stack(columns, axis=1)

    def _check_round_trip(self) -> None:
        greys = np.repeat(np.linspace(0.05, 0.95, 19, dtype=np.float32), 3).reshape(1, 19, 3)
        error = np.abs(self.encode(self.decode(greys)) - greys).max()
        if not error <= MAX_ROUND_TRIP_ERROR:
            raise ViewError(
                f"{self._name} cannot be inverted: a grey comes back {error:.2g} off, of display "
                "values from 0 to 1; choose another view"
            )


def _library_and_config(source: str) -> tuple[Any, Any]:
    try:
        import PyOpenColorIO
    except ImportError:
        raise ViewError(
            "views of OpenColorIO need an extra package: pip install 'lightpaint[ocio]'"
        ) from None
    ocio: Any = PyOpenColorIO
    # Its log repeats errors that are raised anyway, or concerns roles that are not used here.
    level = ocio.GetLoggingLevel()
    ocio.SetLoggingLevel(ocio.LOGGING_LEVEL_NONE)
    try:
        if source:
            config = ocio.Config.CreateFromFile(source)
        else:
            config = ocio.Config.CreateFromBuiltinConfig("ocio://default")
        config.validate()
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        detail = first_line(error, path=source or None)
        origin = f"OCIO={source}" if source else "the built-in configuration"
        raise ViewError(f"{origin} is not an OpenColorIO configuration: {detail}") from error
    finally:
        ocio.SetLoggingLevel(level)
    return ocio, config


def _display_and_view(display_and_view: str, config: Any) -> tuple[str, str]:
    displays = list(config.getDisplays())
    for display in displays:
        if display_and_view.startswith(f"{display}/"):
            view = display_and_view[len(display) + 1 :]
            views = list(config.getViews(display))
            if view in views:
                return display, view
            raise ViewError(
                f"display {display!r} has no view {view!r}: it has {some_names(views) or 'none'}"
            )
    raise ViewError(
        f"no view ocio:{display_and_view}: expected ocio:DISPLAY/VIEW, with a display of "
        f"{some_names(displays) or 'which the configuration has none'}"
    )


def _processors(
    ocio: Any, config: Any, display: str, view: str, *, inverse: bool = False
) -> list[Any]:
    """Return the processors from linear Rec.709 to the display, in order, or for the inverse."""
    direction = ocio.TRANSFORM_DIR_INVERSE if inverse else ocio.TRANSFORM_DIR_FORWARD
    linear = next((n for n in LINEAR_REC709 if config.getColorSpace(n) is not None), None)
    source = linear or "scene_linear"
    transform = ocio.DisplayViewTransform(src=source, display=display, view=view)
    chain = [config.getProcessor(transform, direction)]
    if linear is None:
        # Convert through the interchange spaces that the configuration declares.
        conversion = ocio.Config.GetProcessorFromBuiltinColorSpace
        if inverse:
            conversion = ocio.Config.GetProcessorToBuiltinColorSpace
            chain.append(conversion(config, source, LINEAR_REC709[0]))
        else:
            chain.insert(0, conversion(LINEAR_REC709[0], config, source))
    return [processor.getDefaultCPUProcessor() for processor in chain]


def _applied(processors: list[Any], image: Floats) -> Floats:
    # The library works in place, on contiguous float32 rows of pixels.
    pixels = np.array(image, dtype=np.float32, order="C").reshape(1, -1, 3)
    for processor in processors:
        processor.applyRGB(pixels)
    return pixels.reshape(image.shape)
