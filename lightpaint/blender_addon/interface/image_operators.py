# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways without the painter: a picture to paint over, a solve for an image, a reference."""

import os

import bpy
from bpy_extras.io_utils import ImportHelper

from ..painter.program import plain_options, view_options
from ..painter.solves import AREAS, BackgroundWork, make_template, solve_like, solve_picture
from ..shot.image_files import edited_image, image_file
from ..shot.shot_home import shot_folder
from .controller import controller, ocio_path
from .live_session import show_preview
from .shot_operators import ShotOperator, begin_shot

#: Labels of the areas that are compared, and what they ask for.
NAMES = {
    "whole": ("Whole", "Its colour, and the light of its lit parts and its shadows"),
    "regions": ("Regions", "Also the light of its top, its middle and its bottom"),
    "parts": ("Same View", "The light of nine parts: for a picture of this scene from here"),
}

#: Name in Blender of the picture to paint over.
IMAGE_NAME = "lightpaint painting"

#: Seconds after which Blender knows how large a new window is.
FIT_S = 0.3

#: Number of thumbnails among Blender's ways to list files.
THUMBNAILS = 3


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

    def begin(self, context, text, finish, function, arguments):
        """Start a function of `solves` once the shot is rendered.

        arguments: called with the path of the shot's folder, returns the function's arguments after
        program and shot.
        """
        program = controller.check_program()

        def start(scene, view_layer):
            folder = shot_folder(scene)
            folder.check_writable()
            work = BackgroundWork(
                function, program, str(folder.render), *arguments(str(folder.path))
            )
            controller.begin_solve(PendingSolve(work, finish, scene, view_layer), text)

        if not begin_shot(context, then=start):
            start(context.scene, context.view_layer)
        return ""


class LIGHTPAINT_OT_paint_over(SolveOperator):
    """Open the shot's picture as an image, to paint over it in the image editor"""

    bl_idname, bl_label = "lightpaint.paint_over", "Paint Over in Blender"

    def run(self, context):
        views = views_of(context.scene)

        def arguments(folder):
            return os.path.join(folder, "template"), views

        text = "lightpaint makes the picture to paint over …"
        return self.begin(context, text, open_image, make_template, arguments)


class LIGHTPAINT_OT_solve_image(SolveOperator):
    """Find the lights that come closest to the image in the image editor"""

    bl_idname, bl_label = "lightpaint.solve_image", "Solve for Image"

    def run(self, context):
        image = edited_image(context)
        if image is None:
            raise ValueError("no image is open: open one in an image editor")
        name, views = image.name, views_of(context.scene)

        def arguments(folder):
            painted = bpy.data.images.get(name)
            if painted is None:
                raise ValueError(f"the image {name} is no longer there")
            template = os.path.join(folder, "template")
            os.makedirs(template, exist_ok=True)
            return image_file(painted, template), os.path.join(folder, "answer"), views

        text = f"lightpaint solves for {name} …"
        return self.begin(context, text, show_answer, solve_picture, arguments)


class LIGHTPAINT_OT_look_like(SolveOperator, ImportHelper):
    """Give the shot the light of another picture: a photograph, a painting, a film still"""

    bl_idname, bl_label = "lightpaint.look_like", "Look Like Reference"

    filter_glob: bpy.props.StringProperty(
        default="*.png;*.jpg;*.jpeg;*.webp;*.tif;*.tiff;*.psd;*.exr;*.hdr", options={"HIDDEN"}
    )
    areas: bpy.props.EnumProperty(
        name="Compared", items=[(name, *NAMES[name]) for name in AREAS], default="regions"
    )
    display_type: bpy.props.EnumProperty(
        items=[("THUMBNAIL", "Thumbnails", "", THUMBNAILS)], options={"HIDDEN"}
    )

    def invoke(self, context, event):
        if not self.filepath:  # Blender would propose the name of its own file
            self.properties.filepath = os.path.join(os.path.dirname(bpy.data.filepath), "")
        return super().invoke(context, event)

    def run(self, context):
        if not os.path.isfile(self.filepath):
            raise ValueError(f"there is no picture {self.filepath}")
        picture, areas = self.filepath, self.areas

        def arguments(folder):
            return picture, os.path.join(folder, "reference"), areas

        text = f"lightpaint looks for the light of {os.path.basename(picture)} …"
        return self.begin(context, text, show_answer, solve_like, arguments)


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
    image.name = IMAGE_NAME
    image.use_view_as_render = True  # as the shot is shown
    area = image_area()
    if area is None:
        return f"choose the image {image.name} in an image editor, and paint over it"
    area.type = "IMAGE_EDITOR"
    editor = area.spaces.active
    editor.image, editor.ui_mode = image, "PAINT"
    editor.show_region_ui = editor.show_region_tool_header = True
    bpy.app.timers.register(fit_image, first_interval=FIT_S)
    return "paint over the picture in the image editor, then press Solve for Image"


def fit_image():
    """Show the whole picture in its editors."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type != "IMAGE_EDITOR" or area.spaces.active.image is None:
                continue
            region = next(region for region in area.regions if region.type == "WINDOW")
            if area.spaces.active.image.name == IMAGE_NAME:
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.image.view_all(fit_view=True)


def image_area():
    """Return the largest image editor, or the area of a new window; None if there are no windows.

    The window in which Blender shows a render is none to paint in: the next render takes it.
    """
    windows = bpy.context.window_manager.windows
    areas = [x for w in windows if not w.screen.is_temporary for x in w.screen.areas]
    editors = [area for area in areas if area.type == "IMAGE_EDITOR"]
    if editors or not windows or bpy.app.background:
        return max(editors, key=lambda area: area.width * area.height, default=None)
    with bpy.context.temp_override(window=windows[0]):
        bpy.ops.wm.window_new()
    return windows[-1].screen.areas[0]


CLASSES = (LIGHTPAINT_OT_paint_over, LIGHTPAINT_OT_solve_image, LIGHTPAINT_OT_look_like)
