"""An answer that is made of others, and not solved: as it is, warmer, between two."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.batch.manifest.variations import SHIFTED, SOLVED, shifted, varied
from lightpaint.lighting.answer.lighting import Lighting, combine
from lightpaint.pipeline.answer_folder import answer_files, new_answer
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.result_folder import ResultFolder
from lightpaint.pipeline.results import write_predicted
from lightpaint.scene.scene import Scene


def made_folder(
    folder: Path,
    scene: Scene | None,
    lightings: tuple[str, ...],
    *,
    views: Sequence[str] = ("",),
    groups: LightGroups | None = None,
    force: bool = False,
) -> ResultFolder:
    """Where an answer goes that is made of others. views: folders in it, one for each picture."""
    reads = tuple(map(Path, lightings))
    files = answer_files(folder, scene=scene, groups=groups)
    files += [folder / view / "predicted.exr" for view in views]
    if scene is not None:
        reads += scene.read_files
    if groups is not None:
        reads += tuple(groups.files)
    answers = tuple(map(Path, lightings))
    return ResultFolder(folder, tuple(files), reads, answers, force=force)


def leave_made(
    results: ResultFolder,
    lighting: Lighting,
    bases: Sequence[Basis],
    *,
    views: Sequence[str] = ("",),
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    spp: int | None = None,
) -> None:
    """Write lighting.json, its pictures from `bases`, and the relit scene.

    views: folder of each picture. groups: what the basis was read from, whose other programs get
    the answer, too. spp: of a verification.
    """
    results.check()
    with new_answer(results, lighting, scene=scene, groups=groups) as answer:
        for basis, view in zip(bases, views, strict=True):
            (answer.path / view).mkdir(exist_ok=True)
            predicted, origin = combine(basis, lighting), basis.origin
            its, spp_ = answer.path / view / "predicted.exr", spp or origin.spp
            write_predicted(its, predicted, origin=origin, spp=spp_, scene=answer.relit)


def dimmed(basis: Basis) -> set[str]:
    """Lights that have a dimmer and no colour."""
    return {light.name for light in basis.lights if light.is_scalar}


def sibling_folder(folder: Path, word: str) -> Path:
    """Where a variation goes: beside the look that it varies."""
    return folder.with_name(f"{folder.name}-{word.replace(' ', '-')}")


def adjusted(job: Job) -> int:
    """How many lights are adjusted."""
    first = job.views[0]
    told = first.basis if first.basis is not None else first.scene
    return sum(not light.is_fixed for light in told.lights) if told is not None else 0


def siblings(job: Job, words: Sequence[str]) -> dict[str, Job]:
    """Those variations of a look that are solved anew, by their words; checked like all jobs."""
    made = {}
    for word in (x for x in words if x in SOLVED):
        how, lights = replace(job.settings, hold=job.fit.hold), adjusted(job)
        settings, asked = varied(word, how, job.constraints, lights)
        folder = sibling_folder(job.folder, word)
        its = (job.scenes, job.targets, folder, job.basis, asked, settings, job.by_sensor)
        made[word] = Job(*its)
    return made


def shifted_folders(job: Job, words: Sequence[str]) -> dict[str, ResultFolder]:
    """Where those variations go that are made of the answer, by their words."""
    return {
        word: made_folder(
            sibling_folder(job.folder, word),
            job.views[0].scene,
            (str(job.folder / "lighting.json"),),
            views=_views(job),
            groups=job.groups,
            force=job.settings.force,
        )
        for word in words
        if word in SHIFTED
    }


def leave_shifted(
    job: Job, word: str, results: ResultFolder, lighting: Lighting, bases: Sequence[Basis]
) -> None:
    """Write a variation of the answer of `job`. bases: of its views."""
    varied_ = shifted(lighting, SHIFTED[word], dimmed(bases[0])).named(results.folder.name)
    how: dict[str, Any] = {
        "scene": job.views[0].scene,
        "groups": job.groups,
        "spp": job.settings.spp,
    }
    leave_made(results, varied_, bases, views=_views(job), **how)


def _views(job: Job) -> list[str]:
    """The folder of each view in that of the results."""
    return [str(view.folder.relative_to(job.folder)) for view in job.views]
