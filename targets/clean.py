"""Clean pictures of a scene, and what its surfaces are like: what is painted over here.

    python targets/clean.py scenes/gallery/scene.xml -o targets/gallery/template.exr

renders the current look, as the sum of what each light does, takes its noise away with Open Image
Denoise (`pip install pyoidn`) and writes it as R, G, B of an EXR, with the layers `albedo`,
`normal` and `position` (metres).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

import lightpaint as lp
from lightpaint.scene.runtime.variant import use_variant

Floats = NDArray[np.float32]
LAYERS = {"albedo": "RGB", "normal": "XYZ", "position": "XYZ"}


@dataclass(frozen=True)
class Surfaces:
    """What the pixels of a picture see: albedo, unit normal, and position in metres.

    Each is (h, w, 3) float32.
    """

    albedo: Floats
    normal: Floats
    position: Floats

    @classmethod
    def read(cls, path: str | Path) -> Surfaces:
        """The layers beside a template that this module wrote."""
        channels = OpenEXR.File(str(path), separate_channels=True).channels()
        return cls(
            *(
                np.stack([channels[f"{layer}.{c}"].pixels for c in names], axis=-1)
                for layer, names in LAYERS.items()
            )
        )

    def at_edges(self, *, shortest: float = 0.97) -> Surfaces:
        """The same, with one surface in every pixel: at a silhouette, that of a neighbour.

        Such a pixel has the mean of two surfaces, a place in the air where nothing is; its normal
        is shorter than `shortest`. The neighbour with the nearest albedo gives place and normal.
        """
        is_whole = np.linalg.norm(self.normal, axis=-1) >= shortest
        position, normal = self.position.copy(), self.normal.copy()
        best = np.full(is_whole.shape, np.inf)
        padded = [
            np.pad(layer, [(1, 1), (1, 1)] + [(0, 0)] * (layer.ndim - 2), mode="edge")
            for layer in (is_whole, self.albedo, self.position, self.normal)
        ]
        height, width = is_whole.shape
        for dy, dx in ((0, 1), (1, 0), (1, 2), (2, 1), (0, 0), (0, 2), (2, 0), (2, 2)):
            whole, albedo, place, facing = (
                layer[dy : dy + height, dx : dx + width] for layer in padded
            )
            distance = np.where(whole, np.abs(albedo - self.albedo).sum(axis=-1), np.inf)
            nearer = ~is_whole & (distance < best)
            position[nearer], normal[nearer] = place[nearer], facing[nearer]
            best = np.where(nearer, distance, best)
        return Surfaces(self.albedo, normal, position)

    @property
    def layers(self) -> dict[str, Floats]:
        """By the name that each has in a file."""
        return {name: getattr(self, name) for name in LAYERS}


def see(
    scene: str | Path, *, size: tuple[int, int], sensor: str | None = None, spp: int = 64
) -> Surfaces:
    """The surfaces of a scene. size: (width, height); sensor: its id, or None for the first."""
    use_variant()
    import mitsuba as mi

    loaded: Any = mi.load_file(str(scene), width=str(size[0]), height=str(size[1]))
    cameras = {camera.id(): camera for camera in loaded.sensors()}
    camera = cameras[sensor] if sensor else loaded.sensors()[0]
    layers = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal,position:position"}
    seen = np.array(mi.render(loaded, sensor=camera, integrator=mi.load_dict(layers), spp=spp))
    return Surfaces(*(part.astype(np.float32) for part in np.split(seen, 3, axis=-1)))


def denoise(look: Floats, surfaces: Surfaces) -> Floats:
    """The look, (h, w, 3) in linear light, without its noise."""
    import pyoidn

    clean: Floats = pyoidn.denoise(
        np.ascontiguousarray(look, np.float32),
        albedo=np.ascontiguousarray(np.clip(surfaces.albedo, 0, 1)),
        normal=np.ascontiguousarray(surfaces.normal),
        hdr=True,
        clean_aux=True,
    )
    return np.maximum(clean, 0)


def main() -> None:
    """Write the template that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("-s", "--sensor")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 360))
    parser.add_argument("--spp", type=int, default=96)
    asked = parser.parse_args()
    width, height = asked.size
    parameters = {"width": width, "height": height}
    scene = lp.load_scene(asked.scene, sensor=asked.sensor, parameters=parameters)
    basis = lp.render_basis(scene, spp=asked.spp)
    surfaces = see(asked.scene, size=(width, height), sensor=asked.sensor)
    channels = {"RGB": denoise(basis.mix(basis.current_weights), surfaces)}
    for layer, image in surfaces.layers.items():
        for k, name in enumerate(LAYERS[layer]):
            channels[f"{layer}.{name}"] = np.ascontiguousarray(image[..., k])
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(asked.output))


if __name__ == "__main__":
    main()
