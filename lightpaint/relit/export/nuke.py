"""A Nuke script that multiplies the layers of the rendered file and adds them up.

A `.nk` file is Tcl: each node takes its inputs from a stack, the top one first, and leaves itself
there. Names that come from elsewhere stand only where they can be quoted.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.lightgroups.layers import RenderLayer
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.primaries import to_rec709
from lightpaint.lighting.lighting import Lighting

#: What needs a backslash in a quoted word of Tcl that itself stands in braces.
SPECIAL = re.compile(r'[\\"\[\]${}]')


def nuke_script(groups: LightGroups, lighting: Lighting) -> str:
    """The text of relit.nk: Σ multiplier × layer, and the rest as it is."""
    files = list(dict.fromkeys(x.file for x in _read(groups)))
    lines = ["version 12.0 v1"]
    for name in dict.fromkeys(map(nuke_layer, _read(groups))):
        if name != "rgba":
            lines.append(f"add_layer {{{name} {name}.red {name}.green {name}.blue {name}.alpha}}")
    lines += _node("StickyNote", inputs="0", name="lightpaint_note", label=quoted(_note(groups)))
    for k, file in enumerate(files):
        path = Path(file).absolute().as_posix()
        lines += _node("Read", inputs="0", file=quoted(path), raw="true", name=f"Read_{k}")
        lines.append(f"set R{k} [stack 0]")

    has_alpha = groups.beauty is not None and groups.beauty.alpha is not None
    if has_alpha:
        lines += _shuffle(groups.beauty, files, "Alpha")
    # Multipliers are of Rec.709; what comes out has the primaries of the file again.
    primaries = groups.layers[0].primaries
    matrix = None if primaries is None else to_rec709(primaries)
    if groups.has_rest:
        lines += _rest(groups, files) + _matrix(matrix, "Rest_in_Rec709")
    settings = {light.name: light for light in lighting.lights}
    for k, (light, layer) in enumerate(zip(groups.basis.lights, groups.layers, strict=False)):
        lines += _shuffle(layer, files, f"Layer_{k}") + _matrix(matrix, f"Layer_{k}_in_Rec709")
        r, g, b = (f"{v:.9g}" for v in settings[light.name].weight)
        lines += _node(
            "Multiply",
            channels="rgb",
            value=f"{{{r} {g} {b} 1}}",
            name=f"Light_{k}",
            label=quoted(_plain(light.name)),
        )
        if k or groups.has_rest:
            lines += _node("Merge2", inputs="2", operation="plus", name=f"Sum_{k}")
    lines += _matrix(None if matrix is None else np.linalg.inv(matrix), "As_in_the_file")
    if has_alpha:
        lines += _node(
            "Copy", inputs="2", from0="rgba.alpha", to0="rgba.alpha", name="Alpha_of_beauty"
        )
    return "\n".join(lines) + "\n"


def nuke_layer(layer: RenderLayer) -> str:
    """What Nuke calls a layer of an EXR file; of plain R, G, B in a file of one part, `rgba`.

    It takes digits from the front of each piece between dots, makes everything that is no letter
    or digit an underscore, and joins the pieces with underscores.
    """
    prefix, _, _ = layer.channels[0].rpartition(".")
    pieces = [piece.lstrip("0123456789") for piece in (prefix or layer.part).split(".")]
    name = "_".join(re.sub(r"[^A-Za-z0-9]", "_", piece) for piece in pieces if piece)
    return "rgba" if name in ("", "Ci") else name


def quoted(text: str) -> str:
    """One word of Tcl, whatever it holds."""
    escaped = SPECIAL.sub(lambda found: f"\\{found[0]}", text)
    return '"' + escaped.replace("\r", "").replace("\n", "\\n") + '"'


def _read(groups: LightGroups) -> list[RenderLayer]:
    return [*groups.layers, *([groups.beauty] if groups.beauty is not None else [])]


def _rest(groups: LightGroups, files: Sequence[Path]) -> list[str]:
    """The beauty less all groups."""
    lines = _shuffle(groups.beauty, files, "Beauty")
    for k, layer in enumerate(groups.layers):
        lines += _shuffle(layer, files, f"Without_{k}")
        lines += _node("Merge2", inputs="2", operation="minus", name=f"Rest_{k}")
    return lines


def _matrix(matrix: Floats | None, name: str) -> list[str]:
    if matrix is None:
        return []
    rows = " ".join("{" + " ".join(f"{v:.9g}" for v in row) + "}" for row in matrix)
    return _node("ColorMatrix", matrix=f"{{{rows}}}", name=name)


def _shuffle(layer: RenderLayer | None, files: Sequence[Path], name: str) -> list[str]:
    assert layer is not None
    read = f"push $R{files.index(layer.file)}"
    return [read, *_node("Shuffle", **{"in": nuke_layer(layer)}, name=name)]


def _node(kind: str, **knobs: str) -> list[str]:
    return [f"{kind} {{", *(f" {knob} {value}" for knob, value in knobs.items()), "}"]


def _note(groups: LightGroups) -> str:
    return (
        f"lightpaint: light groups of {_plain(groups.path.name)}, multiplied as solved. "
        "Should a Shuffle show black, choose its layer by hand: its Multiply bears the name."
    )


def _plain(text: str) -> str:
    """Without what Nuke would evaluate in a label."""
    return re.sub(r"[^\w .,+()-]", "_", text)
