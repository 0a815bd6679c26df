"""A view of the painted scene, loaded, and the planes of its lights at any place."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.images.denoiser import Features
from lightpaint.paint.rig.cameras import in_this_thread
from lightpaint.paint.rig.quick_planes import QuickPlanes
from lightpaint.paint.subject import Subject
from lightpaint.scene.scene import Scene
from lightpaint.scene.surfaces import render_features


@dataclass(frozen=True)
class RigView:
    """A view of the loaded scene. features: of each pixel, with positions."""

    scene: Scene
    loaded: Any
    features: Features

    @cached_property
    def quick(self) -> QuickPlanes:
        """The quick planes, whose paths are traced on first use; that takes longer than to load."""
        with in_this_thread():
            return QuickPlanes(self.scene, self.loaded, self.features)

    @cached_property
    def seen_points(self) -> Floats:
        """The visible points of surfaces, (n, 3)."""
        assert self.features.position is not None
        return np.asarray(self.features.position[self.features.normal.any(axis=-1)])


def open_view(subject: Subject, basis: Basis) -> RigView:
    """Load the scene of a view."""
    scene = subject.loaded_scene
    loaded, features = scene.load(), basis.features
    if features is None or features.position is None:
        features = render_features(scene)
    return RigView(scene, loaded, features)
