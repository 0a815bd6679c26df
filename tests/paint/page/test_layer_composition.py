"""The page composes layers as the session does, to the bit."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from layered_sessions import random_gradient, random_mask, random_surfaces
from nightly import seeds

from lightpaint.paint.layers.composed_layers import accents
from lightpaint.paint.layers.composition import ShownLayer, compose, with_effect
from lightpaint.paint.layers.layer_pixels import LayerPixels
from lightpaint.paint.layers.layer_stack import Layer, LayerKind, LayerStack
from lightpaint.paint.store.history_steps import Pixels

#: More than one tile in both directions.
H, W = 70, 90
WHOLE = (0, H, 0, W)

COMPOSE = """async ([layers, accents, region]) => {
  const { LayerPicture } = await import('/engine/layers/layer_picture.js');
  const { LayerPixels } = await import('/engine/layers/layer_pixels.js');
  const { shownLayers } = await import('/engine/layers/layer_list.js');
  const { PaintCanvas } = await import('/engine/paint_canvas.js');
  const { array } = await import('/bench.js');
  const ground = (await array('ground')).data;
  const [h, w] = (await array('ground')).shape;
  const painting = new PaintCanvas([h, w], new Uint16Array(3 * h * w));
  painting.albedo = (await array('albedo')).data;
  const picture = new LayerPicture(painting);
  for (const layer of layers) {
    if (layer.kind === 'group') continue;
    const coverage = (await array(`coverage/${layer.id}`)).data;
    const image = layer.kind === 'paint' || layer.kind === 'pixels'
      ? (await array(`image/${layer.id}`)).data : null;
    if (layer.id === 0) { painting.image.set(image); painting.importance.set(coverage); continue; }
    const pixels = new LayerPixels([h, w], image !== null);
    pixels.put([0, h, 0, w], { image, coverage });
    picture.pixels.set(layer.id, pixels);
  }
  const by = new Map(Object.entries(accents).map(([id, accent]) => [Number(id), accent]));
  picture.show(shownLayers(layers, by), layers);
  picture.ground = ground;
  picture.complete();
  picture.compose(region);
  return [[...picture.image], [...picture.importance]];
}"""


def random_layers(rng: np.random.Generator) -> LayerStack:
    """A painting and seven layers, of which some are hidden, weak, grouped or count more."""
    layers = [Layer(0, "pixels", "Painting", strength=float(rng.choice([1, 1, 0.4])))]
    for k in range(1, 7):
        kind: LayerKind = ("paint", "adjust", "weigh", "gradient")[int(rng.integers(4))]
        layers.append(
            Layer(
                k,
                kind,
                is_visible=bool(rng.random() < 0.8),
                strength=float(rng.choice([1.0, rng.uniform(0, 2)])),
                importance=float(rng.choice([1.0, 3.0])),
                group=7 if rng.random() < 0.3 else None,
                gain=float(2 ** rng.uniform(-3, 3)),
                tint=(float(rng.uniform(0.7, 1.4)), 1.0, float(rng.uniform(0.7, 1.4))),
                times=float(rng.choice([0.3, 4.0])),
                gradient=random_gradient(rng, (H, W)) if kind == "gradient" else None,
            )
        )
    group = Layer(7, "group", strength=0.7, importance=2.0)
    return LayerStack.of([*rng.permutation(np.array(layers, object)), group])  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", seeds(2, 6))
def test_the_page_draws_the_bits_of_the_session(page: Any, site: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    present = rng.uniform(0, 2, (H, W, 3)).astype(np.float32)
    present[:5, :5] = 0  # nothing to scale
    stack = random_layers(rng)
    pixels = {layer.id: LayerPixels((H, W)) for layer in stack}
    site.arrays["ground"] = present
    for layer in stack:
        if layer.kind == "group":
            continue
        image = rng.uniform(0, 3, (H, W, 3)).astype(np.float32)
        pixels[layer.id].put(WHOLE, Pixels(image, random_mask(rng, (H, W))))
        kept = pixels[layer.id].part(WHOLE)
        site.arrays[f"image/{layer.id}"] = kept.image
        site.arrays[f"coverage/{layer.id}"] = kept.importance
    albedo = random_surfaces(rng, (H, W)).albedo.astype(np.float16)
    site.arrays["albedo"] = albedo
    pairs = [
        with_effect(layer, pixels[layer.id], lambda: albedo.astype(np.float32))
        for layer in stack.shown()
    ]
    by = accents(pairs)
    shown = [ShownLayer(*pair, accent) for pair, accent in zip(pairs, by, strict=True)]
    expected = compose(shown, present, WHOLE)
    accent_of = {str(layer.id): accent for (layer, _), accent in zip(pairs, by, strict=True)}
    given = [[asdict(layer) for layer in stack], accent_of, [3, 66, 10, 80]]
    image, importance = page.evaluate(COMPOSE, given)
    np.testing.assert_array_equal(np.float32(image).reshape(H, W, 3), expected.image)
    np.testing.assert_array_equal(np.float32(importance).reshape(H, W), expected.importance)
