"""A panel hides what is behind it, in the fit of weights and in the slopes of the picture."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.look_goals import LookGoal
from lightpaint.placement.paths.frozen_paths import FrozenPaths
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import ViewPaths
from lightpaint.placement.placement_fit import (
    PlacementFit,
    picture_slopes,
    seen_columns,
    with_columns,
)
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.scene_reader import load_scene

RNG = np.random.default_rng(4)


def columns_with_panels(lights: int, pixels: int, panels: int) -> np.ndarray:
    """Columns of which the last few hide something."""
    columns = RNG.random((lights, pixels, 4)).astype(np.float32)
    columns[: lights - panels, :, 3] = 0
    return columns


def test_a_panel_hides_its_share_of_all_others_and_nothing_of_itself() -> None:
    columns = np.zeros((2, 2, 4), np.float32)
    columns[0, :, :3] = 8.0
    columns[1, 0] = (1, 2, 3, 0.25)  # a panel in front of a quarter of the first pixel
    seen = seen_columns(columns)
    assert seen[0, 0] == pytest.approx([6, 6, 6])
    assert seen[0, 1] == pytest.approx([8, 8, 8])
    assert seen[1, 0] == pytest.approx([1, 2, 3])
    uncovered = with_columns(columns, {1: np.ones((2, 3), np.float32)})
    assert seen_columns(uncovered) == pytest.approx(uncovered[:, :, :3])


@pytest.mark.parametrize("panels", [0, 1, 2])
def test_slopes_of_the_picture_are_those_of_finite_differences(panels: int) -> None:
    columns = columns_with_panels(4, 50, panels)
    slopes = columns_with_panels(4, 50, panels) - columns_with_panels(4, 50, panels)
    weights = RNG.random((4, 3))
    if not panels:
        columns, slopes = columns[:, :, :3], slopes[:, :, :3]
    for c in range(3):
        rows = picture_slopes(columns, weights, slopes, range(4), c)
        for k, row in enumerate(rows):
            pictures = []
            for step in (0.01, -0.01):
                moved = columns.astype(np.float64)
                moved[k] += step * slopes[k]
                pictures.append(weights[:, c] @ seen_columns(moved)[:, :, c])
            # The picture is linear in each column.
            assert row == pytest.approx((pictures[0] - pictures[1]) / 0.02, abs=1e-5)


def test_a_fit_does_not_take_a_panel_for_free_that_hides_a_bright_wall() -> None:
    """Its light, which is dim, would help as a column alone."""
    goal = np.full((100, 3), 1.1)
    knobs = tuple(Knob.of_any_colour(k) for k in range(2))
    look = LookGoal(
        goal, np.ones_like(goal), Reduction(np.zeros((2, 3)), ("", ""), knobs), None, 0 * goal
    )
    columns = np.zeros((2, 100, 4), np.float32)
    columns[0, :, :3], columns[0, :50, :3] = 1.0, 1.1
    columns[1, 50:, :3] = 0.1
    fit = PlacementFit(columns, [look])
    assert fit.fitted(columns).missed == pytest.approx(0, abs=1e-6)
    columns[1, 50:60, 3] = 1.0
    fitted = fit.fitted(columns)
    residuals = goal - fit.picture(columns, fitted.weights)
    assert fitted.missed == pytest.approx(np.square(residuals).sum(), rel=1e-5)
    assert fitted.missed > 5


def test_panels_hide_what_a_render_shows_to_be_behind_them(tmp_path: Path) -> None:
    """One with its black back to the camera, and one with its front, each before a lit room."""
    scene = load_scene(write_room(tmp_path))
    plain = lp.render_basis(scene, spp=64, seed=1).current_look
    shares = []
    for sign in (1, -1):
        place = (0.2, 1.0, 0.8)
        target = (place[0] + 0.1, place[1], place[2] + sign)
        emitter = NewEmitter(
            "square", "panel", lp.Pose(position=place, target=target), (0.5, 0.5), (0, 0, 1e-9)
        )
        hidden_by = scene.with_new_emitters([emitter])
        rendered = lp.render_basis(hidden_by, spp=64, seed=1).current_look
        site = next(x for x in hidden_by.emitters if x.name == "square").site
        panel = PanelSite(site.position, site.direction, side=0.5)

        def columns(loaded: object, panel: PanelSite = panel) -> np.ndarray:
            return ViewPaths([FrozenPaths(scene, loaded, first_hits=16, bounces=0)]).columns(
                [panel]
            )

        share = scene.while_loaded(columns)[0, :, 3]
        black = rendered.reshape(-1, 3).max(axis=1) < 1e-3 * plain.reshape(-1, 3).max(axis=1)
        assert black.sum() > 5
        assert share[black].min() > 0.99  # pixels that see the panel alone
        assert share.max() <= 1 + 1e-5
        visible = np.flatnonzero(share == 0)
        assert not black[visible].any()
        shares.append(share)
    # A square is as large from behind.
    assert shares[0].sum() == pytest.approx(shares[1].sum(), rel=0.1)
