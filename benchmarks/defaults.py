"""Measure the time and the errors of the defaults, against an earlier version.

    python benchmarks/defaults.py --before CHECKOUT [--parts demo again unverified second ...]

Seconds of the processor of whole processes, in turns with processes of CHECKOUT, an earlier
version.

- demo: `lightpaint demo` with nothing kept and no kernel compiled.
- again: the same with the kernels of the first demo kept, the least of `--repeats`.
- unverified: `lightpaint solve --no-verify` of a painting with the basis kept that the demo
  rendered, the least of `--repeats`.
- second: `lightpaint solve` of each painting of the gallery with the basis kept that the demo
  rendered, verification included; and how much of the light the verification checked: the share of
  lights in which it would probably have seen an error of 5 %.
- first: a painter with nothing kept and no kernel compiled, until a page has its first picture, the
  least of `--repeats`; and the mean ΔE of that picture to a long render.
- weights: the mean relative error of the lights' weights, each with its share of the picture, by
  the samples that the version's demo takes, and the mean ΔE of the denoised prediction to the long
  render at the same weights. On a quarter of the film, several seeds, solved as `lightpaint solve`
  does, noise corrected, against what the same version makes of a long render.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np

ROOT = Path(__file__).parent.parent
GALLERY = "scenes/gallery/scene.xml"
PAINTINGS = {
    "evening": ["evening.exr"],
    "morning": ["morning.exr", "--mask", "morning.mask.exr"],
    "opening": ["opening.png"],
    "after-hours": ["after-hours.png"],
    "overcast": ["overcast.png"],
    "last-sun": ["last-sun.png"],
}
PARTS = ("demo", "again", "unverified", "second", "first", "weights")

#: Parts that use what the demo leaves.
AFTER_DEMO = ("again", "unverified", "second")

#: Chance from which on an error would probably have been seen.
LIKELY = 0.5

#: Seed of the long render, which no other has.
LONG_SEED = 90_000

#: Runs what follows `-c` and prints the processor's seconds of it and of its children.
TIMED = """
import resource, subprocess, sys
code = subprocess.run([sys.executable, *sys.argv[1:]], stdout=sys.stderr).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime)
sys.exit(code)
"""

#: Weights for each painting, of a long render and of several seeds, as `lightpaint solve` finds
#: them; and the predictions denoised and by the long render, as NumPy's arrays.
WEIGHTS = """
import json, sys, tempfile
import numpy as np
import lightpaint as lp
from lightpaint.images.denoiser import denoised
try:
    from lightpaint.basis.denoised_mixes import denoise_mix
except ImportError:
    def denoise_mix(basis, weights):
        return denoised(basis.mix(weights), basis.features)
root, paintings, seeds, long_spp, long_seed, out = sys.argv[1:]
scene, found = lp.load_scene(root + "/scenes/gallery/scene.xml"), {}
small = scene.reduced("1/4")

def answers(basis):
    for name, [file, *mask] in json.loads(paintings).items():
        with tempfile.TemporaryDirectory() as folder:
            how = {"mask": mask[0]} if mask else {}
            look = lp.paint_with_light(
                None, file, folder + "/answer", basis=basis, verify=False, report=False, **how
            )
        yield name, look.lighting.weights_for(basis)

long = lp.render_basis(small, spp=int(long_spp), seed=int(long_seed))
for name, weights in answers(long):
    lit = long.images * weights[:, None, None, :]
    found[f"truth of {name}"] = weights
    found[f"shares of {name}"] = np.einsum("nhwc,hwc->n", lit, lit.sum(axis=0), dtype=np.float64)
for seed in range(int(seeds)):
    basis = lp.render_basis(small, spp=scene.spp, seed=seed + 1)
    for name, weights in answers(basis):
        found.setdefault(f"weights of {name}", []).append(weights)
        found.setdefault(f"pictures of {name}", []).append(denoise_mix(basis, weights))
        found.setdefault(f"long pictures of {name}", []).append(long.mix(weights))
np.savez(out, spp=scene.spp, **found)
"""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=PARTS)
    parser.add_argument("--long-spp", type=int, default=512)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    checkouts = {"before": options.before.absolute(), "now": ROOT}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        if {"demo", *AFTER_DEMO} & set(options.parts):
            demo(checkouts, place)
        if "again" in options.parts:
            again(checkouts, place, options.repeats)
        if "unverified" in options.parts:
            unverified(checkouts, place, options.repeats)
        if "second" in options.parts:
            second(checkouts, place)
        if "first" in options.parts:
            first(checkouts, place, options.long_spp, options.repeats)
        if "weights" in options.parts:
            weights(checkouts, place, options.long_spp, options.seeds)


def seconds_of(arguments: Sequence[str], checkout: Path, home: Path) -> float:
    """Run Python with `arguments` in a version; return the processor's seconds."""
    completed = subprocess.run(
        [sys.executable, "-c", TIMED, *arguments],
        env=environment_of(checkout, home),
        capture_output=True,
        cwd=home,
        text=True,
        check=False,
    )
    if completed.returncode:
        raise SystemExit(completed.stderr)
    return float(completed.stdout)


