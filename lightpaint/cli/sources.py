"""What a solve starts from, as the command line names it: light groups, a basis or a scene.

`solve --lights FILE.exr TARGET` and `solve FILE.exr TARGET` both mean another renderer's light
groups; `--lights key,fill` goes on to mean the lights of a scene.
"""

from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

from lightpaint.basis.lightgroups.read import LightGroups, is_light_groups, read_light_groups
from lightpaint.errors import BasisError


@dataclass(frozen=True)
class GroupSource:
    """Light groups to solve on, and the paintings to solve for."""

    path: Path
    targets: tuple[str, ...]


def light_group_source(options: Namespace) -> GroupSource | None:
    """The light groups that the options of `solve` name; None where it is a scene or a basis.

    Raises BasisError for a `--lights` that names a file which is not there, or for a `--pattern`
    without light groups.
    """
    source, given = Path(options.source), ",".join(options.lights or ())
    if given and _is_file_to_be(given, source):
        path = Path(given)
        if not path.exists():
            raise BasisError(f"no such file or folder of light groups: --lights {given}")
        if path.is_dir() and not is_light_groups(path):
            raise BasisError(f"--lights {given} is a folder without an .exr file")
        if not is_light_groups(path):
            raise BasisError(
                f"--lights {given} holds no light groups: give an EXR of another renderer's, or a "
                "folder of them; a basis of lightpaint's own stands where the scene does"
            )
        return GroupSource(path, (options.source, *options.targets))
    if source.suffix.lower() != ".xml" and is_light_groups(source):
        return GroupSource(source, tuple(options.targets))
    if getattr(options, "pattern", None):
        raise BasisError(
            f"--pattern names the layers of light groups, and {source} has none: leave it out, or "
            "give the EXR"
        )
    return None


def read_source(source: GroupSource, options: Namespace) -> LightGroups:
    """The light groups of `source`, with the `--pattern` of the options.

    Raises BasisError for options that need a scene, its samples or their noise.
    """
    _check_nothing_to_render(source, options)
    return read_light_groups(source.path, pattern=getattr(options, "pattern", None))


def _is_file_to_be(given: str, source: Path) -> bool:
    """Whether `--lights` means a file or folder, and not lights of a scene or a basis."""
    if given.lower().endswith(".exr"):
        return True
    # A folder may well have the name of a light: results are kept in such.
    return source.suffix.lower() != ".xml" and Path(given).is_dir()


def _check_nothing_to_render(source: GroupSource, options: Namespace) -> None:
    given = vars(options)
    lights = given.get("lights") if Path(given["source"]) == source.path else None
    asked = {
        "-s": given.get("sensor"),
        "-D": given.get("parameters"),
        "-m": given.get("variant"),
        "--target": given.get("views"),
        "--group": given.get("groups"),
        "--spp": given.get("spp"),
        "--time": given.get("time_s"),
        "--quality": given.get("quality"),
        "--resolution": given.get("resolution"),
        "--seed": given.get("seed"),
        "--refine": given.get("refine"),
        "--suggest": given.get("suggest"),
        "--correct-noise": given.get("noise_correction"),
        "--unit": given.get("cd_per_unit"),
    }
    if idle := [name for name, value in asked.items() if value]:
        raise BasisError(
            f"{', '.join(idle)} cannot be had from {source.path}: its light groups are rendered "
            "already, and say nothing of samples, noise or units; leave it out"
        )
    if lights:
        raise BasisError(
            f"--lights {','.join(lights)} chooses lights of a scene: of light groups, keep the "
            "others as they are with --lock NAME"
        )
