# SPDX-License-Identifier: GPL-3.0-or-later
"""The painter that belongs to this Blender: started, observed, and followed by the lamps.

It holds no data of Blender, which undo and loading would make invalid: only names.
"""

import contextlib
import json

import bpy

from ..lamps.lamp_levels import (
    PREVIEWS,
    grouped_places,
    named_places,
    place_names,
    show_drives,
    show_factors,
)
from ..lamps.lamp_units import working_space
from ..lamps.memory import recall, remember
from ..painter.painter_link import PainterLink, checked_address
from ..painter.painter_messages import MessageError, PainterState
from ..painter.program import ProgramRun, paint_arguments, running_painter

#: Words in errors of the painter that ask for another start: the session is of a picture of another
#: size, or of other lights; or OpenColorIO, for Blender's own view, is not installed with it.
NEW_SESSION, OTHER_VIEW = "--new", "ocio"

#: Seconds in which a painter that listens has to answer.
PATIENCE_S = 30.0

#: Distance from 1 of a multiplier that changes nothing.
UNCHANGED = 1e-9

ENDED_TEXT = "the painter has ended: Paint opens it again, with what you painted"

#: The end of a painter that is another program, or of another version.
NOT_UNDERSTOOD = "the painter sent {}: the add-on has left it; is it of the same version?"

#: What there is to do while nothing is painted.
UNPAINTED_TEXT = "paint in the browser, and the lamps follow"


