#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit), variant scalar_rgb.
#
# `mi.parser.write_file` writes a state back to XML. One expects a state that went through
# `mi.parser.transform_all`, which prepares it for rendering, to come out as the scene that it was:
# sensor, integrator and lights below <scene>, under their ids. Instead <scene> has one child,
# <shape type="merge">, and sensor, integrator and emitters stand in that, without ids. With
# `config.merge_meshes = False` they stay below <scene>; the ids are lost there, too. Mitsuba loads
# either file; a program that looks for <sensor> below <scene>, or for a light by its id, finds none.
#
# Output seen:
#   merge_meshes True: below scene: shape merge; in it: emitter, integrator, sensor, shape; ids: none
#   merge_meshes False: below scene: emitter, integrator, sensor, shape; ids: none
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import mitsuba as mi

mi.set_variant("scalar_rgb")
folder = Path(sys.argv[1])
(folder / "scene.xml").write_text("""<scene version="3.0.0">
    <integrator type="path" id="paths"/>
    <sensor type="perspective" id="camera"/>
    <shape type="cube" id="box"/>
    <emitter type="point" id="lamp"/>
</scene>""")
found = []
for merges in (True, False):
    config = mi.parser.ParserConfig("scalar_rgb")
    config.merge_meshes = merges
    state = mi.parser.parse_file(config, str(folder / "scene.xml"))
    mi.parser.transform_all(config, state)
    mi.parser.write_file(state, str(folder / "written.xml"))
    root = ET.parse(folder / "written.xml").getroot()
    is_wrapped = [x.get("type") for x in root] == ["merge"]
    inside = sorted({x.tag for x in (root[0] if is_wrapped else root) if x.tag != "default"})
    ids = sorted(x.get("id") or x.get("name") for x in root.iter()
                 if x.tag in ("sensor", "emitter", "integrator") and (x.get("id") or x.get("name")))
    where = "below scene: shape merge; in it: " if is_wrapped else "below scene: "
    print(f"merge_meshes {merges}: {where}{', '.join(inside)}; ids: {', '.join(ids) or 'none'}")
    found.append((is_wrapped, inside, ids))
    assert len(mi.load_file(str(folder / "written.xml")).sensors()) == 1
parts = ["emitter", "integrator", "sensor", "shape"]
sys.exit(found != [(True, parts, []), (False, parts, [])])
PYTHON
