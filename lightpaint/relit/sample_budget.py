"""How much of a render a verification is: by default as many samples as its basis has, at most."""

from dataclasses import dataclass

from lightpaint.images.pixel_blocks import Size, whole_factor
from lightpaint.scene.scene import Scene

#: Samples per pixel of a verification, at least: with fewer, a smaller film serves as well.
FEWEST = 4


@dataclass(frozen=True)
class VerificationBudget:
    """A verification that is to be rendered.

    scene: relit, on the film that it is rendered on. spp: samples per pixel. share: of the samples
    that the basis has.
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
    """Return the verification of `relit` that takes no longer than its basis, or the one asked for.

    The samples of the basis are spread over the whole film, or over the largest one of whole blocks
    that has FEWEST in each pixel; what is compared are means over blocks of the basis, so neither
    sees more. A sample costs no more in an ordinary render than in a basis. Two halves of a film
    that no blocks fit into take two samples in each of its pixels at least, whatever the basis has.

    basis_size: (height, width); basis_spp: samples per pixel. most_spp: samples per
    pixel, at most, where no number is asked for. asked_spp: samples per pixel of the whole film,
    whatever they cost.
    """
    samples = basis_spp * basis_size[0] * basis_size[1]
    whole = relit.size[0] * relit.size[1]
    if asked_spp is not None:
        return VerificationBudget(relit, asked_spp, asked_spp * whole / samples)
    factor = whole_factor(relit.size, basis_size) or 1
    for part in range(1, factor + 1):
        if factor % part:
            continue
        scene = relit if part == 1 else relit.reduced(f"1/{part}")
        # A block that is no pixel of Mitsuba's film costs a sample in each of its pixels.
        saves = scene.film.block == relit.film.block
        if part < factor and not (saves and whole_factor(scene.size, basis_size) == factor // part):
            continue
        pixels = scene.size[0] * scene.size[1]
        spp = samples // pixels
        if spp >= FEWEST or part == factor:
            spp = max(2, spp if most_spp is None else min(spp, most_spp))
            # As many in each pixel of a block, for either half.
            spp = max(spp, 2 * scene.film.block_pixels)
            return VerificationBudget(scene, spp, spp * pixels / samples)
    raise AssertionError("the last factor is always taken")
