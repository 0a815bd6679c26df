"""Renders the relit scene independently, and compares it with the prediction."""

from dataclasses import replace

from lightpaint.basis.render.render_budget import check_samples
from lightpaint.errors import SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.keywords import keywords
from lightpaint.progress import Progress, silent
from lightpaint.relit.verification import Verification, compare
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, render


@keywords()
def verify(
    predicted: Estimate,
    relit: Scene,
    *,
    spp: int | None = None,
    seed: int = 0,
    stream: Stream = Stream.VERIFICATION,
    progress: Progress = silent,
) -> Verification:
    """Render the relit scene with random numbers that no basis uses, and compare.

    Args:
        predicted: The prediction, of the size of `relit` or on a reduced film of it.
        relit: The result of `relight`.
        spp: Samples per pixel of `relit` (by default the scene's own number).
        seed: Any number >= 0.
        stream: Stream of random numbers; a repeated verification uses another one.
        progress: Called with the progress of the work.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> lighting = lp.read_lighting("lighting.json")
        >>> relit = lp.relight(scene, lighting, "relit.xml")
        >>> lp.verify(lp.combine(basis, lighting), relit, spp=4).agrees
        True
    """
    check_samples(seed=seed, spp=spp)
    if whole_factor(relit.size, predicted.size) is None:
        raise SizeError(
            f"the prediction is {predicted.size[1]}x{predicted.size[0]} but ",
            relit.path,
            f" renders {relit.size[1]}x{relit.size[0]}: they belong to different scenes or sensors",
        )
    verified = render(
        relit,
        spp=spp,
        seed=seed,
        stream=stream,
        label="verification",
        progress=progress,
    )
    return replace(compare(predicted, verified), spp=relit.spp if spp is None else spp)
