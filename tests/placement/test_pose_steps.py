"""Slides of panels and spots along lines that they look alike on, along frozen paths."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.lights_to_place import Arrangement, Movable
from lightpaint.placement.look_goals import LookGoal
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.placement.placement_fit import PlacementFit, seen_columns
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.site import Site, unit
from lightpaint.scene.scene_reader import load_scene

BOX = ((-1.0, 0.1, -0.9), (1.0, 2.0, 2.5))
EYE = np.array([0.0, 1.0, 3.5])


def test_a_panel_with_the_right_outline_finds_its_distance(tmp_path: Path) -> None:
    """Only its light on walls and floor tells that, and the sides that it may have bound it."""
    room = load_scene(write_room(tmp_path))
    true = PanelSite((-0.3, 1.3, 0.2), unit((0.4, -0.5, 1.0)), side=0.3)
    near = EYE + 0.7 * (np.array(true.position) - EYE)
    wrong = replace(true, position=tuple(near.tolist()), side=0.7 * true.side)

    def found(loaded: Any, sides: tuple[float, float]) -> PanelSite:
        at = SearchPaths([room], [room], loaded, seed=1).compare
        goal = 5.0 * seen_columns(at.columns([true]))[0].astype(float)
        reduction = Reduction(np.zeros((1, 3)), ("",), (Knob.of_any_colour(0),))
        look = LookGoal(goal, np.ones_like(goal), reduction, None, np.zeros_like(goal))
        fit = PlacementFit(np.zeros((1, len(goal), 4), np.float32), [look])
        steps = PoseSteps(fit, 1.0, lambda *_: True)
        light = FreeLight("new", wrong, lp.Freedom(box=BOX, aim=True), sides=sides)
        movables = (Movable(light, (0,), None, lp.NewLights("panel")),)
        start = Arrangement(movables, (wrong,), steps.fitted(movables, (wrong,), at))
        slid = steps.slid(start, at)
        assert slid.missed < start.missed
        [site] = slid.sites
        assert isinstance(site, PanelSite)
        return site

    free, bounded = (
        room.while_loaded(lambda loaded, sides=sides: found(loaded, sides))
        for sides in ((0.1, 0.9), (0.1, 0.25))
    )
    assert free.position == pytest.approx(true.position, abs=0.06)  # steps of 2.5 %
    assert free.side == pytest.approx(true.side, rel=0.03)
    assert bounded.side <= 0.25


def test_a_spot_with_the_right_circle_of_light_finds_its_distance(tmp_path: Path) -> None:
    """The falloff within the circle tells that, and light from there on the wall."""
    room = load_scene(write_room(tmp_path))
    circle = np.array([-0.3, 0.0, 0.1])
    place = np.array([0.3, 1.2, 0.9])
    true = Site(tuple(place.tolist()), unit(circle - place), cutoff=25.0, beam=12.0)
    far = circle + 1.5 * (place - circle)
    cutoff, beam = (np.degrees(np.arctan(np.tan(np.radians(x)) / 1.5)) for x in (25, 12))
    wrong = replace(true, position=tuple(far.tolist()), cutoff=cutoff, beam=beam)

    def slid(loaded: Any) -> Site:
        at = SearchPaths([room], [room], loaded, seed=1).compare
        assert at.lit_place(true) == pytest.approx(circle, abs=1e-4)
        assert at.lit_place(replace(true, direction=(0.0, 1.0, 0.0))) is None
        goal = 5.0 * at.columns([true])[0].astype(float)
        reduction = Reduction(np.zeros((1, 3)), ("",), (Knob.of_any_colour(0),))
        look = LookGoal(goal, np.ones_like(goal), reduction, None, np.zeros_like(goal))
        fit = PlacementFit(np.zeros((1, *goal.shape), np.float32), [look])
        steps = PoseSteps(fit, 1.0, lambda *_: True)
        freedom = lp.Freedom(box=BOX, aim=True, cone=(5, 50), beam=True)
        light = FreeLight("new", wrong, freedom)
        movables = (Movable(light, (0,), None, lp.NewLights("spot")),)
        start = Arrangement(movables, (wrong,), steps.fitted(movables, (wrong,), at))
        return steps.slid(start, at).sites[0]

    site = room.while_loaded(slid)
    assert site.position == pytest.approx(true.position, abs=0.06)  # steps of 2.5 %
    assert site.cutoff == pytest.approx(25, rel=0.03)
