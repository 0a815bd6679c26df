# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways without the painter: a picture to paint over, a solve for an image, a reference."""

import os

import bpy
from bpy_extras.io_utils import ImportHelper

from ..painter.solves import AREAS, BackgroundWork, make_template, solve_like, solve_picture
from ..shot.image_files import edited_image, image_file
from ..shot.view_options import plain_options, view_options
from .controller import controller, ocio_path, shot_folder
from .live_session import show_preview
from .shot_operators import ShotOperator, is_rendered, prepare_shot

#: Labels of the areas that are compared.
NAMES = {"whole": "Whole", "regions": "Regions", "parts": "Same View"}


class PendingSolve:
    """A solve in the background, and what becomes of its result."""

    def __init__(self, work, finish, scene, view_layer):
        self._work, self._finish = work, finish
        self._names = scene.name, view_layer.name
        self.result = ("", False)

    def tick(self):
        """Look whether it is done. Return whether it is; `result` then has a sentence."""
        if not self._work.is_done:
            return False
        scene = bpy.data.scenes.get(self._names[0])
        view_layer = scene.view_layers.get(self._names[1]) if scene else None
        if self._work.error:
            self.result = (self._work.error, True)
        elif view_layer is None:
            self.result = ("the scene of this solve is no longer there", True)
        else:
            self.result = (self._finish(scene, view_layer, self._work.result), False)
        return True


class SolveOperator(ShotOperator):
    """An operator that solves in the background"""

    @classmethod
    def poll(cls, context):
        return super().poll(context) and controller.solve is None

    def begin(self, context, text, finish, function, *arguments):
        """Start a function of `solves` with program and shot as its first arguments."""
        program, folder = controller.check_program(), shot_folder(context.scene)
        prepare_shot(context)
        if not is_rendered(context.scene, context.view_layer, folder):
            raise ValueError("the shot has changed, or is not rendered yet: press Render first")
        folder.check_writable()
        work = BackgroundWork(function, program, str(folder.render), *arguments)
        pending = PendingSolve(work, finish, context.scene, context.view_layer)
        controller.begin_solve(pending, text)
        return ""


class LIGHTPAINT_OT_paint_over(SolveOperator):
    """Open the shot's picture as an image, to paint over it in the image editor"""

    bl_idname, bl_label = "lightpaint.paint_over", "Paint Over in Blender"

    def run(self, context):
        folder = os.path.join(shot_folder(context.scene).path, "template")
        views = views_of(context.scene)
        return self.begin(
            context, "the picture to paint over is made …", open_image, make_template, folder, views
        )


class LIGHTPAINT_OT_solve_image(SolveOperator):
    """Find the lights that come closest to the image in the image editor"""

    bl_idname, bl_label = "lightpaint.solve_image", "Solve for Image"

    def run(self, context):
        image = edited_image(context)
        if image is None:
            raise ValueError("no image is open: open one in an image editor")
        folder = shot_folder(context.scene)
        template = os.path.join(folder.path, "template")
        os.makedirs(template, exist_ok=True)
        picture = image_file(image, template)
        answer = os.path.join(folder.path, "answer")
        text = f"lightpaint solves for {image.name} …"
        views = views_of(context.scene)
        return self.begin(context, text, show_answer, solve_picture, picture, answer, views)


class LIGHTPAINT_OT_look_like(SolveOperator, ImportHelper):
    """Give the shot the light of another picture: a photograph, a painting, a film still"""

    bl_idname, bl_label = "lightpaint.look_like", "Look Like Reference"

    filter_glob: bpy.props.StringProperty(
        default="*.png;*.jpg;*.jpeg;*.webp;*.tif;*.tiff;*.psd;*.exr;*.hdr", options={"HIDDEN"}
    )
    areas: bpy.props.EnumProperty(
        name="Compared", items=[(name, NAMES[name], "") for name in AREAS], default="regions"
    )

    def run(self, context):
        if not os.path.isfile(self.filepath):
            raise ValueError(f"there is no picture {self.filepath}")
        session = os.path.join(shot_folder(context.scene).path, "reference")
        name = os.path.basename(self.filepath)
        text = f"lightpaint looks for the light of {name} …"
        return self.begin(
            context, text, show_answer, solve_like, self.filepath, session, self.areas
        )


def views_of(scene):
    """Return options of Blender's own view, and of lightpaint's nearest, for a command."""
    options, variables = view_options(scene, ocio_path())
    return [(options, variables), (plain_options(scene), {})]


def show_answer(scene, view_layer, factors):
    """Show an answer as a preview. Return a sentence on it."""
    changed = show_preview(scene, view_layer, factors)
    return "the lamps show the answer: apply or discard it" if changed else "no lamp has to change"


def open_image(scene, view_layer, path):
    """Open a picture in an image editor, if there is one. Return a sentence on where it is."""
    image = bpy.data.images.load(path, check_existing=True)
    image.reload()
    image.name = "lightpaint painting"
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = image
                area.spaces.active.ui_mode = "PAINT"
                return "paint over the picture in the image editor, then press Solve for Image"
    return f"choose the image {image.name} in an image editor, and paint over it"


CLASSES = (LIGHTPAINT_OT_paint_over, LIGHTPAINT_OT_solve_image, LIGHTPAINT_OT_look_like)
