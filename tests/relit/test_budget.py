"""What a verification may cost: never more samples than its basis has, unless asked for."""

from dataclasses import dataclass, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.relit.verification_render import FEWEST, verification_budget
from lightpaint.scene.properties.film import Film, reduced, reduction


@dataclass(frozen=True)
class Filmed:
    """What a budget asks of a scene."""

    film: Film

    @property
    def size(self) -> tuple[int, int]:
        return self.film.pixels[1], self.film.pixels[0]

    def reduced(self, resolution: str) -> "Filmed":
        return replace(self, film=reduced(self.film, reduction(self.film, resolution)))


def filmed(width: int, height: int) -> Any:
    return Filmed(Film(0, (width, height), (width, height), (0, 0)))


def samples(budget: Any) -> int:
    height, width = budget.scene.size
    return int(budget.spp * height * width)


def test_a_quarter_of_the_film_is_not_verified_for_sixteen_times_as_long():
    scene = filmed(1280, 720)
    budget = verification_budget(scene, (180, 320), 64, most_spp=64)
    assert (budget.scene, budget.spp, budget.share) == (scene, 4, 1)


def test_few_samples_go_to_a_smaller_film():
    budget = verification_budget(filmed(640, 360), (90, 160), 16)
    assert (budget.scene.size, budget.spp) == ((180, 320), 4)
    budget = verification_budget(filmed(640, 360), (45, 80), 2)
    assert (budget.scene.size, budget.spp) == ((45, 80), 2)


def test_no_more_than_asked_of_each_pixel():
    assert verification_budget(filmed(64, 64), (64, 64), 4096, most_spp=64).spp == 64


def test_what_is_asked_for_is_done_on_the_whole_film():
    scene = filmed(640, 360)
    budget = verification_budget(scene, (90, 160), 16, asked_spp=256)
    assert (budget.scene, budget.spp, budget.share) == (scene, 256, 256)


@given(
    factor=st.integers(1, 24),
    width=st.integers(1, 40),
    height=st.integers(1, 40),
    rest=st.tuples(st.integers(0, 23), st.integers(0, 23)),
    spp=st.integers(2, 4096),
    most=st.none() | st.integers(2, 256),
)
def test_it_takes_no_longer_than_the_basis(
    factor: int, width: int, height: int, rest: tuple[int, int], spp: int, most: int | None
):
    full_film = filmed(width * factor + rest[0] % factor, height * factor + rest[1] % factor)
    small = full_film.reduced(f"1/{factor}")
    budget = verification_budget(full_film, small.size, spp, most_spp=most)
    least = 2 * budget.scene.film.block_pixels
    assert samples(budget) <= spp * width * height or budget.spp == least
    assert budget.share == pytest.approx(samples(budget) / (spp * width * height))
    # A pixel of the basis is a block of its pixels.
    assert whole_factor(budget.scene.size, small.size) is not None
    assert budget.spp >= min(FEWEST, spp, most or spp)
