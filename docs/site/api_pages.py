"""The reference of the Python API: each public name, in the order of a day's work."""

from pathlib import Path

import lightpaint as lp

#: Title of a page, what it is for, and its names.
GROUPS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "one-call": (
        "All in one call",
        "From a scene and a painting to a folder of results; and the job that this makes.",
        ("paint_with_light", "Job", "run", "Settings", "SceneFile", "Painting", "Look"),
    ),
    "scenes": (
        "Scenes and their lights",
        "Load a scene, find its lights, move or add some.",
        ("load_scene", "Scene", "Pose", "NewEmitter", "use_variant"),
    ),
    "bases": (
        "What each light does",
        "Render the image of each light alone, or read it from a file.",
        (
            "render_basis",
            "Basis",
            "read_basis",
            "write_basis",
            "read_light_groups",
            "LightGroups",
            "find_frames",
            "FrameSequence",
            "Objects",
        ),
    ),
    "targets": (
        "Paintings",
        "Make something to paint on, and read what was painted.",
        (
            "render_template",
            "template_of_basis",
            "read_target",
            "Target",
            "ViewTransform",
            "TransformChoice",
        ),
    ),
    "solving": (
        "Find the lighting",
        "The solve, its options and constraints, and what it returns.",
        (
            "solve",
            "Fit",
            "Constraints",
            "read_constraints",
            "Problem",
            "Solution",
            "Certificate",
            "Lighting",
            "read_lighting",
            "write_lighting",
            "correct_noise",
            "refine",
        ),
    ),
    "judging": (
        "Judge an answer",
        "How close it looks, how sure the lights are, and what holds them back.",
        (
            "analyse",
            "Analysis",
            "compare_appearance",
            "Appearance",
            "diagnose",
            "Diagnosis",
            "error_bars",
            "Uncertainty",
            "verdict",
        ),
    ),
    "relighting": (
        "See it, and take it along",
        "Predict, relight, verify and export.",
        (
            "combine",
            "Estimate",
            "display_picture",
            "relight",
            "verify",
            "Verification",
            "relight_frames",
            "write_exports",
        ),
    ),
    "placing": (
        "Lights at other places",
        "Let the search move lights, or add some.",
        (
            "place",
            "Rigging",
            "Freedom",
            "NewLights",
            "MirroredPair",
            "Placement",
            "Move",
            "AddedLight",
            "suggest_lights",
            "Suggestion",
        ),
    ),
    "painter": (
        "The painter in a notebook",
        "A cell that paints; it needs the extra ``notebook``.",
        ("Painter",),
    ),
    "rest": (
        "Errors and the demo",
        "What a call may raise, and the files of the demo.",
        ("LightpaintError", "write_demo", "Demo"),
    ),
}


def write_api(folder: Path) -> None:
    """Write a page for each group into a new folder, and one that lists them."""
    named = [name for _, _, names in GROUPS.values() for name in names]
    public = {*lp.__all__, *lp._EXTRAS} - {"__version__"}
    if set(named) != public or len(named) != len(set(named)):
        raise ValueError(f"in one group each: {sorted(set(named) ^ public)}")
    folder.mkdir(parents=True)
    for key, (title, purpose, names) in GROUPS.items():
        entries = [_entry(name) for name in names]
        page = "\n\n".join([_title(title), purpose, *entries])
        (folder / f"{key}.rst").write_text(page + "\n", encoding="utf-8")
    rows = [
        f"   * - :doc:`{title} <{key}>`\n     - {purpose}"
        for key, (title, purpose, _) in GROUPS.items()
    ]
    index = [
        _title("Python API"),
        "All public names, as ``import lightpaint as lp`` has them. :doc:`/python` shows them at "
        "work; :doc:`/stability` says which of them stay as they are.",
        ".. list-table::\n   :widths: 35 65\n\n" + "\n".join(rows),
        ".. toctree::\n   :hidden:\n\n   " + "\n   ".join(GROUPS),
    ]
    (folder / "index.rst").write_text("\n\n".join(index) + "\n", encoding="utf-8")


def _entry(name: str) -> str:
    """Return the directive that shows a name with its docstring."""
    value = getattr(lp, name)
    if not isinstance(value, type):
        return f"{_title(name, '-')}\n\n.. autofunction:: lightpaint.{name}"
    members = "" if name == "Painter" else "\n   :members:"
    return f"{_title(name, '-')}\n\n.. autoclass:: lightpaint.{name}{members}"


def _title(text: str, line: str = "=") -> str:
    return f"{text}\n{line * len(text)}"
