"""Lights that a search moves, and their current poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lightpaint.arrays import Floats
from lightpaint.placement.free_light import FreeLight
from lightpaint.placement.new_lights import Mirror, NewLights
from lightpaint.placement.placement_fit import Fitted
from lightpaint.scene.properties.pose import Site


@dataclass(frozen=True)
class Movable:
    """A light, or a mirrored pair of lights, which move as one.

    columns: their indices among the columns of the fit. mirror: of the second; None for one light.
    group: group of new lights; None for an existing light.
    """

    light: FreeLight
    columns: tuple[int, ...]
    mirror: Mirror | None = None
    group: NewLights | None = None

    def sites(self, site: Site) -> list[Site]:
        """Return the place of each of its lights. site: of the first."""
        return [site] if self.mirror is None else [site, self.mirror.site(site)]


@dataclass(frozen=True)
class Arrangement:
    """Movables with their poses, and the best lighting for these."""

    movables: tuple[Movable, ...]
    sites: tuple[Site, ...]
    fitted: Fitted

    @property
    def missed(self) -> float:
        """The loss of the best lighting, with the pull of the constraints."""
        return self.fitted.missed

    def with_site(self, k: int, site: Site, fitted: Fitted) -> "Arrangement":
        """Return the arrangement with another pose of movable `k`."""
        return replace(self, sites=(*self.sites[:k], site, *self.sites[k + 1 :]), fitted=fitted)

    def with_movable(self, movable: Movable, site: Site, fitted: Fitted) -> "Arrangement":
        """Return the arrangement with another movable at the end."""
        return Arrangement((*self.movables, movable), (*self.sites, site), fitted)

    def without(self, k: int, fitted: Fitted) -> "Arrangement":
        """Return the arrangement without movable `k`."""
        return Arrangement(
            (*self.movables[:k], *self.movables[k + 1 :]),
            (*self.sites[:k], *self.sites[k + 1 :]),
            fitted,
        )


def all_sites(movables: Sequence[Movable], sites: Sequence[Site]) -> list[Site]:
    """Return the places of all lights of movables, in their order."""
    return [
        site
        for movable, site_of_movable in zip(movables, sites, strict=True)
        for site in movable.sites(site_of_movable)
    ]


def by_column(movables: Sequence[Movable], columns: Floats) -> Mapping[int, Floats]:
    """Return columns of all lights of movables, in their order, by their indices in the fit."""
    numbers = [k for movable in movables for k in movable.columns]
    return dict(zip(numbers, columns, strict=True))
