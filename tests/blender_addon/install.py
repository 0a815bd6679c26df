"""Installs the archive as a user does: as an extension from Blender 4.2 on, as an add-on before."""

import sys

import bpy

archive = sys.argv[-1]
if bpy.app.version >= (4, 2):
    import addon_utils

    addon_utils.enable("bl_pkg", default_set=True)
    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
else:
    bpy.ops.preferences.addon_install(filepath=archive)
    bpy.ops.preferences.addon_enable(module="lightpaint_blender")
[name] = (name for name in bpy.context.preferences.addons.keys() if "lightpaint" in name)  # noqa: SIM118
assert bpy.context.preferences.addons[name].preferences.program == ""
assert bpy.ops.lightpaint.prepare() == {"FINISHED"}
assert [group.name for group in bpy.context.view_layer.lightgroups] == ["Light", "World"]
bpy.ops.preferences.addon_disable(module=name)
assert not hasattr(bpy.types.Scene, "lightpaint_settings")
