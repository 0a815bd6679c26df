"""Verification of a result folder that was written earlier, by a new render."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from lightpaint.errors import ImageError, OutputError
from lightpaint.files import one_line
from lightpaint.images.estimate import read_estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.pipeline.results.results import VIEW_KEY
from lightpaint.progress import Progress, silent
from lightpaint.relit.verification import Verification
from lightpaint.relit.verification_render import verify
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.storage.staging import finish


def verify_result(
    folder: str | Path,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Verification:
    """Render the relit.xml of a result folder again and compare it with its predicted.exr.

    spp: samples per pixel, by default those recorded in predicted.exr. Raises OutputError if
    `folder` holds no such result, ImageError if predicted.exr is damaged.
    """
    folder = Path(folder)
    for candidate in (folder, folder.parent):
        finish(candidate)
    relit_xml = folder / "relit.xml"
    if not relit_xml.is_file() and (folder.parent / "relit.xml").is_file():
        relit_xml = folder.parent / "relit.xml"  # one of several views
    missing = [file.name for file in (folder / "predicted.exr", relit_xml) if not file.is_file()]
    if missing:
        raise OutputError(
            f"{folder} is not a result folder with a relit scene: it has no "
            f"{' and no '.join(missing)}; give one that lightpaint solve made from a scene"
        )
    path = folder / "predicted.exr"
    predicted, attributes = read_estimate(path)
    view = _read_view(path, attributes.get(VIEW_KEY, "{}"))
    relit = load_scene(
        relit_xml, sensor=view.sensor, parameters=view.parameters, use_lights_file=False
    )
    if view.width is not None and view.height is not None:
        film = (view.height, view.width)
        # A scene that was edited by hand may have another film, which `verify` refuses.
        if relit.size != film and whole_factor(relit.size, film) is not None:
            relit = relit.reduced(f"{view.width}x{view.height}")
    return verify(
        predicted,
        relit,
        spp=view.spp if spp is None else spp,
        seed=seed,
        stream=Stream.SECOND_VERIFICATION,
        progress=progress,
    )


@dataclass(frozen=True)
class _RecordedView:
    """The content of VIEW_KEY; None for what is missing.

    spp: samples per pixel. width, height: film of the verification; None for the whole film.
    parameters: values of `$name` parameters of the scene.
    """

    sensor: str | None = None
    spp: int | None = None
    width: int | None = None
    height: int | None = None
    parameters: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        if self.spp == 0:
            raise ValueError("spp is a whole number > 0, not 0")


def _read_view(path: Path, text: str) -> _RecordedView:
    try:
        return read_record(_RecordedView, strict_json(text), others=True)
    except ValueError as error:
        raise ImageError(
            f"{path} is damaged in its attribute {VIEW_KEY}: {one_line(str(error))}; solve again"
        ) from None
