"""Answers that are derived from other answers: unchanged, warmer, or between two."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint import pipeline
from lightpaint.basis import Basis, LightGroups
from lightpaint.batch.manifest.keys import SHIFTED_WORDS, SOLVED_WORDS, shift, vary
from lightpaint.lighting import Constraints, Lighting, combine
from lightpaint.progress import Listener
from lightpaint.relit import scene_of
from lightpaint.scene import Scene


def derived_folder(
    folder: Path,
    scene: Scene | None,
    lightings: tuple[str, ...],
    *,
    views: Sequence[str] = ("",),
    groups: LightGroups | None = None,
    planes: str | None = None,
    force: bool = False,
) -> pipeline.ResultFolder:
    """Return the result folder of a derived answer. views: folders in it, one for each picture.

    planes: path of a planes file, if illuminance is measured.
    """
    input_files = tuple(map(Path, lightings))
    files = pipeline.answer_files(folder, scene=scene, groups=groups)
    files += [folder / view / "predicted.exr" for view in views]
    if scene is not None:
        input_files += scene.read_files
    if groups is not None:
        input_files += tuple(groups.files)
    if planes is not None:
        input_files += (Path(planes),)
        files += pipeline.files_of_planes(folder, planes)
    answers = tuple(map(Path, lightings))
    return pipeline.ResultFolder(folder, tuple(files), input_files, answers, force=force)


def publish_derived(
    results: pipeline.ResultFolder,
    lighting: Lighting,
    bases: Sequence[Basis],
    *,
    views: Sequence[str] = ("",),
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    spp: int | None = None,
    planes: pipeline.MeasuredPlanes | None = None,
) -> None:
    """Write lighting.json, its pictures from `bases`, and the relit scene.

    views: folder of each picture. groups: light groups that the basis was read from; the answer is
    also written for their programs. spp: of a verification. planes: as measured.
    """
    results.check()
    with pipeline.new_answer(results, lighting, scene=scene, groups=groups) as answer:
        for basis, view in zip(bases, views, strict=True):
            (answer.path / view).mkdir(exist_ok=True)
            predicted, origin = combine(basis, lighting), basis.origin
            path, spp_ = answer.path / view / "predicted.exr", spp or origin.spp
            pipeline.write_predicted(path, predicted, origin=origin, spp=spp_, scene=answer.relit)
        if planes is not None and scene is not None:
            weights = lighting.weights_for(planes.illuminance.lights)
            words = f"{scene.path.name} lit by {pipeline.LIGHTING}"
            lit = planes.weights_by_case(weights)
            pipeline.write_planes(answer.path, planes.illuminance, lit, words, glare=planes.glare)


def measure_derived(
    scene: Scene | None,
    lighting: Lighting,
    constraints: Constraints,
    settings: pipeline.Settings,
    listen: Listener,
) -> pipeline.MeasuredPlanes | None:
    """Return the planes that settings name, measured; None without any.

    The lights are where the lighting has them.
    """
    if settings.planes is None or scene is None:
        return None
    _, scale = pipeline.constraints_and_scale(scene, constraints, settings)
    placed = scene_of(scene, lighting)
    planes = pipeline.measure_planes(placed, settings.planes, settings, scale, listen)
    return pipeline.with_glare(planes, placed, settings, listen)


def dimmer_lights(basis: Basis) -> set[str]:
    """Return the names of lights that have a dimmer and no colour."""
    return {light.name for light in basis.lights if light.is_scalar}


def variation_folder(folder: Path, word: str) -> Path:
    """Return the folder of a variation, which lies beside the look that it varies."""
    return folder.with_name(f"{folder.name}-{word.replace(' ', '-')}")


def adjusted_light_count(job: pipeline.Job) -> int:
    """Return the number of adjusted lights."""
    first = job.views[0]
    source = first.basis if first.basis is not None else first.scene
    return sum(not light.is_fixed for light in source.lights) if source is not None else 0


def variation_jobs(job: pipeline.Job, words: Sequence[str]) -> dict[str, pipeline.Job]:
    """Return the jobs of variations that are solved, by their words."""
    jobs = {}
    for word in (x for x in words if x in SOLVED_WORDS):
        options, lights = replace(job.settings, hold=job.fit.hold), adjusted_light_count(job)
        settings, constraints = vary(word, options, job.constraints, lights)
        folder = variation_folder(job.folder, word)
        fields = (job.scenes, job.targets, folder, job.basis, constraints, settings, job.by_sensor)
        jobs[word] = pipeline.Job(*fields, rigging=job.rigging, sequence=job.sequence)
    return jobs


def shifted_folders(job: pipeline.Job, words: Sequence[str]) -> dict[str, pipeline.ResultFolder]:
    """Return the result folders of variations that are derived from the answer, by their words."""
    return {
        word: derived_folder(
            variation_folder(job.folder, word),
            job.views[0].scene,
            (str(job.folder / "lighting.json"),),
            views=_views(job),
            groups=job.groups,
            planes=job.settings.planes,
            force=job.settings.force,
        )
        for word in words
        if word in SHIFTED_WORDS
    }


def publish_shifted(
    job: pipeline.Job,
    word: str,
    results: pipeline.ResultFolder,
    lighting: Lighting,
    bases: Sequence[Basis],
    listen: Listener,
) -> None:
    """Write a variation of the answer of `job`. bases: of its views."""
    shifted_lighting = shift(lighting, SHIFTED_WORDS[word], dimmer_lights(bases[0])).for_target(
        results.folder.name
    )
    scene = job.views[0].scene
    options: dict[str, Any] = {
        "scene": scene,
        "groups": job.groups,
        "spp": job.settings.spp,
        "planes": measure_derived(scene, shifted_lighting, job.constraints, job.settings, listen),
    }
    publish_derived(results, shifted_lighting, bases, views=_views(job), **options)


def _views(job: pipeline.Job) -> list[str]:
    """Return each view's folder, relative to the folder of the results."""
    return [str(view.folder.relative_to(job.folder)) for view in job.views]
