"""Reads the picture of a mixer from its canvas."""

from typing import Any

import numpy as np

READ = """async (selector) => {
  for (let k = 0; k < 3; k++) await new Promise(requestAnimationFrame)
  const canvas = document.querySelector(selector)
  const { width, height } = canvas
  const data = canvas.getContext('2d').getImageData(0, 0, width, height).data
  return [height, width, [...data]]
}"""


def mixer_pixels(page: Any, selector: str = ".mixer-mix") -> Any:
    """Return the codes truly on the canvas of the mix, (h, w, 3). page: or a frame in one."""
    h, w, flat = page.evaluate(READ, selector)
    return np.array(flat, np.int16).reshape(h, w, 4)[..., :3]
