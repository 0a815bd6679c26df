#!/usr/bin/env bash
# mitsuba 3.9.1, variant llvm_ad_rgb with LLVM 23.1 (karellen-llvm-core 23.1.4.post8), Linux x86-64.
#
# Surfaces of a furnace, a sphere of radiance 1 that shines inwards (`flip_normals`), have the
# irradiance π. One expects `pdf_emitter_direction` to be the density that
# `sample_emitter_direction` returns with a sample: the weights of multiple importance sampling need
# both. For points on the sphere it is not always: rounding puts some of them outside by a bit, for
# which the sample has a tolerance, while the density becomes that of a cone. Each way to sample
# gives π by itself. Together, as in `path`, they give .06 % too much, at every bounce.
#
# Output seen (the share of samples whose two densities differ by more than 1 %; irradiance over π
# by samples of the emitter, by samples of the surface, by both):
#   llvm_ad_rgb  0.0087  1.00000 1.00000 1.0006
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6 \
  karellen-llvm-core==23.1.4.post8
DRJIT_LIBLLVM_PATH=$(find "$folder/venv" -name "libLLVM*.so*" | sort | head -n 1)
export DRJIT_LIBLLVM_PATH
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

COUNT = 1 << 20

mi.set_variant("llvm_ad_rgb")
sphere = {"type": "sphere", "radius": 5.0, "flip_normals": True}
light = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
scene = mi.load_dict({"type": "scene", "sphere": {**sphere, "light": light}})
rng = mi.PCG32(size=COUNT)


def numbers():
    return mi.Point2f(rng.next_float32(), rng.next_float32())


def weight(own, other):
    return dr.select(own > 0, own * own / (own * own + other * other), 0)


def mean(values):
    return float(np.mean(np.array(values, np.float64)))


def estimates():
    """The share that differs, and irradiance over pi by the emitter, the surface, and both."""
    inside = mi.Ray3f(mi.Point3f(0.3, 0, 0), mi.warp.square_to_uniform_sphere(numbers()))
    point = scene.ray_intersect(inside)
    # Samples of the emitter.
    sample, radiance = scene.sample_emitter_direction(point, numbers())
    cosine = dr.abs(dr.dot(sample.d, point.n))
    by_emitter = radiance.x * cosine / dr.pi
    said = scene.pdf_emitter_direction(point, sample)
    differ = np.abs(np.array(said / sample.pdf) - 1) > 0.01
    # Samples of the surface, of density cosine / pi.
    direction = mi.warp.square_to_cosine_hemisphere(numbers())
    hit = scene.ray_intersect(point.spawn_ray(point.to_world(direction)))
    by_surface = hit.emitter(scene).eval(hit).x
    density = scene.pdf_emitter_direction(point, mi.DirectionSample3f(scene, hit, point))
    both = by_emitter * weight(sample.pdf, cosine / dr.pi)
    both += by_surface * weight(direction.z / dr.pi, density)
    return [mean(x) for x in (differ, by_emitter, by_surface, both)]


# With 16 million samples the last has a standard error of .0001.
differ, by_emitter, by_surface, both = np.mean([estimates() for _ in range(16)], axis=0)
print(f"llvm_ad_rgb  {differ:.4f}  {by_emitter:.5f} {by_surface:.5f} {both:.4f}")
alone = max(abs(by_emitter - 1), abs(by_surface - 1))
sys.exit(0 if differ > 0.002 and alone < 1e-5 and both > 1.0003 else 1)
PYTHON
