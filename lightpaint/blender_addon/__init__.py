# SPDX-License-Identifier: GPL-3.0-or-later
"""lightpaint in Blender: light groups, the painter, and the painted light back in the lamps.

`lightpaint blender` packs this folder, which is not part of the library: nothing there imports it,
and it imports nothing from there.
"""

bl_info = {
    "name": "lightpaint",
    "author": "lightpaint",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > lightpaint; Properties > Render",
    "description": "Paint how the shot should look; the lamps follow",
    "category": "Lighting",
}


def _modules():
    from .interface import addon_settings, controller, image_operators, panels, shot_operators

    return addon_settings, shot_operators, image_operators, panels, controller


def register():
    import bpy

    for module in _modules():
        for cls in getattr(module, "CLASSES", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()


def unregister():
    import bpy

    for module in reversed(_modules()):
        if hasattr(module, "unregister"):
            module.unregister()
        for cls in reversed(getattr(module, "CLASSES", ())):
            bpy.utils.unregister_class(cls)
