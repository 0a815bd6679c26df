# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's colour management as options of lightpaint's view transform."""

import os

#: Blender's views that lightpaint has its own curve for, if OpenColorIO is not installed with it.
OWN_CURVES = {"Standard": "srgb", "Filmic": "filmic", "AgX": "agx", "Raw": "linear"}


def view_options(scene, config):
    """Return options that show pictures as Blender does, and the environment they need.

    config: path of Blender's OpenColorIO configuration; "" if it is not known.
    """
    settings = scene.view_settings
    exposure = [f"--exposure={settings.exposure:g}"]
    if config and os.path.exists(config):
        view = f"ocio:{scene.display_settings.display_device}/{settings.view_transform}"
        return ["--view", view, *exposure], {"OCIO": config}
    return plain_options(scene), {}


def plain_options(scene):
    """Return options with lightpaint's own curve that is next to Blender's."""
    settings = scene.view_settings
    curve = OWN_CURVES.get(settings.view_transform, "srgb")
    return ["--view", curve, f"--exposure={settings.exposure:g}"]
