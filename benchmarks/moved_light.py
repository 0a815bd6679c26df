"""Cost of moving one lamp: the processor's time of a solve after it, against the first one.

    python benchmarks/moved_light.py [--lights spot_vase spot_knot] [--rounds 3]

Each round copies the gallery, solves it with an empty cache, moves one spot by 10 cm in the XML,
solves again, and once more with nothing changed. Times are of whole processes, user and system, all
threads, ratios of neighbours in time; medians are taken over all rounds.
"""

import argparse
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
GALLERY = ROOT / "scenes" / "gallery"
SPOTS = ["spot_field", "spot_tide", "spot_figure", "spot_knot", "spot_vase"]
PAINTING = ROOT / "targets" / "gallery" / "evening.exr"


def main() -> None:
    """Print the times of each round, and the medians of their ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lights", nargs="+", default=SPOTS)
    parser.add_argument("--rounds", type=int, default=1)
    options = parser.parse_args()
    print("moved         first s   moved s   again s   moved / first   again / first")
    ratios = []
    for light in options.lights * options.rounds:
        with tempfile.TemporaryDirectory() as folder:
            first, move_s, second_s = one_round(Path(folder), light)
        ratios.append((move_s / first, second_s / first))
        shares = "   ".join(f"{ratio:13.2f}" for ratio in ratios[-1])
        seconds = "   ".join(f"{time_s:7.1f}" for time_s in (first, move_s, second_s))
        print(f"{light:11s}   {seconds}   {shares}", flush=True)
    medians = [statistics.median(column) for column in zip(*ratios, strict=True)]
    print(f"{'median':41s}   " + "   ".join(f"{ratio:13.2f}" for ratio in medians))


def one_round(folder: Path, light: str) -> tuple[float, float, float]:
    """Return seconds of the first solve, after the move, and with nothing changed."""
    shutil.copytree(GALLERY, folder / "gallery")
    scene = folder / "gallery" / "scene.xml"
    first = solve_s(folder, scene)
    scene.write_text(moved(scene.read_text(encoding="utf-8"), light), encoding="utf-8")
    return first, solve_s(folder, scene), solve_s(folder, scene)


def moved(text: str, light: str) -> str:
    """Return the scene with that spot 10 cm along x."""

    def further(match: re.Match[str]) -> str:
        return f"{match[1]}{float(match[2]) + 0.1}"

    pattern = rf'(id="{light}">\s*<transform name="to_world">\s*<lookat origin=")([-\d.]+)'
    edited, count = re.subn(pattern, further, text)
    assert count == 1, f"{light} is not a spot of the gallery"
    return edited


def solve_s(folder: Path, scene: Path) -> float:
    """Return the processor's seconds of one solve without verification."""
    command = [sys.executable, "-m", "lightpaint", "solve", str(scene), str(PAINTING)]
    command += ["--no-verify", "--force", "-o", str(folder / "answer")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"LIGHTPAINT_CACHE": str(folder / "cache")}
    subprocess.run(command, check=True, capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
