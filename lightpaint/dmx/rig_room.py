"""The room around the lights of a show: its models as meshes, or a scene of the user's own."""

import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.dmx.mvr import KIND, PlacedModel
from lightpaint.dmx.rig_scene import Room
from lightpaint.errors import SceneError
from lightpaint.file_reading import read_bytes
from lightpaint.files import first_line
from lightpaint.scene.checks.tokens import markup
from lightpaint.storage.rig_archive import MAX_XML, RigArchive

#: Folder of the meshes, beside the scene.
MESHES = "meshes"

#: Formats of models that are read, which name no other files, and most triangles of all models.
READ_FORMATS, MAX_TRIANGLES = (".glb",), 5_000_000

#: From the axes of glTF, y up, to those of MVR, z up.
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class RoomFiles:
    """A room, the content of its meshes by name of the file, and remarks on what was left out."""

    room: Room
    files: Mapping[str, bytes]
    remarks: tuple[str, ...] = ()


def room_of_scene(path: Path, folder: Path) -> Room:
    """Return the room of a user's scene, for a rig's scene in `folder`.

    Raises SceneError for a scene that cannot be read. Mitsuba checks the rest of it.
    """
    tags = []
    try:
        for token in markup(read_bytes(path, "scene file", SceneError, limit=MAX_XML)):
            tags.append(token["tag"])
    except ValueError as error:
        raise SceneError(f"{path}, {error}") from None
    # What it includes may have them as well.
    has_more = b"include" in tags
    place = os.path.relpath(path.resolve(), folder.resolve())
    has_sensor, has_integrator = (has_more or x in tags for x in (b"sensor", b"integrator"))
    return Room(Path(place).as_posix(), has_sensor, has_integrator)


def room_of_show(path: Path, models: Sequence[PlacedModel]) -> RoomFiles:
    """Return the room that an MVR has, a mesh for each of its files.

    Without trimesh it is empty. Other formats than glTF are named in a remark.
    """
    by_file: dict[str, list[Doubles]] = {}
    for model in models:
        by_file.setdefault(model.file, []).append(model.matrix)
    known = {x: places for x, places in by_file.items() if x.lower().endswith(READ_FORMATS)}
    remarks = _left_out(by_file.keys() - known.keys())
    if known and (trimesh := _trimesh()) is None:
        names = f"{len(known)} models" if len(known) > 1 else "1 model"
        remarks.append(f"{names} in .glb left out: pip install trimesh to read them")
        known = {}
    files: dict[str, bytes] = {}
    bounds, triangles = [], 0
    with RigArchive(path, path.name, KIND) as archive:
        for file, places in known.items():
            if (member := archive.find(file)) is None:
                remarks.append(f"{file} is not in {path.name}: left out")
                continue
            try:
                mesh = _loaded(trimesh, archive.read(member), file)
            except Exception as error:  # any kind, of a library that reads strangers' files
                remarks.append(f"{file} cannot be read: {first_line(error)}")
                continue
            triangles += len(mesh.faces) * len(places)
            if triangles > MAX_TRIANGLES:
                remarks.append(f"{file} and what follows left out: over {MAX_TRIANGLES} triangles")
                break
            points, faces = _copies(mesh, places)
            if len(faces):
                files[f"{MESHES}/{len(files) + 1:03d}.ply"] = ply(points, faces)
                bounds += [points.min(axis=0), points.max(axis=0)]
    room = Room(meshes=tuple(files), points=np.array(bounds) if bounds else None)
    return RoomFiles(room, files, tuple(remarks))


def _left_out(files: Iterable[str]) -> list[str]:
    """Return a remark for each format that is not read."""
    counts: dict[str, int] = {}
    for file in files:
        ending = Path(file).suffix.lower() or "no format"
        counts[ending] = counts.get(ending, 0) + 1
    remarks: list[str] = []
    for ending, count in sorted(counts.items()):
        models = f"{count} {'models' if count > 1 else 'model'} in {ending}"
        remarks.append(f"{models} left out: give a scene as the room, or export .glb")
    return remarks


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError:
        return None
    return trimesh


def _loaded(trimesh: Any, data: bytes, file: str) -> Any:
    """Return a model as one mesh, in metres, y up."""
    scene = trimesh.load_scene(io.BytesIO(data), file_type=Path(file).suffix[1:].lower())
    return scene.to_mesh()


def _copies(mesh: Any, places: Sequence[Doubles]) -> tuple[Doubles, npt.NDArray[np.int32]]:
    """Return points (v, 3) and faces (f, 3) of a mesh in all its places."""
    local = np.c_[np.asarray(mesh.vertices, float), np.ones(len(mesh.vertices))]
    points = [(local @ (place @ Z_UP).T)[:, :3] for place in places]
    faces = [np.asarray(mesh.faces, np.int32) + k * len(local) for k in range(len(places))]
    return np.concatenate(points), np.concatenate(faces)


def ply(points: Doubles, faces: npt.NDArray[np.int32]) -> bytes:
    """Return a mesh as binary PLY. points: (v, 3). faces: (f, 3), places of points."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), np.dtype([("count", "u1"), ("places", "<i4", 3)]))
    rows["count"], rows["places"] = 3, faces
    return header.encode() + points.astype("<f4").tobytes() + rows.tobytes()