class LiveSession:
    """A painter, from its start to its end.

    Attributes:
        state: What is known of its session.
        message: A sentence for the user about its state.
        has_moved_lamps: Whether the last tick has changed lamps.
    """

    def __init__(self, folder, scene, view_layer):
        self.folder, self.scene_name, self.layer_name = folder, scene.name, view_layer.name
        self.state, self.message, self.is_over = PainterState(), "the painter starts …", False
        self._run: ProgramRun | None = None
        self._link: PainterLink | None = None
        self._program, self._view, self._fallback, self._environment = "", [], None, {}
        self._lights_file = ""
        self._looks_known = None
        self._places: list[tuple[str, str, str, str]] | None = None
        self.has_moved_lamps, self._is_on_hold, self._discarded = False, False, None

    def start(self, program, view, environment, fallback, lights_file=""):
        """Start the painter, or connect to the one that serves this shot already.

        view: options of its view transform, with variables of its environment; fallback: options
        to try if lightpaint is there without what these need. lights_file: what its lamps are made
        of, "" for none. Raises OSError.
        """
        self._lights_file = lights_file
        self._program, self._view, self._environment = program, view, environment
        self._fallback = fallback
        if found := running_painter(self.folder.session):
            self._link = PainterLink(*found)
        else:
            self._start_program()

    @property
    def is_connected(self):
        """True while the painter is there."""
        return self._link is not None and self._link.is_connected and not self.is_over

    @property
    def page_url(self):
        """The address of its page; "" if another Blender has started it."""
        return self._run.page_url if self._run else ""

    def tick(self):
        """Take in what has happened since the last call. Return whether anything has."""
        if self.is_over:
            return False
        if self._link is None:
            return self._await_start()
        has_news = is_lit = False
        try:
            for content, buffers in self._link.messages():
                is_lit |= self.state.receive(content, buffers)
                has_news = True
        except MessageError as error:
            self.end()
            self.message = NOT_UNDERSTOOD.format(error)
            return True
        self.has_moved_lamps = bool(is_lit and not self._is_discarded() and self.show())
        if has_news:
            self.message = self._sentence()
            self._keep_looks()
        if self._link.has_ended:
            self._after_end()
            return True
        return has_news

    def _sentence(self):
        state = self.state
        if self._is_on_hold:
            return ""  # it would be about an answer that was discarded
        if state.is_open and state.is_exact and are_one(state.factors):
            return UNPAINTED_TEXT
        return state.headline or state.notice

    def hold_lamps(self):
        """Leave the lamps alone until something else is painted: the answer was discarded."""
        self._is_on_hold, self.message = True, ""
        self._discarded = dict(self.state.factors) if self.state.is_exact else None

    def _is_discarded(self):
        """Return whether the present answer is one to what had been painted before a discard."""
        if not self._is_on_hold:
            return False
        if self._discarded is None:  # better answers come until the exact one
            if self.state.is_exact:
                self._discarded = dict(self.state.factors)
            return True
        self._is_on_hold = self.state.factors == self._discarded
        return self._is_on_hold

    def show(self, factors=None):
        """Make the lamps follow the painter's answer, or show other multipliers.

        Return how many have changed.
        """
        scene = bpy.data.scenes.get(self.scene_name)
        view_layer = scene.view_layers.get(self.layer_name) if scene else None
        if view_layer is None or bpy.app.is_job_running("RENDER"):
            return 0
        shown = self.state.factors if factors is None else factors
        if not recall(scene).get(PREVIEWS) and self.state.is_new and are_one(shown):
            return 0  # nothing is painted yet
        groups = self._groups(scene, view_layer)
        changed = show_preview(scene, view_layer, shown, groups)
        if factors is None:
            show_drives(groups, self.state.drives)
        return changed

    def forget_places(self):
        """Look for the lamps anew at the next answer."""
        self._places = None

    def _groups(self, scene, view_layer):
        """Return the places of each group, which are looked for in the whole scene only once."""
        groups = named_places(bpy.data, self._places) if self._places is not None else None
        if groups is None:
            groups = grouped_places(scene, view_layer)
            self._places = place_names(groups)
        return groups

    def end(self):
        """End the painter, if it was started here, and the connection to it."""
        if self._link is not None:
            self._link.close()
        if self._run is not None:
            self._run.stop()
        self._end("the painter has ended")

    def _await_start(self):
        """Connect once the painter listens, or tell why it does not."""
        run = self._run
        if run is None:
            return False
        if run.first_line:
            try:
                found = json.loads(run.first_line)
                checked_address(found["address"], found["token"])
                self._link = PainterLink(found["address"], found["token"], PATIENCE_S)
            except (ValueError, KeyError, TypeError, RecursionError):
                self.end()
                self.message = "this is not a painter of lightpaint: check the add-on's preferences"
            return True
        if run.code is None:
            return False
        if not self._start_otherwise(run.error_text):
            self._end(run.error_text)
        return True

    def _start_otherwise(self, error):
        """Start the painter in the way that its error asks for. Return whether there is one."""
        if OTHER_VIEW in error.lower() and self._fallback:
            self._view, self._environment, self._fallback = self._fallback, {}, None
        elif NEW_SESSION in error and NEW_SESSION not in self._view:
            self._view = [*self._view, NEW_SESSION]
            self._fallback = self._fallback and [*self._fallback, NEW_SESSION]
        else:
            return False
        self._start_program()
        return True

    def _start_program(self):
        arguments = paint_arguments(
            self.folder.render, self.folder.session, self._view, self._lights_file
        )
        self._link, self._run = None, ProgramRun(self._program, arguments, self._environment)

    def _after_end(self):
        """Tell why the connection is over, or start a painter if an earlier one has gone."""
        link = self._link
        if link is None:
            return
        if link.is_connected and link.error and not self.state.closing:
            self.end()
            self.message = NOT_UNDERSTOOD.format(link.error)
        elif link.is_connected:
            self._end(self.state.closing or ENDED_TEXT)
        elif self._run is None:  # an earlier painter, which was killed
            self._start_program()
        else:
            self.end()
            self.message = f"the painter does not answer ({link.error}): press Paint again"

    def _keep_looks(self):
        looks = [(look.name, look.factors) for look in self.state.looks]
        if self.state.is_open and looks != self._looks_known:
            self._looks_known = looks
            # If this fails: they are in the painter's session, too.
            with contextlib.suppress(OSError):
                self.folder.write_looks(looks)

    def _end(self, text):
        self.is_over, self.message = True, text


def are_one(factors):
    """Return whether multipliers leave all lamps as they were rendered."""
    return all(abs(value - 1) < UNCHANGED for factor in factors.values() for value in factor)


def show_preview(scene, view_layer, factors, groups=None):
    """Set lamps to multipliers, as a preview that can be discarded. Return how many changed.

    groups: the places of each group; None to look for them.
    """
    if groups is None:
        groups = grouped_places(scene, view_layer)
    changed = show_factors(groups, factors, working_space(bpy.data))
    memory = recall(scene)
    if changed and not memory.get(PREVIEWS):
        remember(scene, {**memory, PREVIEWS: True})
    return changed
