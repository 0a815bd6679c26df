"""What is built of this works where there is no checkout; what it needs is bounded and known."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, metadata, requires
from pathlib import Path

import pytest
from command import run, run_refused
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.images.denoiser import OLDEST_OIDN

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
PINNED = {
    canonicalize_name(pin.name): pin
    for line in (REPOSITORY / "constraints.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
    for pin in [Requirement(line)]
}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the source distribution, and the wheel that was built of that."""
    folder = tmp_path_factory.mktemp("built")
    made = (".*_cache", "__pycache__", "_build", "*.egg-info", "*.exr.tmp")
    left_out = shutil.ignore_patterns(".git", *made)
    # A build leaves things beside the sources.
    shutil.copytree(REPOSITORY, folder / "copy", ignore=left_out, symlinks=True)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", "."]
    completed = subprocess.run([*command, "copy"], cwd=folder, capture_output=True, text=True)
    assert completed.returncode == 0, completed.stdout + completed.stderr
    return folder


@pytest.mark.nightly
@pytest.mark.long
def test_wheel_solves_the_demo_in_an_empty_folder(built: Path, tmp_path: Path):
    [wheel] = built.glob("*.whl")
    site, folder = tmp_path / "site", tmp_path / "empty"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command.append("--no-compile")  # what is imported is compiled then
    subprocess.run([*command, "--target", site, wheel], check=True)
    folder.mkdir()
    environment = {"PYTHONPATH": str(site), "LIGHTPAINT_CACHE": str(tmp_path / "cache")}
    completed = lightpaint(folder, environment, "demo", "--spp", "4")
    assert completed.returncode == 0, completed.stderr
    demo_folder = folder / "lightpaint-demo"
    report = f"Open {Path('lightpaint-demo', 'evening', 'report.html')} in a browser. "
    assert completed.stdout.splitlines()[-3:-1] == ["", f"{report}Then paint your own:"]
    results = {"lighting.json", "relit.xml", "predicted.exr", "verified.exr", "comparison.png"}
    results |= {"report.html", "report.json", "result.json"}
    assert {file.name for file in (demo_folder / "evening").iterdir()} == results
    # The very command that it says it runs has the same answer, which is verified already.
    [solve_command] = re.findall(r"lightpaint: lightpaint (solve .*)", completed.stderr)
    assert solve_command in (demo_folder / "evening" / "report.html").read_text("utf-8")
    answer = weights(demo_folder / "evening")
    second = lightpaint(folder, environment, *solve_command.split(), "--no-verify")
    assert second.returncode == 0, second.stderr
    assert "kept from an earlier run" in second.stderr
    assert weights(demo_folder / "evening") == answer
    assert len(answer) == 12


@pytest.mark.nightly
@pytest.mark.long  # beside the one that takes long, for one worker builds for all three
def test_source_distribution_has_all_that_the_checks_want(built: Path):
    [archive] = built.glob("*.tar.gz")
    with tarfile.open(archive) as file:
        members = {Path(*Path(x.name).parts[1:]): x for x in file if not x.isdir()}
    for folder in ("lightpaint", "scenes", "targets", "tests", "notebooks", "benchmarks", "docs"):
        files = {x.relative_to(built / "copy") for x in (built / "copy" / folder).rglob("*")}
        assert {x for x in files if (built / "copy" / x).is_file()} <= set(members)
    for name in ("check", "constraints.txt", "README.md", "LICENSE", "pyproject.toml", ".ci/run"):
        assert Path(name) in members
    assert members[Path("check")].mode & 0o100
    assert all(x.isfile() for x in members.values())  # what was a link is a file


@pytest.mark.nightly
@pytest.mark.long
def test_wheel_has_no_more_than_it_needs(built: Path):
    [wheel] = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {Path(name).parts[0].partition("-")[0] for name in names} == {"lightpaint"}
    assert not [name for name in names if name.endswith("make.py")]


def test_the_demo_does_not_write_over_what_is_there(tmp_path: Path):
    demo = lp.write_demo(tmp_path / "lightpaint-demo")
    assert demo == lp.write_demo(tmp_path / "lightpaint-demo")
    assert demo.painting.read_bytes() == shipped("targets/gallery/evening.png")
    demo.scene.write_text("<scene/>", "utf-8")
    assert "differs from the demo" in run_refused(tmp_path, "demo")
    assert demo.scene.read_text("utf-8") == "<scene/>"
    (tmp_path / "file").write_text("mine", "utf-8")
    assert "cannot write" in run(tmp_path, "demo", "-o", "file").stderr


