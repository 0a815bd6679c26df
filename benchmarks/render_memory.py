"""How much memory a basis takes while it is rendered, and then at rest.

    python benchmarks/render_memory.py [--lights 64] [--size 1920x1080] [--spp 4] [--whole]
        [--before CHECKOUT]

A hall of lights is rendered by `obtain_basis` in a process of its own, with a cache and without.
Printed are the largest resident memory of the process, and what it has for each light afterwards
beyond what it had with the scene loaded. Neither depends on the samples. `--before` names a
checkout of an earlier version, which is then measured as well. `--whole` traces the whole film at
once beside it, whatever memory that takes: what bands cost in time.
"""

import argparse
import itertools
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from hall import write_hall

REPOSITORY = Path(__file__).parent.parent

#: What renders in a process of its own. Arguments: the scene with few pixels, and with all of them,
#: samples, whether there is a cache, and whether the film is traced in bands or whole.
RENDER = """
import gc, resource, sys, time
from pathlib import Path
import lightpaint as lp
try:
    from lightpaint.basis.cache.cached_render import obtain_basis
except ImportError:
    from lightpaint.basis.render.obtain import obtain_basis

def resident():
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) * 1024

small, path, spp, has_cache = *sys.argv[1:3], int(sys.argv[3]), sys.argv[4] == "cache"
if sys.argv[5] == "whole":
    from lightpaint.basis.render import banded_film
    banded_film.WHOLE_MAX_BYTES = 2**62
# A few pixels first, so that everything is imported and compiled.
obtain_basis(lp.load_scene(small), spp=2, use_cache=False)
scene = lp.load_scene(path)
gc.collect()
before, began_s = resident(), time.process_time()
basis = obtain_basis(scene, spp=spp, use_cache=has_cache)
spent_s = time.process_time() - began_s
gc.collect()
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(before, peak, resident(), spent_s, type(basis.planes).__name__)
"""


def main() -> None:
    """Print memory of both versions, with a cache and without."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lights", type=int, default=64)
    parser.add_argument("--size", default="1920x1080", metavar="WxH")
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--whole", action="store_true", help="trace whole films as well")
    parser.add_argument("--before", type=Path, metavar="CHECKOUT")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    checkouts = {"before": options.before} if options.before else {}
    print(f"{options.lights} lights, {options.size}, {options.spp} samples per pixel", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        sizes = {"small": (64, 36), "large": (width, height)}
        paths = []
        for name, (w, h) in sizes.items():
            (Path(folder) / name).mkdir()
            paths.append(write_hall(Path(folder) / name, options.lights, width=w, height=h))
        for name, checkout in (checkouts | {"now": REPOSITORY}).items():
            films = ["bands", "whole"] if options.whole and checkout == REPOSITORY else ["bands"]
            for cache_mode, film in itertools.product(("cache", "none"), films):
                figures = rendered(paths, checkout, options, cache_mode, film)
                kind = f"{name:6s} cache: {cache_mode:5s}" + (f" {film}" if options.whole else "")
                print(f"    {kind} {figures}", flush=True)


def rendered(
    paths: list[Path], checkout: Path, options: argparse.Namespace, cache_mode: str, film: str
) -> str:
    """Return what a render in a process of its own took."""
    with tempfile.TemporaryDirectory() as cache:
        environment = os.environ | {"PYTHONPATH": str(checkout), "LIGHTPAINT_CACHE": cache}
        command = [
            sys.executable,
            "-c",
            RENDER,
            *map(str, paths),
            str(options.spp),
            cache_mode,
            film,
        ]
        completed = subprocess.run(
            command, env=environment, cwd=checkout, capture_output=True, text=True
        )
    if completed.returncode:
        raise SystemExit(completed.stderr)
    *numbers, kind = completed.stdout.split()
    before, peak, after, spent_s = map(float, numbers)
    each = [(x - before) / options.lights / 1e6 for x in (peak, after)]
    return (
        f"at most {peak / 1e9:.2f} GB, {each[0]:.0f} MB a light; at rest {each[1]:.0f} MB a light "
        f"({kind}); {spent_s:.0f} s of the processor"
    )


if __name__ == "__main__":
    main()
