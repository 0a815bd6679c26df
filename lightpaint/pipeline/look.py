"""The results of a solve in its folder, reading them back, and verifying them again."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint import report
from lightpaint.basis import Basis, Origin
from lightpaint.colour import EYE, Observer
from lightpaint.display_text import rounded_text, some_names
from lightpaint.errors import ImageError, LightpaintError, OutputError, SceneError
from lightpaint.files import is_name, one_line, write_bytes, write_text
from lightpaint.images import Estimate, Size, in_turns, read_estimate, whole_factor, write_estimate
from lightpaint.images.formats import png_bytes
from lightpaint.keywords import keywords
from lightpaint.lighting import (
    Analysis,
    Diagnosis,
    Lighting,
    PlanesAnswer,
    Solution,
    SurfaceColor,
    Uncertainty,
)
from lightpaint.placement import (
    HARDLY_VISIBLE,
    TO_END,
    AddedLight,
    Move,
    MoveSuggestion,
    Placement,
    PlacementRecord,
    Suggestion,
)
from lightpaint.progress import Progress, silent
from lightpaint.relit import EXPORTS, LightShares, Verification, verify, with_light_tests
from lightpaint.report.page.notebook_html import look_html
from lightpaint.scene import Scene, Stream, load_scene, render_features
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.storage.staging import finish
from lightpaint.target import Target

#: Header attribute of predicted.exr: the sensor, film and samples of the basis.
VIEW_KEY = "lightpaint.view"

#: Name of all lights together, whose error a verification without their basis looks for.
ALL_LIGHTS = "all lights"

#: Files of every solve.
SOLVE_RESULTS = ("lighting.json", "predicted.exr", "comparison.png", "report.html", "report.json")

#: Files of each view, if there are several.
VIEW_RESULTS = ("predicted.exr", "verified.exr", "comparison.png", "report.html", "report.json")

#: Files of a relight; and of a solve or a relight, which the next solve replaces.
RELIT_RESULTS = ("relit.xml", "relit.png", "relit.exr", "relit.*.exr")
RESULTS = tuple(dict.fromkeys([*SOLVE_RESULTS, *VIEW_RESULTS, *RELIT_RESULTS, *EXPORTS]))

#: Least errors of a turn, in degrees, and of a way, as a share of it, that are worth a number.
LEAST_TURN_ERROR, LEAST_SHARE = 0.05, 0.001


@keywords()
@dataclass(frozen=True)
class Look:
    """A painting and its answer.

    Attributes:
        target: The painting, at the size of the basis.
        basis: The basis it was solved with.
        solution: The answer, with its errors and active bounds.
        predicted: Σ w_i Φ_i, the predicted picture.
        relit: The relit scene; None if there was only a saved basis.
        verification: Comparison of the prediction with a render; None without a scene.
        analysis: How certain the lights are, and why the answer is not closer.
        suggestions: Lights that would help most; None if not requested.
        placement: The places that were found for lights; None if none may move.
        move_suggestion: The turn of a spot that would help most, if suggestions were requested and
            one surely helps.
        planes: What the answer gives on measuring planes; None without any.
        surfaces: Colours of objects under the answer and by daylight; none without spectra.
        job_remarks: Remarks on scene, lights and painting, of before the solve.

    Examples:
        >>> look = lp.paint_with_light(None, "painting.exr", "evening", basis="room.basis.exr")
        >>> look.lighting.emission["panel"] == look.solution.lighting.emission["panel"]
        True
    """

    target: Target
    basis: Basis
    solution: Solution
    predicted: Estimate
    relit: Scene | None
    verification: Verification | None
    analysis: Analysis
    suggestions: tuple[Suggestion, ...] | None = None
    placement: Placement | None = None
    move_suggestion: MoveSuggestion | None = None
    planes: PlanesAnswer | None = None
    surfaces: tuple[SurfaceColor, ...] = ()
    job_remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Look(of {self.target.name}: {self.verdict})"

    def _repr_html_(self) -> str:
        return look_html(
            self.target,
            self.solution,
            self.predicted,
            self.verification,
            appearance=self.analysis.appearance,
        )

    @property
    def verdict(self) -> str:
        """Sentences on how close the lights come to the painting."""
        return report.verdict(
            self.solution, self.predicted, self.verification, appearance=self.analysis.appearance
        )

    @property
    def uncertainty(self) -> Uncertainty | None:
        """Uncertainty of the lights; None if the noise is unknown."""
        return self.analysis.uncertainty

    @property
    def diagnosis(self) -> Diagnosis:
        """Why the answer is not closer to the painting."""
        return self.analysis.diagnosis

    @property
    def remarks(self) -> list[str]:
        """Remarks on emitters in view: painted pixels that are ignored."""
        return report.emitter_remarks(self.target, self.solution, self.predicted)

    @property
    def lighting(self) -> Lighting:
        """The lighting that comes closest to the target."""
        return self.solution.lighting


def result_folders(folder: Path) -> list[Path]:
    """Return `folder` itself or, if it holds several views, their folders."""
    finish(folder)
    if (folder / "predicted.exr").is_file() or not (folder / "relit.xml").is_file():
        return [folder]
    return sorted(file.parent for file in folder.glob("*/predicted.exr")) or [folder]


def view_names(scenes: Sequence[Scene]) -> list[str]:
    """Return the sensor of each scene, after which its folder is named.

    Raises SceneError for a repeated sensor, or one that cannot name a folder.
    """
    return checked_names([scene.sensor_names[scene.sensor] for scene in scenes])


def checked_names(names: list[str], error: type[LightpaintError] = SceneError) -> list[str]:
    """Return the names of views. Raises `error` for one that cannot name a folder of its own."""
    if len(set(names)) < len(names):
        raise error(f"a view is given twice: {some_names(names)}; give each sensor once")
    for name in names:
        if not is_name(name):
            raise error(
                f"the sensor id {one_line(repr(name))} cannot name a folder: choose another id"
            )
    return names


def write_predicted(
    path: Path,
    predicted: Estimate,
    *,
    origin: Origin,
    spp: int,
    size: Size | None = None,
    scene: Scene | None = None,
) -> None:
    """Write predicted.exr, with a note of the sensor, film and samples for its verification.

    origin: of the basis. spp, size: samples per pixel of the verification, and (height, width) of
    its film, by default the whole one. scene: its parameters are needed again by the relit scene.
    """
    film = {} if size is None else {"width": size[1], "height": size[0]}
    parameters = {} if scene is None or not scene.parameters else {"parameters": scene.parameters}
    view = {"sensor": origin.sensor, "spp": spp, "basis_spp": origin.spp, **film, **parameters}
    if scene is not None and scene.is_spectral:
        view["is_spectral"] = True
        if scene.observer.is_camera:
            view["observer"] = asdict(scene.observer)
    write_estimate(path, predicted, {VIEW_KEY: json.dumps(view)})


def write_report(
    folder: Path, look: Look, *, command: str, relit: Scene | None = None, is_shown: bool = True
) -> None:
    """Write the pictures and the report page, denoised, and their numbers.

    These are comparison.png, report.html and report.json. relit: the relit scene where its files
    are now; by default the scene of `look`. is_shown: False to write only the numbers.
    """
    relit = relit or look.relit
    answer = _reported_answer(look, command)
    if not is_shown:
        write_text(folder / "report.json", report.report_numbers(answer))
        return
    verified = look.verification.verified.image if look.verification else None
    larger_features = None
    if relit is not None and verified is not None:
        height, width = size = verified.shape[:2]
        if size != look.basis.size:
            film = relit if size == relit.size else relit.reduced(f"{width}x{height}")
            larger_features = render_features(film)
    weights, predicted = look.solution.weights, look.predicted.image
    factor = report.look_reduction(look.basis.size)
    looks = report.CleanLooks.clean(
        look.basis,
        weights,
        predicted,
        verified,
        larger=larger_features,
        factor=factor,
        others=report.mixes_of_mixer(look.basis, look.lighting),
    )
    transform = report.report_transform(look.target, look.basis, predicted)
    missed = report.residual_of(look.solution, predicted, transform=transform)

    def comparison() -> None:
        sheet = report.comparison_image(
            basis=look.basis,
            target=look.target,
            solution=look.solution,
            predicted=look.predicted.image,
            verified=verified,
            verified_spp=None if look.verification is None else look.verification.spp,
            appearance=look.analysis.appearance,
            looks=looks,
            missed=missed,
        )
        write_bytes(folder / "comparison.png", png_bytes(sheet, looks.texts))

    def page() -> None:
        write_text(folder / "report.html", report.report_page(answer, looks=looks, missed=missed))

    def numbers() -> None:
        write_text(folder / "report.json", report.report_numbers(answer, missed=missed))

    in_turns(lambda write: write(), (page, comparison, numbers), look.basis.size)


def _reported_answer(look: Look, command: str) -> report.ReportedAnswer:
    """Return a look as its report takes it."""
    return report.ReportedAnswer(
        basis=look.basis,
        target=look.target,
        solution=look.solution,
        predicted=look.predicted,
        verification=look.verification,
        command=command,
        uncertainty=look.uncertainty,
        diagnosis=look.diagnosis,
        unconstrained=look.analysis.unconstrained,
        suggestions=look.suggestions,
        turn=look.move_suggestion,
        hung=None if look.placement is None else hung_of(look.placement, look.lighting),
        appearance=look.analysis.appearance,
        color_choices=look.analysis.color_choices,
        planes=look.planes,
        surfaces=look.surfaces,
        job_remarks=look.job_remarks,
    )


def verify_result(
    folder: str | Path,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Verification:
    """Render the relit.xml of a result folder again and compare it with its predicted.exr.

    spp: samples per pixel, by default those recorded in predicted.exr. Returns the power for all
    lights together, ALL_LIGHTS: single ones are in the basis alone. Raises OutputError if `folder`
    holds no such result, ImageError if predicted.exr is damaged.
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
        relit_xml,
        sensor=view.sensor,
        parameters=view.parameters,
        use_lights_file=False,
        lamps=["*"],
    )
    if view.is_spectral:
        relit = replace(relit, is_spectral=True, observer=view.observer)
    if view.width is not None and view.height is not None:
        film = (view.height, view.width)
        # A scene that was edited by hand may have another film, which `verify` refuses.
        if relit.size != film and whole_factor(relit.size, film) is not None:
            relit = relit.reduced(f"{view.width}x{view.height}")
    verification = verify(
        predicted,
        relit,
        spp=view.spp if spp is None else spp,
        seed=seed,
        stream=Stream.SECOND_VERIFICATION,
        progress=progress,
    )
    return _with_power_for_all(verification, predicted)