@pytest.mark.nightly
@pytest.mark.long
def test_the_demo_has_lamps_that_somebody_could_hang(tmp_path: Path):
    """No pink sun, no cyan cove: no lamp is green or magenta, and none lacks a channel."""
    demo = lp.write_demo(tmp_path / "demo")
    look = lp.paint_with_light(
        demo.scene,
        demo.painting,
        tmp_path / "answer",
        resolution="1/4",
        resize=True,
        spp=16,
        verify=False,
        report=False,
    )
    assert (look.target.importance == 1).all()
    assert look.solution.problem.fit.colors == "gentle"
    for light in look.lighting.lights:
        red, green, blue = light.emission
        assert min(red, blue) / 1.1 <= green <= 1.1 * max(red, blue), light.name
        assert min(red, blue) > 0.05 * max(red, blue), light.name


def test_what_can_break_is_bounded_from_above():
    requirements = map(Requirement, PROJECT["dependencies"])
    bounded = {x.name for x in requirements if any(y.operator == "<" for y in x.specifier)}
    assert bounded >= {"mitsuba", "drjit", "numpy", "OpenEXR", "OpenImageIO", "pillow"}
    assert "karellen-llvm-core" in bounded


def test_the_denoiser_is_required_in_the_version_that_is_used():
    found = [x for x in map(Requirement, PROJECT["dependencies"]) if x.name == "pyoidn"]
    oldest = ".".join(map(str, OLDEST_OIDN))
    assert found
    assert all(not x.specifier.contains("2.5.0.1") for x in found)
    assert all(x.specifier.contains(oldest) for x in found)


def test_every_package_is_pinned_within_its_bounds():
    queue = [*PROJECT["dependencies"]]
    for extra in PROJECT["optional-dependencies"].values():
        queue += extra
    names: set[str] = set()
    while queue:
        one = Requirement(queue.pop())
        name = canonicalize_name(one.name)
        if name == "pip" or (one.marker is not None and not one.marker.evaluate()):
            continue
        assert name in PINNED, f"{name} is not in constraints.txt"
        [pin] = PINNED[name].specifier
        assert pin.operator == "=="
        assert one.specifier.contains(pin.version), f"{one} and {PINNED[name]}"
        if (name, *sorted(one.extras)) not in names:
            names.add((name, *sorted(one.extras)))
            queue += _of(one)
    assert len(names) > 40


def test_every_pin_runs_on_the_oldest_python():
    # Debian 12 has Python 3.11.2: a library that wants 3.11.5 cannot be installed there.
    [oldest] = SpecifierSet(PROJECT["requires-python"])
    wanted = {}
    for name in PINNED:
        with suppress(PackageNotFoundError):  # an extra that is not installed here
            wanted[name] = SpecifierSet(metadata(name).get("Requires-Python") or "")
    assert len(wanted) > 40
    assert [name for name, x in wanted.items() if not x.contains(f"{oldest.version}.2")] == []


def _of(package: Requirement) -> list[str]:
    """What an installed package needs, with these extras."""
    try:
        needed = map(Requirement, requires(package.name) or [])
    except PackageNotFoundError:  # an extra that is not installed here
        return []
    requirements = []
    for one in needed:
        if one.marker is None or any(
            one.marker.evaluate({"extra": x}) for x in ("", *package.extras)
        ):
            one.marker = None
            requirements.append(str(one))
    return requirements


def lightpaint(
    folder: Path, environment: dict[str, str], *arguments: str
) -> subprocess.CompletedProcess[str]:
    """`lightpaint …` of what is installed at PYTHONPATH, and not of the checkout."""
    code = "import sys, lightpaint; from lightpaint.cli import main; sys.stderr.write("
    code += "lightpaint.__file__ + chr(10)); sys.exit(main())"
    completed = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert completed.stderr.startswith(environment["PYTHONPATH"])
    return completed


def weights(folder: Path) -> dict[str, list[float]]:
    data = json.loads((folder / "lighting.json").read_text("utf-8"))
    return {name: light["emission"] for name, light in data["lights"].items()}


def shipped(name: str) -> bytes:
    return (REPOSITORY / name).read_bytes()