def environment_of(checkout: Path, home: Path) -> dict[str, str]:
    """Return the environment of a version whose files and cache are in `home`."""
    (home / "cache").mkdir(parents=True, exist_ok=True)
    # Installed packages have their bytecode, and a source tree may not.
    own = {"HOME": str(home), "LIGHTPAINT_CACHE": str(home / "cache"), "PYTHONPATH": str(checkout)}
    own["PYTHONPYCACHEPREFIX"] = str(home.parent / "py")
    return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | own


def command(*arguments: str) -> list[str]:
    """Return Python's arguments for a command of lightpaint."""
    return ["-c", "import sys; from lightpaint.cli import main; sys.exit(main())", *arguments]


def verified(folder: Path) -> tuple[int, float]:
    """Return the samples of a verification, and the share of the light that it checked."""
    report = json.loads((folder / "report.json").read_text())
    power = report["verification"]["power"]["lights"]
    lights = report["lights"]
    detected_share = sum(
        lights[name]["share"] for name, chance in power.items() if chance >= LIKELY
    )
    return report["verification"]["spp"], detected_share


def demo(checkouts: dict[str, Path], place: Path) -> None:
    """Measure the demo with nothing kept."""
    durations = {
        version: seconds_of(command("demo", "-q"), checkout, place / version)
        for version, checkout in checkouts.items()
    }
    print_row("demo, cold", durations)


def again(checkouts: dict[str, Path], place: Path, repeats: int) -> None:
    """Measure the demo with its kernels kept and no basis, in turns."""

    def run(version: str) -> float:
        for left in ("lightpaint-demo", "cache"):
            shutil.rmtree(place / version / left)
        return seconds_of(command("demo", "-q"), checkouts[version], place / version)

    print_row("demo, kernels kept", least_in_turns(run, checkouts, repeats))


def unverified(checkouts: dict[str, Path], place: Path, repeats: int) -> None:
    """Measure another painting of a kept scene without its verification, in turns."""
    name = list(PAINTINGS)[-1]

    def run(version: str) -> float:
        painting = str(checkouts[version] / "targets/gallery" / PAINTINGS[name][0])
        scene = str(place / version / "lightpaint-demo/gallery/scene.xml")
        arguments = command("solve", scene, painting, "--no-verify", "-o", name, "-q")
        return seconds_of(arguments, checkouts[version], place / version)

    print_row(f"not verified, {name}", least_in_turns(run, checkouts, repeats))


def least_in_turns(
    run: Callable[[str], float], versions: Iterable[str], repeats: int
) -> dict[str, float]:
    """Return the least seconds of several runs of each version, which take turns."""
    runs = [{version: run(version) for version in versions} for _ in range(repeats)]
    return {version: min(durations[version] for durations in runs) for version in runs[0]}


def second(checkouts: dict[str, Path], place: Path) -> None:
    """Measure the paintings of a kept scene."""
    total = dict.fromkeys(checkouts, 0.0)
    for name, files in PAINTINGS.items():
        durations, notes = {}, []
        for version, checkout in checkouts.items():
            files_at = [str(checkout / "targets/gallery" / x) if "." in x else x for x in files]
            scene = str(place / version / "lightpaint-demo/gallery/scene.xml")
            arguments = command("solve", scene, *files_at, "-o", name, "-q")
            durations[version] = seconds_of(arguments, checkout, place / version)
            total[version] += durations[version]
            spp, share = verified(place / version / name)
            notes.append(f"{spp} samples check {100 * share:.0f} %")
        print_row(f"second painting, {name}", durations, " / ".join(notes))
    print_row("second painting, all six", total)


def first(checkouts: dict[str, Path], place: Path, long_spp: int, repeats: int) -> None:
    """Measure how long a painter's first picture takes, and how far it is from a long render."""
    import lightpaint as lp

    # A picture of ordinary paths, so that it is nobody's own.
    truth = lp.render_basis(
        lp.load_scene(str(ROOT / GALLERY)).reduced("1/2"), spp=long_spp // 4, seed=LONG_SEED
    ).current_look
    pictures: dict[str, Any] = {}

    def run(version: str) -> float:
        with tempfile.TemporaryDirectory(dir=place) as home:
            seconds, pictures[version] = first_picture(checkouts[version], Path(home))
        return seconds

    durations = least_in_turns(run, checkouts, repeats)
    note = " / ".join(f"ΔE {delta_e_mean(pictures[x], truth):.1f}" for x in checkouts)
    print_row("first picture, cold", durations, note)


