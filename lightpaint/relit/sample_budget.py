"""The budget of a verification: by default at most as many samples as its basis has."""

from dataclasses import dataclass

from lightpaint.images.pixel_blocks import Size, whole_factor
from lightpaint.scene.scene import Scene

#: Minimum samples per pixel of a verification; with fewer, a smaller film is just as good.
FEWEST = 4


@dataclass(frozen=True)
class VerificationBudget:
    """The size and the samples of a verification.

    scene: the relit scene on the film to render. spp: samples per pixel. share: its samples
    relative to those of the basis.
    """

    scene: Scene
    spp: int
    share: float


def verification_budget(
    relit: Scene,
    basis_size: Size,
    basis_spp: int,
    *,
    most_spp: int | None = None,
    asked_spp: int | None = None,
) -> VerificationBudget:
    """Return a verification of `relit` that takes no longer than its basis, or the requested one.

    The samples of the basis are spent on the whole film, or on the largest film of whole blocks
    that has FEWEST in each pixel; the comparison uses means over the blocks of the basis, so either
    film serves. A sample of an ordinary render costs no more than one of a basis. A film that
    cannot be divided into blocks gets at least two samples in each pixel, for two halves, whatever
    the basis has.

    basis_size: (height, width). basis_spp: samples per pixel. most_spp: maximum samples per pixel,
    unless asked_spp is given. asked_spp: samples per pixel of the whole film, whatever they cost.
    """
    samples = basis_spp * basis_size[0] * basis_size[1]
    film_pixels = relit.size[0] * relit.size[1]
    if asked_spp is not None:
        return VerificationBudget(relit, asked_spp, asked_spp * film_pixels / samples)
    factor = whole_factor(relit.size, basis_size) or 1
    for part in range(1, factor + 1):
        if factor % part:
            continue
        scene = relit if part == 1 else relit.reduced(f"1/{part}")
        # A block that is not a pixel of Mitsuba's film costs a sample in each of its film pixels.
        saves = scene.film.block == relit.film.block
        if part < factor and not (saves and whole_factor(scene.size, basis_size) == factor // part):
            continue
        pixels = scene.size[0] * scene.size[1]
        spp = samples // pixels
        if spp >= FEWEST or part == factor:
            spp = max(2, spp if most_spp is None else min(spp, most_spp))
            # Each film pixel of a block gets the same number, in both halves.
            spp = max(spp, 2 * scene.film.block_pixels)
            return VerificationBudget(scene, spp, spp * pixels / samples)
    raise AssertionError("the last factor is always taken")