def _with_power_for_all(verification: Verification, predicted: Estimate) -> Verification:
    """Return `verification` with its power for an error of all lights together: without a basis,
    nothing is known of each.
    """
    whole = LightShares.of_pictures((ALL_LIGHTS,), [predicted])
    power = with_light_tests(verification, predicted, whole).power
    return replace(verification, power=power)


@dataclass(frozen=True)
class _RecordedView:
    """The content of VIEW_KEY; None for what is missing.

    spp: samples per pixel. width, height: film of the verification; None for the whole film.
    parameters: values of `$name` parameters of the scene. is_spectral: whether it is rendered with
    spectra. observer: what sees these.
    """

    sensor: str | None = None
    spp: int | None = None
    width: int | None = None
    height: int | None = None
    parameters: Mapping[str, str] | None = None
    is_spectral: bool = False
    observer: Observer = EYE

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


def hung_of(placement: Placement | PlacementRecord, lighting: Lighting | None) -> report.HungLights:
    """Return the changes of a placement and the lights of an answer; none without a placement."""
    changes = [_change_of(change) for change in all_changes(placement)]
    changes.sort(key=lambda change: -change.numbers["gain_share"])
    missed_shares = placement.missed_before, placement.missed_after
    lights = () if lighting is None else report.hung_lights(lighting)
    up_axis = (0.0, 1.0, 0.0) if lighting is None else lighting.up
    return report.HungLights(lights, tuple(changes), up_axis, *missed_shares, placement.looks)