def first_picture(checkout: Path, home: Path) -> tuple[float, Any]:
    """Return the processor's seconds of a painter until a page has its first picture, and that."""
    options = ["-o", "painted", "--no-browser", "--port", "0"]
    painter = subprocess.Popen(
        [sys.executable, *command("paint", str(checkout / GALLERY), *options)],
        env=environment_of(checkout, home),
        cwd=home,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        assert painter.stdout is not None
        next(line for line in painter.stdout if line.startswith("painting "))
        about = json.loads((home / "painted" / "painter.json").read_text())
        picture = picture_of(about, wait_for_state(about))
        times = Path(f"/proc/{painter.pid}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, times[11:15])) / os.sysconf("SC_CLK_TCK"), picture
    finally:
        painter.terminate()
        painter.wait()


def wait_for_state(about: dict[str, Any]) -> dict[str, Any]:
    """Return the first state that a painter sends to a page. about: its connection file."""
    from websockets.sync.client import connect

    from lightpaint.paint.message_frames import from_frame, to_frame

    address = about["address"].replace("http", "ws", 1) + "live"
    with connect(address, additional_headers=key_of(about), max_size=None) as page:
        page.send(to_frame({"kind": "hello", "seq": 1, "version": about["protocol"]}, []))
        while True:
            content, _ = from_frame(page.recv())
            if content["kind"] == "state":
                return content


def picture_of(about: dict[str, Any], state: dict[str, Any]) -> Any:
    """Return the current look of a painter, (h, w, 3) linear."""
    with urlopen(Request(f"{about['address']}data/present", headers=key_of(about))) as answer:
        halves = np.frombuffer(answer.read(), np.float16)
    return halves.reshape(*state["size"], 3).astype(np.float32)


def key_of(about: dict[str, Any]) -> dict[str, str]:
    """Return the header that lets a program connect."""
    return {"Authorization": f"Bearer {about['token']}"}


def weights(checkouts: dict[str, Path], place: Path, long_spp: int, seeds: int) -> None:
    """Measure errors of weights and pictures."""
    paintings = {
        name: [str(ROOT / "targets/gallery" / x) for x in files if "." in x]
        for name, files in PAINTINGS.items()
    }
    results = {}
    for version, checkout in checkouts.items():
        output = place / f"{version}.npz"
        arguments = (
            str(checkout),
            json.dumps(paintings),
            str(seeds),
            str(long_spp),
            str(LONG_SEED),
            str(output),
        )
        seconds_of(["-c", WEIGHTS, *arguments], checkout, place / version)
        with np.load(output) as archive:
            results[version] = dict(archive)
    for name in paintings:
        errors, notes = {}, []
        for version, arrays in results.items():
            truth, share = luminance(arrays[f"truth of {name}"]), arrays[f"shares of {name}"]
            error = np.abs(luminance(arrays[f"weights of {name}"]) - truth) / np.maximum(
                truth, 1e-9
            )
            each = 100 * error @ share / share.sum()
            errors[version] = float(each.mean())
            pairs = zip(
                arrays[f"pictures of {name}"], arrays[f"long pictures of {name}"], strict=True
            )
            off_e = np.mean([delta_e_mean(picture, long) for picture, long in pairs])
            notes.append(f"± {each.std() / np.sqrt(seeds):.2f}, picture ΔE {off_e:.2f}")
        print_row(f"error of weights in %, {name}", errors, " / ".join(notes))
    print(
        "samples: " + ", ".join(f"{arrays['spp']} {version}" for version, arrays in results.items())
    )


def luminance(weights: Any) -> Any:
    """Return the luminance of linear colours."""
    return weights @ np.array([0.2126, 0.7152, 0.0722])


def delta_e_mean(picture: Any, truth: Any) -> float:
    """Return the mean CIEDE2000 of two pictures, at the exposure metered on the second.

    The larger is averaged over blocks to the size of the smaller.
    """
    from lightpaint.colour.color import delta_e
    from lightpaint.colour.display.exposure import choose_exposure
    from lightpaint.images.pixel_blocks import block_mean

    picture = block_mean(np.asarray(picture, np.float32), picture.shape[0] // truth.shape[0])
    scale = 2.0 ** choose_exposure(truth)
    return float(delta_e(picture * scale, truth * scale).mean())


def print_row(title: str, figures: dict[str, float], note: str = "") -> None:
    """Print figures of both versions, and their ratio."""
    before, now = figures["before"], figures["now"]
    print(f"{title:38s}{before:8.2f}{now:8.2f}{now / before:7.2f}   {note}", flush=True)


if __name__ == "__main__":
    main()
