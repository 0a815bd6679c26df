"""What each sub-command does: calls of the corridor, and tables of what came out."""

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from lightpaint.basis.basis import is_basis_file, read_basis, write_basis
from lightpaint.basis.render import render_basis, why_not_one_pass
from lightpaint.doctor import examine
from lightpaint.errors import OutputError
from lightpaint.files import check_writable
from lightpaint.pipeline import (
    Look,
    command_line,
    paint_with_light,
    relight_look,
    render_template,
    verify_result,
)
from lightpaint.progress import Progress as Report
from lightpaint.relight.verdict import agreement, energy_shares, verdict
from lightpaint.relight.verify import Verification
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.scene.variant import use_variant
from lightpaint.solve.lighting import read_lighting
from lightpaint.target.target import read_target

RGB = tuple[float, float, float]


def lights(options: Namespace, _given: list[str]) -> int:
    """`lightpaint lights SCENE`"""
    scene = _load(options)
    if options.json:
        listed = [
            {
                "name": light.name,
                "plugin": light.plugin,
                "parameter": light.kind.parameter,
                "unit": light.kind.unit,
                "emission": list(light.emission),
                "form": light.form,
                "sampling_weight": light.sampling_weight,
            }
            for light in scene.lights
        ]
        print(json.dumps({"scene": str(scene.path), "lights": listed}, indent=2))
        return 0
    table = _table("light", "plugin", "emission R G B", "unit", "size or place", "sampling")
    for light in scene.lights:
        table.add_row(
            escape(light.name),
            light.plugin,
            _numbers(light.emission),
            light.kind.unit,
            light.form,
            f"{light.sampling_weight:g}",
        )
    _console().print(table)
    return 0


def basis(options: Namespace, _given: list[str]) -> int:
    """`lightpaint basis SCENE -o F.basis.exr`"""
    output = Path(options.output or Path(options.scene).stem + ".basis.exr")
    _check_suffix(output)
    check_writable(output.parent)
    scene = _load(options)
    with _progress() as progress:
        made = render_basis(scene, spp=options.spp, seed=options.seed, progress=progress)
    write_basis(output, made)
    print(f"{output}: {len(made.lights)} lights, {made.origin.spp} samples per pixel")
    return 0


def template(options: Namespace, _given: list[str]) -> int:
    """`lightpaint template SCENE -o F.exr`"""
    output = Path(options.output or Path(options.scene).stem + ".exr")
    _check_suffix(output)
    check_writable(output.parent)
    scene = _load(options, say_how=False)
    with _progress() as progress:
        picture = render_template(
            scene, output, spp=options.spp, seed=options.seed, progress=progress
        )
    print(f"{output}: paint over it in linear light, and save with alpha where it matters")
    print(f"{picture}: the same as a picture")
    return 0


def solve(options: Namespace, given: list[str]) -> int:
    """`lightpaint solve SCENE|BASIS TARGET...`"""
    folders = _folders(options.output, [Path(t).stem for t in options.targets])
    # Everything a user gave is looked at before the first sample is taken.
    targets = [read_target(path, mask=options.mask) for path in options.targets]
    source = Path(options.source)
    if is_basis_file(source):
        scene, made = None, read_basis(source)
        size = made.size
    else:
        scene, made = _load(options, path=source), None
        size = scene.size
    targets = [target.fitted_to(size, resize=options.resize) for target in targets]
    for folder in folders:
        check_writable(folder)

    for target, folder in zip(targets, folders, strict=True):
        _warn_of_pixels(target.not_finite, target.name)
        with _progress() as progress:
            if made is None and scene is not None:
                made = render_basis(scene, spp=options.spp, seed=options.seed, progress=progress)
            look = paint_with_light(
                scene,
                target,
                folder,
                basis=made,
                unpainted=options.unpainted,
                seed=options.seed,
                command=command_line(given),
                progress=progress,
            )
        _show(look, folder)
    if scene is None:
        _say("solved from a saved basis: no render was made; lightpaint relight makes one")
    return 0


def relight(options: Namespace, _given: list[str]) -> int:
    """`lightpaint relight SCENE lighting.json...`"""
    answers = [read_lighting(path) for path in options.lightings]
    names = [a.target or Path(p).stem for a, p in zip(answers, options.lightings, strict=True)]
    folders = _folders(options.output, names)
    scene = _load(options, say_how=False)
    for folder in folders:
        check_writable(folder)
    for lighting, folder in zip(answers, folders, strict=True):
        with _progress() as progress:
            relight_look(
                scene, lighting, folder, spp=options.spp, seed=options.seed, progress=progress
            )
        print(f"{folder}: relit.xml, relit.exr, relit.png")
    return 0


