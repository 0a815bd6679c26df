"""Every public function says which argument was meant by a name that it does not have."""

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from batches import small_basis

import lightpaint as lp
from lightpaint.errors import KeywordError


def _calls() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public functions, classes, and what makes objects of them in another way."""
    for name in lp.__all__:
        call = getattr(lp, name)
        if not callable(call) or (isinstance(call, type) and issubclass(call, Exception)):
            continue
        yield name, call
        others = vars(call) if isinstance(call, type) else {}
        for other, kind in others.items():
            if isinstance(kind, classmethod | staticmethod) and not other.startswith("_"):
                yield f"{name}.{other}", getattr(call, other)


#: It passes names on to Lighting, which tells.
CALLS = {name: call for name, call in _calls() if name != "Lighting.of_weights"}


def _keywords(call: Callable[..., Any]) -> list[str]:
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [x.name for x in inspect.signature(call).parameters.values() if x.kind in kinds]


@pytest.mark.parametrize("name", CALLS)
def test_a_name_with_a_slip_is_told_with_the_one_that_was_meant(name: str) -> None:
    call = CALLS[name]
    known_keywords = _keywords(call)
    for word in (word for word in known_keywords if len(word) > 3):
        slip = word[:1] + word[2:]  # a letter that was not typed
        with pytest.raises(KeywordError) as refusal:
            call(**{slip: None})
        message = str(refusal.value)
        assert message.startswith(f"{name}() has no argument {slip!r}: did you mean '"), message
        assert any(f"mean {other!r}?" in message for other in known_keywords), message
        assert isinstance(refusal.value, TypeError)
        assert isinstance(refusal.value, lp.LightpaintError)


@pytest.mark.parametrize("name", CALLS)
def test_a_name_that_is_near_none_is_told_with_all(name: str) -> None:
    with pytest.raises(KeywordError, match=r"has no argument .*; it has") as refusal:
        CALLS[name](xyzzyqwv=1)
    assert "\n" not in str(refusal.value)


def test_what_is_passed_on_is_known_too() -> None:
    for call, slip, expected in (
        (lp.Settings, "sp", "spp"),
        (lp.solve, "hodl", "hold"),
        (lp.solve, "resiz", "resize"),
        (lp.paint_with_light, "qualiti", "quality"),
    ):
        with pytest.raises(KeywordError, match=f"mean '{expected}'"):
            call(**{slip: 1})


def test_the_advice_of_an_error_can_be_followed() -> None:
    basis = small_basis()
    large = np.repeat(np.repeat(basis.images.sum(axis=0), 5, axis=0), 5, axis=1)[:36, :54]
    target = lp.Target.of(large)
    with pytest.raises(lp.LightpaintError, match="pass resize=True"):
        lp.solve(basis, target)
    lighting = lp.solve(basis, target, resize=True).lighting
    expected = lp.solve(basis, target.resized((8, 12))).lighting
    np.testing.assert_array_equal(
        list(lighting.emission.values()), list(expected.emission.values())
    )


def test_a_target_is_light() -> None:
    image = small_basis().images[0]
    for invalid in (-image, np.where(np.arange(12)[:, None] == 3, -image, image)):
        with pytest.raises(lp.LightpaintError, match=r"negative luminance in \d+ of 96 pixels"):
            lp.Target.of(invalid)
    for invalid in (np.nan, np.inf, -np.inf):
        with pytest.raises(lp.LightpaintError, match="NaN or Inf in 1 of 96 pixels"):
            lp.Target.of(np.where(np.arange(96).reshape(8, 12, 1) == 50, invalid, image))
    # What does not count, colours that Rec.709 lacks, and what resampling leaves beside edges.
    column = np.tile(np.arange(12) == 3, (8, 1))
    lp.Target.of(np.where(column[..., None], -image, image), ~column)
    lp.Target.of(image * (-0.1, 1.0, 1.0))
    lp.Target.of(image - 5e-4)