def all_changes(placement: Placement | PlacementRecord) -> list[Move | AddedLight]:
    """Return the moves, then the new lights."""
    return [*placement.moves, *placement.additions]


def _change_of(change: Move | AddedLight) -> report.LightChange:
    numbers: dict[str, Any] = {
        "gain_share": change.gain_share,
        "place_error": change.place_error,
        "turn_error": change.turn_error,
        "is_hardly_visible": change.is_hardly_visible,
    }
    if isinstance(change, Move):
        numbers |= {"distance": change.distance, "turn": change.turn}
        numbers |= {"cutoff": change.new.cutoff, "beam": change.new.beam}
    return report.LightChange(change.name, spoken_change(change), numbers)


def spoken_change(change: Move | AddedLight) -> str:
    """Return a light's change and gain: `spot_knot turned by 12°, slid by 0.6: a fifth …`."""
    gain = f"{report.spoken_fraction(change.gain_share)} of what was missed"
    if isinstance(change, Move):
        phrase, gain = spoken_move(change), change.shared_gain or gain
    else:
        x, y, z = (f"{v:.2f}" for v in change.site.position or (0.0, 0.0, 0.0))
        phrase = f"is a new {change.emitter.kind} at ({x}, {y}, {z})".replace("-", "−")
        if change.place_error:
            phrase += f" ± {rounded_text(change.place_error, 1)}"
    text = f"{change.name} {phrase}: {gain}"
    return f"{text}; {HARDLY_VISIBLE}" if change.is_hardly_visible else text


def spoken_move(move: Move) -> str:
    """Return a light's change with its errors: `turned by 12° ± 1°, slid by 0.6 ± 0.05`."""
    phrases = []
    if move.turn >= 0.5:
        turn_error = move.turn_error or 0.0
        error = f" ± {rounded_text(turn_error, 1)}°" if turn_error >= LEAST_TURN_ERROR else ""
        phrases.append(f"turned by {move.turn:.0f}°{error}{TO_END * move.is_turned_to_end}")
    if move.distance > 0:
        place_error = move.place_error or 0.0
        is_told = place_error >= LEAST_SHARE * move.distance
        error = f" ± {rounded_text(place_error, 1)}" if is_told else ""
        way = rounded_text(move.distance, 2)
        phrases.append(f"slid by {way}{error}{TO_END * move.is_slid_to_end}")
    if move.new.cutoff is not None and move.new.cutoff != move.old.cutoff:
        phrases.append(f"its cone ends at {move.new.cutoff:.0f}° (was {move.old.cutoff:.0f}°)")
    if move.has_other_edge:
        phrases.append(f"its beam at {move.new.beam:.0f}° (was {move.old.beam:.0f}°)")
    return ", ".join(phrases)