def verify(options: Namespace, _given: list[str]) -> int:
    """`lightpaint verify DIR...`"""
    use_variant(options.variant)
    agree = True
    for folder in options.folders:
        with _progress() as progress:
            result = verify_result(folder, spp=options.spp, seed=options.seed, progress=progress)
        print(f"{folder}: {_agreement(result)}")
        agree &= result.agrees
    return 0 if agree else 1


def doctor(options: Namespace, _given: list[str]) -> int:
    """`lightpaint doctor`"""
    findings = examine(options.variant)
    table = _table("", "", "found")
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        table.add_row(finding.what, mark, escape(finding.found))
    _console().print(table)
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        print(f"{finding.what}: {finding.remedy}")
    print("something is missing" if missing else "everything needed is here")
    return 0


def _load(options: Namespace, *, path: Path | None = None, say_how: bool = True) -> Scene:
    scene = load_scene(
        path or options.scene,
        sensor=options.sensor,
        parameters=dict(options.parameters),
        variant=options.variant,
    )
    if note := use_variant().note:
        _say(note)
    elif say_how and (reason := why_not_one_pass(scene)):
        _say(f"{reason}: every light is rendered separately, {len(scene.lights)} times the work")
    return scene


def _show(look: Look, folder: Path) -> None:
    shares = energy_shares(look.basis, look.lighting)
    table = _table("light", "plugin", "emission now", "solved R G B", "unit", "share")
    for light, now, share in zip(look.lighting.lights, look.basis.lights, shares, strict=True):
        off = not any(light.emission)
        unreached = light.name in look.solution.quality.unreached
        table.add_row(
            escape(light.name),
            light.plugin,
            _numbers(now.emission),
            "off" if off else _numbers(light.emission) + (" (kept)" if unreached else ""),
            light.unit,
            f"{100 * share:.1f} %",
        )
    _console().print(table)
    print(verdict(look.solution, look.verification))
    print(f"results in {folder}{'' if str(folder).endswith('/') else '/'}")
    quality = look.solution.quality
    if quality.unreached:
        _say(
            f"no painted pixel sees {', '.join(quality.unreached)}: kept as it is; "
            "paint where it shines, or pass --unpainted"
        )
    if not quality.converged:
        _say(
            f"the solve stopped after {max(quality.sweeps)} sweeps at a KKT residual of "
            f"{max(quality.kkt_residual):.1e}"
        )
    if look.verification is not None and not look.verification.agrees:
        _say(f"WARNING: {_agreement(look.verification)}")


def _agreement(result: Verification) -> str:
    return (
        f"{agreement(result)}; RMSE {result.rmse:.2g} (noise {result.noise_rmse:.2g}), "
        f"ΔE {result.delta_e_mean:.1f}"
    )


def _folders(output: str | None, names: Sequence[str]) -> list[Path]:
    """One result folder per name: DIR itself for a single one, DIR/<name> for several."""
    if len(names) == 1:
        return [Path(output or names[0])]
    if len(set(names)) < len(names):
        raise OutputError(f"results would overwrite each other: {', '.join(names)}")
    return [Path(output or ".") / name for name in names]


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() != ".exr":
        raise OutputError(f"{path} must end in .exr, the format that is written")


def _warn_of_pixels(count: int, name: str) -> None:
    if count:
        _say(f"{name}: {count} pixels hold NaN or Inf and count nothing")


def _numbers(rgb: RGB) -> str:
    return " ".join(f"{v:.3g}" for v in rgb)


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        table.add_column(column, no_wrap=True)
    return table


def _console() -> Console:
    # Piped output has no width: nothing in it is cut.
    return Console(highlight=False, width=None if sys.stdout.isatty() else 200)


def _say(text: str) -> None:
    print(f"lightpaint: {text}", file=sys.stderr)


@contextmanager
def _progress() -> Iterator[Report]:
    """Report to the terminal; in a log, one line per piece of work that is finished."""
    if not sys.stderr.isatty():
        yield _report_line
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks = {}

        def report(label: str, done: int, total: int) -> None:
            if label not in tasks:
                tasks[label] = bars.add_task(label, total=total)
            bars.update(tasks[label], completed=done, total=total)

        yield report


def _report_line(label: str, done: int, total: int) -> None:
    if done == 0:
        print(f"{label}: {total} passes", file=sys.stderr, flush=True)
