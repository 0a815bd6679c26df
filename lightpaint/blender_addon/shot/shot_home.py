# SPDX-License-Identifier: GPL-3.0-or-later
"""The home of shots: beside the .blend, or in Blender's temporary folder before it is saved.

FILE.blend has FILE.lightpaint/, with a folder for each scene. When the file gets a name, or another
one, its shots are copied to where the name asks for, as soon as nothing works on them.
"""

import itertools
import os
import shutil
from pathlib import Path

import bpy

from .shot_files import ShotFolder

#: Files that say that a painter runs, or that are not written to their end.
NOT_COPIED = ("painter.json", "*.part", "*.part.exr")


class ShotHome:
    """The folder with the shots of the open file, one for each scene."""

    def __init__(self):
        self._number = 0
        self._path: Path | None = None
        self._wanted: Path | None = None

    def open(self, blend):
        """Take the folder of a file that has been opened. blend: its path; "" if it has none."""
        self._number += 1
        self._path = self._wanted = self._beside(blend)

    def rename(self, blend):
        """Note that the file has been saved. Return whether its shots have to follow."""
        if self._path is None:
            self.open(blend)
        self._wanted = self._beside(blend)
        return self.has_to_follow

    @property
    def has_to_follow(self):
        """True while the shots are where an earlier name of the file has put them."""
        return self._path != self._wanted and self._path is not None and self._path.exists()

    @property
    def path(self):
        """The folder that the shots are in now."""
        if self._path is None:  # an add-on that starts with Blender knows of no file yet
            self.open(bpy.data.filepath)
        if not self.has_to_follow:
            self._path = self._wanted
        return self._path

    def follow(self):
        """Copy the shots to where the file's name asks for. Raises OSError; then they stay."""
        source, target = self._path, self._wanted
        if not self.has_to_follow:
            return
        self._wanted = source
        copy_folder(source, target)
        self._path = self._wanted = target

    def _beside(self, blend):
        if blend:
            return Path(f"{os.path.splitext(blend)[0]}.lightpaint")
        # A number, so that the next file without a name does not find the paintings of this one.
        return Path(bpy.app.tempdir, "lightpaint", str(self._number))


home = ShotHome()


def shot_folder(scene):
    """Return the folder of a scene's shot: the chosen one, or one in the file's home."""
    chosen = scene.lightpaint_settings.folder
    if chosen:
        return ShotFolder(bpy.path.abspath(chosen))
    return ShotFolder(home.path / (bpy.path.clean_name(scene.name) or "scene"))


def is_kept(scene):
    """Return whether the shot of a scene is still there when Blender has ended."""
    return bool(bpy.data.filepath or scene.lightpaint_settings.folder)


def copy_folder(source, target):
    """Copy a folder whole or not at all. One that has this name already gets a number behind it."""
    part = target.with_name(f"{target.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        shutil.copytree(source, part, ignore=shutil.ignore_patterns(*NOT_COPIED))
    except shutil.Error as error:  # a list of what failed, each with its reason
        raise OSError(str(error.args[0][0][-1])) from error
    if target.exists():
        names = (target.with_name(f"{target.name}{number}") for number in itertools.count(1))
        os.replace(target, next(name for name in names if not name.exists()))
    os.replace(part, target)


def move_image_paths(source, target):
    """Make images that were opened from a folder be the images of its copy, with what is
    painted."""
    for image in bpy.data.images:
        path = Path(bpy.path.abspath(image.filepath_raw))
        if image.library is None and path.is_relative_to(source):
            # This property, unlike `filepath`, loads nothing anew.
            image.filepath_raw = str(target / path.relative_to(source))
