"""View transforms: inverses, derivatives, and other people's numbers for the same curves."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from transform_slopes import slopes_of

from lightpaint.colour.display.tone_curves import AGX_INSET, MIDDLE_GREY
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import decode_display, encode_display
from lightpaint.errors import ViewError

BUILT_IN = ["srgb", "linear", "filmic", "agx"]
STOPS = st.sampled_from([-3.0, -0.5, 0.0, 2.0])


def _within(transform: ViewTransform, seed: int = 0, size: int = 4000) -> Any:
    """Colours that the view shows without clipping, over 10 stops."""
    rng = np.random.default_rng(seed)
    grey = transform.white * np.exp2(rng.uniform(-10, 0, (size, 1)))
    return grey * rng.uniform(0.5, 1, (size, 3))


@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize("stops", [-2.0, 0.0, 1.5])
def test_decoding_undoes_encoding(name: str, stops: float):
    transform = ViewTransform(name, stops)
    linear = _within(transform)
    display = transform.encode(linear)
    assert (display > 0).all()
    assert (display < 1).all()
    # float64, through a curve whose slope in relative terms is at least 0.01 here.
    np.testing.assert_allclose(transform.decode(display), linear, rtol=1e-11)
    single = transform.decode(transform.encode(linear.astype(np.float32)))
    assert single.dtype == np.float32
    # One rounding of display values to 2^-24, over the same slopes.
    np.testing.assert_allclose(single, linear, rtol=1e-4)


@given(
    name=st.sampled_from(BUILT_IN), display=hnp.arrays(np.float64, (2, 3), elements=st.floats(0, 1))
)
def test_encoding_undoes_decoding(name: str, display: Any):
    """But for colours that need negative light in agx, which are clipped."""
    transform = ViewTransform(name)
    linear = transform.decode(display)
    inset = linear @ AGX_INSET.T
    is_in_gamut = np.ones(2, bool) if name != "agx" else (inset >= 2.0**-12.47).all(axis=-1)
    # The two halves of sRGB miss each other by 3e-8 in the standard's own numbers.
    np.testing.assert_allclose(
        transform.encode(linear)[is_in_gamut], display[is_in_gamut], rtol=0, atol=2e-7
    )


@pytest.mark.parametrize("name", BUILT_IN)
def test_white_is_where_the_display_saturates(name: str):
    transform = ViewTransform(name, 0.75)
    near = transform.white * np.array([[1 - 1e-3] * 3, [1] * 3, [1 + 1e-3] * 3, [1000] * 3])
    display = transform.encode(near)
    assert (display[0] < 1).all()
    np.testing.assert_allclose(display[1:], 1, atol=1e-12)
    np.testing.assert_allclose(transform.decode(np.ones(3)), transform.white, rtol=1e-12)


@pytest.mark.parametrize("name", BUILT_IN)
def test_greys_rise_and_black_is_black(name: str):
    transform = ViewTransform(name)
    ramp = np.repeat(np.geomspace(2e-4, transform.white, 5000)[:, None], 3, axis=1)
    display = transform.encode(ramp)
    assert (np.diff(display, axis=0) > 0).all()
    np.testing.assert_array_equal(transform.encode(np.array([[0, 0, 0], [-1, -1, -1]])), 0)
    np.testing.assert_array_equal(transform.decode(np.zeros((1, 3))), 0)


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_derivative_is_that_of_differences(name: str):
    transform = ViewTransform(name, 0.5)
    linear = _within(transform, seed=1, size=500)
    # A knot of the sRGB curve within the step would show as a miss of 3 %.
    linear = linear[(np.abs(linear * 2**0.5 / 0.0031308 - 1) > 1e-3).all(axis=-1)]
    jacobian = slopes_of(transform, linear)
    for k in range(3):
        step = np.zeros(3)
        step[k] = 1e-5
        above, below = transform.encode(linear * (1 + step)), transform.encode(linear * (1 - step))
        slope = (above - below) / (2e-5 * linear[:, k : k + 1])
        np.testing.assert_allclose(jacobian[..., k], slope, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", BUILT_IN)
def test_where_the_display_clips_nothing_changes(name: str):
    transform = ViewTransform(name)
    clipped = np.array([[2 * transform.white] * 3, [-1.0] * 3])
    np.testing.assert_array_equal(slopes_of(transform, clipped), 0)


@given(stops=STOPS, name=st.sampled_from(BUILT_IN))
def test_stops_scale_light(stops: float, name: str):
    linear = _within(ViewTransform(name), size=20)
    display = ViewTransform(name, stops).encode(linear / 2**stops)
    np.testing.assert_allclose(display, ViewTransform(name).encode(linear), rtol=1e-12)


def test_srgb_is_the_displays_own_curve():
    ramp = np.linspace(0, 1, 99).reshape(-1, 3)
    np.testing.assert_array_equal(ViewTransform().encode(ramp), encode_display(ramp))
    np.testing.assert_array_equal(ViewTransform().decode(ramp), decode_display(ramp))


def test_agx_against_wrensch():
    """The polynomial that game engines fit to the same curve (Wrensch, Minimal AgX, 2023)."""
    x = np.linspace(0, 1, 200)
    fitted = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    light = np.exp2(x * 16.5 - 12.47393)[:, None].repeat(3, axis=1)
    # Its own mean square is 3.7e-6; the largest miss against Sobotka's parameters is 0.006.
    np.testing.assert_allclose(ViewTransform("agx").encode(light)[:, 0], fitted, rtol=0, atol=0.007)
    wrensch = np.array([
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ])  # fmt: skip
    np.testing.assert_allclose(AGX_INSET, wrensch, rtol=0, atol=1e-4)


def test_agx_at_its_pivot():
    """Middle grey is half of the display, and a stop there is 2/16.5 of it."""
    transform = ViewTransform("agx")
    np.testing.assert_allclose(transform.encode(np.full(3, MIDDLE_GREY)), 0.5, atol=1e-12)
    grey = np.full((1, 3), MIDDLE_GREY)
    slope = slopes_of(transform, grey)[0].sum(axis=-1) * MIDDLE_GREY * np.log(2)
    np.testing.assert_allclose(slope, 2 / 16.5, rtol=1e-12)


@pytest.mark.parametrize(
    ("light", "toned"), [(0.0, 0.0), (0.18, 0.2669), (1.0, 0.8038), (7.2420, 1.0)]
)
def test_filmic_is_narkowiczs_curve(light: float, toned: float):
    # x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14) by hand, to four digits.
    display = decode_display(ViewTransform("filmic").encode(np.full(3, light)))
    np.testing.assert_allclose(display, toned, atol=6e-5)


@pytest.mark.parametrize("name", BUILT_IN)
def test_names_round_trip(name: str):
    transform = ViewTransform.parse(f" {name.upper()} ", 1.5)
    assert transform == ViewTransform(name, 1.5)
    assert ViewTransform.parse(transform.name, transform.stops) == transform


@pytest.mark.parametrize("name", ["", "rec709", "ocio:", "ocio:x", "ocio:no display/no view"])
def test_no_such_view(name: str):
    with pytest.raises(ViewError, match="expected"):
        ViewTransform.parse(name)


@pytest.mark.parametrize("stops", [np.nan, np.inf, -1000.0])
def test_absurd_exposures(stops: float):
    with pytest.raises(ViewError, match="out of range"):
        ViewTransform("srgb", stops)
