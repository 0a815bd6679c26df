"""How each kind of file is read and compared, to know what damage has made of it."""

import json
import os
import struct
import tomllib
from pathlib import Path
from typing import Any


class Reader:
    """Reads one kind of file, and compares it."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        if kind == "scene":
            from lightpaint.scene.runtime.variant import use_variant

            use_variant("scalar_rgb")

    def read(self, path: Path) -> Any:
        """All that is known of the file, to compare."""
        if self.kind == "picture":
            from lightpaint.images.picture import read_picture

            return ComparablePicture(read_picture(path))
        if self.kind == "mask":
            from lightpaint.images.picture import read_mask

            return read_mask(path).tobytes()
        if self.kind == "estimate":
            from lightpaint.images.estimate import read_estimate

            estimate, attributes = read_estimate(path)
            return estimate.image.tobytes(), estimate.half_difference.tobytes(), dict(attributes)
        if self.kind == "lighting":
            from lightpaint.lighting.answer.lighting_file import read_lighting

            return read_lighting(path)
        if self.kind == "lights":
            from lightpaint.lighting.constraints.constraints_file import read_constraints
            from lightpaint.scene.lights.lights_file import read_lights_file

            file = read_lights_file(path)
            return file.lights, dict(file.groups), read_constraints(path)
        if self.kind == "template":
            from lightpaint.target.template import read_template

            template = read_template(path.parent)
            return template.transform, template.scene, template.content, template.sensor
        if self.kind == "basis":
            from lightpaint.basis.file.basis_file import read_basis, read_origin

            basis = read_basis(path)
            assert read_origin(path) == (
                basis.origin,
                basis.size,
                tuple(light.identity for light in basis.lights),
            )
            arrays = (basis.images, basis.half_differences, basis.emitters_seen)
            return basis.lights, basis.origin, [(a.shape, a.tobytes()) for a in arrays]
        if self.kind == "layers":
            from lightpaint.colour.display.view_transform import ViewTransform
            from lightpaint.paint.layers.layer_files import read_layers

            fields, arrays = read_layers(path, (6, 5), ViewTransform()).as_fields()
            return fields, {name: (a.shape, a.tobytes()) for name, a in arrays.items()}
        if self.kind == "groups":
            from lightpaint.basis.lightgroups.light_groups import read_light_groups

            light_groups = read_light_groups(path)
            return light_groups.basis.names, light_groups.basis.images.tobytes()
        from lightpaint.scene.scene_reader import load_scene

        scene = load_scene(path)
        return scene.film, scene.spp, scene.integrator, scene.emitters

    def opinion(self, path: Path, read: Any) -> str:
        """What is to be said of a damaged file that was read as something else than before."""
        if self.kind == "picture":
            return _second_opinion(path, read.picture)
        if self.kind in ("scene", "groups", "mask", "estimate", "layers"):
            return "read"  # a bit that is turned in a number of these nobody can know of
        return "agreed" if self.agrees(path, read) else f"misread as {read!r}"[:300]

    def agrees(self, path: Path, read: Any) -> bool:
        """Whether what was read is what a plain parser finds in the file."""
        if self.kind == "lighting":
            return contents(read) == contents_of_json(json.loads(path.read_text("utf-8-sig")))
        if self.kind == "lights":
            data = tomllib.loads(path.read_text("utf-8-sig"))
            lights, groups, constraints = read
            return (
                list(lights or ()) == data.get("lights", [])
                and {k: list(v) for k, v in groups.items()} == data.get("groups", {})
                and {k: v for k, v, _ in constraints.lights} == data.get("light", {})
                and constraints.sparse == data.get("sparse")
            )
        if self.kind == "template":
            data = json.loads(path.read_text("utf-8-sig"))
            view = data["view"]
            return (read[0].name, read[0].stops, *read[1:]) == (
                *(view["name"], view["stops"]),
                *(data[k] for k in ("scene", "content", "sensor")),
            )
        return False


class ComparablePicture:
    """A picture, equal to another of which all the same is known."""

    def __init__(self, picture: Any) -> None:
        import numpy as np

        self.picture = picture
        self.known = tuple(
            (value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)
            for value in vars(picture).values()
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ComparablePicture) and self.known == other.known

    __hash__ = None  # type: ignore[assignment]


def contents(lighting: Any) -> Any:
    """What a lighting says, by way of the file that is written of it."""
    from lightpaint.lighting.answer.lighting_file import write_lighting

    path = Path(os.environ.get("TMPDIR", "/tmp")) / f"lighting.{os.getpid()}.json"
    write_lighting(path, lighting)
    try:
        return contents_of_json(json.loads(path.read_text(encoding="utf-8")))
    finally:
        path.unlink()


def contents_of_json(data: Any) -> Any:
    """What a lighting.json says, with what goes without saying; the rest it may say is not read."""
    lights = []
    for name, light in data["lights"].items():
        constraint = light.get("constraint", "")
        lights.append(
            (
                *(name, light["plugin"], light["parameter"], light["unit"]),
                *(light["emission"], light["weight"], light.get("members", [name])),
                *(light.get("is_fixed", False), light.get("unit_flux"), constraint),
                light.get("is_active", False) if constraint else False,
                *(light.get(k) for k in ("standard_error", "interval")),
                light.get("reached", [True] * 3),
            )
        )
    solve = data.get("solve")
    if solve is not None:
        needed = ("kkt_residual", "objective", "relative_objective", "sweeps", "converged")
        solve = [*(solve[k] for k in (*needed, "unreached")), solve.get("curve", [])]
        bounds = ("lights", "kind", "held_by", "gain", "multiplier", "per")
        solve.append([[b[k] for k in bounds] for b in data["solve"].get("bounds", [])])
    fields = [data.get(k, "") for k in ("target", "scene_identity")]
    return data["format"], fields, data.get("cd_per_unit"), lights, solve


def _second_opinion(path: Path, picture: Any) -> str:
    """Whether another reader sees in the file what was read: `agreed`, `alone` or `disputed`.

    No reader can know of a bit that is turned in pixels without a checksum; but two that see
    different pixels in one file cannot both be right.
    """
    import numpy as np

    from lightpaint.images.formats.bitmap import read_bitmap
    from lightpaint.images.picture import file_kind

    try:
        reference = _read_elsewhere(path, file_kind(path))
    except Exception:
        return "alone"
    if reference.ndim == 2:
        reference = reference[..., None]
    if reference.size == 0:
        return "alone"
    reference = (
        reference[..., :3] if reference.shape[-1] >= 3 else reference[..., :1].repeat(3, axis=-1)
    )
    if picture.kind == "exr":
        pixels = np.where(picture.finite[..., None], picture.image, 0)
    else:
        pixels = read_bitmap(path, picture.kind).values
    if pixels.shape != reference.shape:
        return f"disputed: {pixels.shape} and {reference.shape}"
    if picture.codes is None:
        finite = np.isfinite(reference).all(axis=-1, keepdims=True)
        reference = np.where(finite, reference, 0)
        pixels = np.where(finite, pixels, 0)
    if picture.alpha is not None and picture.kind == "psd":
        # What is partly transparent is left out, since readers differ there.
        reference, pixels = (
            np.where(picture.alpha[..., None] > 0, v, 0) for v in (reference, pixels)
        )
    # Two builds of JPEG's library round apart.
    tolerance = 3 if picture.lossy else 1e-6 * np.abs(reference).max()
    with np.errstate(all="ignore"):
        miss = np.abs(pixels.astype(float) - reference.astype(float)).max()
    return "agreed" if miss <= tolerance else f"disputed by {miss:g}"


def _read_elsewhere(path: Path, kind: str) -> Any:
    """Pixels by a reader that is not ours, (h, w) or (h, w, n)."""
    import numpy as np

    if kind == "exr":
        import OpenImageIO

        file = OpenImageIO.ImageInput.open(str(path))
        spec = file.spec()
        if "uint" in map(str, [spec.format, *spec.channelformats]):
            raise ValueError("integers, which it scales to be between 0 and 1")
        order = [list(spec.channelnames).index(c) for c in "RGB"]
        stored = file.read_image(0, 0, 0, spec.nchannels, OpenImageIO.FLOAT)[..., order]
        canvas = np.zeros((spec.full_height, spec.full_width, 3), np.float32)
        y, x = spec.y - spec.full_y, spec.x - spec.full_x
        for row in range(stored.shape[0]):
            for column in range(stored.shape[1]):
                if 0 <= y + row < canvas.shape[0] and 0 <= x + column < canvas.shape[1]:
                    canvas[y + row, x + column] = stored[row, column]
        return canvas
    if kind == "tiff":
        import tifffile

        with tifffile.TiffFile(path) as file:
            return file.pages[0].asarray()
    if kind == "psd":
        head = struct.unpack(">HIIH", path.read_bytes()[12:24])
        channels, height, width, depth = head
        stored = np.frombuffer(path.read_bytes(), ">u2")
        if depth == 16 and path.read_bytes()[-channels * height * width * 2 - 2 :][:2] == b"\0\0":
            return np.moveaxis(
                stored[-channels * height * width :].reshape(channels, height, -1), 0, -1
            )
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)
