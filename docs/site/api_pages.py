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
            "with_error_bars",
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
    "measuring": (
        "Lux on planes",
        "Say where to measure, and measure the illuminance that each light gives there.",
        ("read_planes", "MeasuringPlane", "measure_illuminance", "Illuminance", "measure_glare"),
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

#: Classes that are not public names, of values in attributes and arguments of those: by module, in
#: the order of the groups.
PARTS: dict[str, tuple[str, ...]] = {
    "scene.lights.light": ("Light",),
    "scene.properties.site": ("Site", "EmitterPlace"),
    "basis.lights": ("Lights", "BasisLight"),
    "basis.planes": ("Planes", "IndirectLight"),
    "basis.light_basis": ("Origin",),
    "basis.lightgroups.render_layers": ("RenderLayer",),
    "lighting.constraints.constraint_table": ("Tie",),
    "lighting.constraints.absolute_scale": ("Scale",),
    "lighting.loss.expected_lights": ("ExpectedLights",),
    "lighting.normal_equations": ("NormalEquations",),
    "lighting.loss.reweighting": ("Reweighting",),
    "target.painted_target": ("Wish",),
    "lighting.problem": ("Refinement",),
    "lighting.answer.certificate": ("Bound",),
    "lighting.wish_outcomes": ("PlanesAnswer",),
    "lighting.answer.lighting": ("LightSetting",),
    "lighting.answer.lighting_keys": ("LightingKey",),
    "colour.luminous_flux": ("Photometry",),
    "lighting.analysis.answer_analysis": ("Ambiguity",),
    "lighting.analysis.appearance.area_lights": ("AreaLights",),
    "lighting.analysis.appearance.color_choices": ("ColorChoice",),
    "lighting.analysis.appearance.delivery": ("Delivery",),
    "lighting.analysis.appearance.limiting_reasons": ("Reason", "Loosening"),
    "lighting.analysis.appearance.display_difference": ("UnpaintedChange",),
    "lighting.analysis.diagnosis": ("Place",),
    "colour.spectrum": ("Observer",),
    "lighting.analysis.rendered_colors": ("SurfaceColor",),
    "placement.suggestion": ("MoveSuggestion",),
    "placement.new_lights": ("Mirror",),
    "photometry.illuminance": ("Wishes", "Ratio", "PowerBudget", "PlaneReading"),
    "photometry.planes_file": ("PlanesFile",),
    "progress": ("Progress",),
}

PARTS_TITLE = "Values in attributes"
PARTS_PURPOSE = "What other values are made of: M and b, lights, planes, bounds."


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
    (folder / "parts.rst").write_text(_parts_page() + "\n", encoding="utf-8")
    pages = {key: (title, purpose) for key, (title, purpose, _) in GROUPS.items()}
    pages["parts"] = PARTS_TITLE, PARTS_PURPOSE
    rows = [
        f"   * - :doc:`{title} <{key}>`\n     - {purpose}"
        for key, (title, purpose) in pages.items()
    ]
    index = [
        _title("Python API"),
        "All public names, as ``import lightpaint as lp`` has them. :doc:`/python` shows them at "
        "work; :doc:`/stability` says which of them stay as they are.",
        ".. list-table::\n   :widths: 35 65\n\n" + "\n".join(rows),
        ".. toctree::\n   :hidden:\n\n   " + "\n   ".join(pages),
    ]
    (folder / "index.rst").write_text("\n\n".join(index) + "\n", encoding="utf-8")


def _parts_page() -> str:
    """Return the page of the classes that a program reads but does not make."""
    note = (
        "You get these from the public names and need not import them; their modules may change "
        "from version to version."
    )
    options = "\n   :members:\n   :special-members: __call__"
    entries = [
        f"{_title(name, '-')}\n\n.. autoclass:: lightpaint.{module}.{name}{options}"
        for module, names in PARTS.items()
        for name in names
    ]
    return "\n\n".join([_title(PARTS_TITLE), PARTS_PURPOSE, note, *entries])


def _entry(name: str) -> str:
    """Return the directive that shows a name with its docstring."""
    value = getattr(lp, name)
    if not isinstance(value, type):
        return f"{_title(name, '-')}\n\n.. autofunction:: lightpaint.{name}"
    members = "" if name == "Painter" else "\n   :members:"
    return f"{_title(name, '-')}\n\n.. autoclass:: lightpaint.{name}{members}"


def _title(text: str, line: str = "=") -> str:
    return f"{text}\n{line * len(text)}"
