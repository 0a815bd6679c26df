"""The visible difference of live answers from the paint, over the blocks of the films."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour import ViewTransform
from lightpaint.lighting.analysis.appearance.delivery import ViewPictures, have_wishes_come
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.live.live_sums import LayerWishes, SmallFilm
from lightpaint.target import Target

#: Approximate number of blocks that are compared.
COMPARED_BLOCKS = 2**10


@dataclass(frozen=True)
class LiveDifference:
    """The paint of live views as they are now, with which pictures of their films are compared.

    layers: the wishes of each. display: the view transform of the display. compared: of the fit;
    None in linear light.
    """

    films: Sequence[SmallFilm]
    layers: Sequence[LayerWishes]
    display: ViewTransform
    compared: ViewTransform | None

    @cached_property
    def _look(self) -> PaintComparison:
        painted, weight, marks = (
            np.concatenate(parts, axis=-1)
            for parts in zip(*(film.paint for film in self.films), strict=True)
        )
        painted, weight, marks = (x[..., self._chosen].T[None] for x in (painted, weight, marks))
        return PaintComparison(painted, marks, weight, 1, self.display, self.compared)

    @cached_property
    def _chosen(self) -> slice:
        """The blocks that are compared: painted ones are among them unless few are painted."""
        weight = np.concatenate([film.paint[1] for film in self.films])
        step = max(int((weight > 0).sum()) // COMPARED_BLOCKS, 1)
        return slice(None, None, step if weight[::step].any() else 1)

    @cached_property
    def now(self) -> float:
        """The mean ΔE of the current lights."""
        return self.of(np.concatenate([film.look for film in self.films], axis=1))

    def of(self, picture: Doubles) -> float:
        """Return the mean ΔE of a picture (3, p) of all films."""
        look = self._look
        return look.mean(look.difference(look.pixels(picture[:, self._chosen].T[None])))

    def have_wishes_come(self, picture: Doubles) -> bool:
        """Return whether three quarters came of each wish, in a picture (3, p) of all films."""
        views, first = [], 0
        for film, layers in zip(self.films, self.layers, strict=True):
            last = first + film.look.shape[1]
            views.append(_painted_view(film, layers, picture[:, first:last]))
            first = last
        return have_wishes_come(views, self.display)


def _painted_view(film: SmallFilm, layers: LayerWishes, picture: Doubles) -> ViewPictures:
    """Return a film as a view with a painting. picture: (3, p), of the answer."""
    size = film.size
    painted, weight, marks = film.paint

    def image(x: Doubles) -> Floats:
        return np.ascontiguousarray(x.T.reshape(*size, 3), np.float32)

    target = Target(
        "painting",
        image(painted),
        weight.reshape(size).astype(np.float32),
        everything=False,
        at_least=marks.T.reshape(*size, 3) if marks.any() else None,
        through_view=True,
        over_look=True,
        wishes=tuple(layers(film.side)),
    )
    return ViewPictures(target, film.has_emitters_alone, image(film.look), image(picture))
