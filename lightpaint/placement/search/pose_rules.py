"""Rules for poses besides the freedom of each light: free space, distance, view."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.placement.movable import Movable
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.scene.properties.pose import Site


class PoseRules:
    """Rules about where lights may hang. paths: those of the search."""

    def __init__(self, paths: SearchPaths) -> None:
        self._paths = paths

    def permit(self, movables: Sequence[Movable], sites: Sequence[Site]) -> bool:
        """Return whether new lights are clear of surfaces, apart, and out of view if required."""
        for k, (movable, site) in enumerate(zip(movables, sites, strict=True)):
            group = movable.group
            if group is None or site.position is None:
                continue
            place = np.array([site.position])
            if movable.light.freedom.surfaces is None and not self._paths.clear(place).all():
                return False
            others = range(len(movables))
            rest = [j for j in others if j != k]
            if (
                group.apart
                and not self.keep_apart(
                    [movables[j] for j in rest], [sites[j] for j in rest], movable, place
                ).all()
            ):
                return False
            if _is_kept_out_of_view(movable) and self._in_view(site, place).any():
                return False
        return True

    def usable(self, movable: Movable, places: Floats) -> Bools:
        """Return which places, (k,), are free, see the picture, and are out of view if required."""
        clear = movable.light.freedom.clear
        # Lights on a surface keep the requested distance from it.
        is_usable = self._paths.usable(places, None if clear is None else 0.9 * clear)
        if _is_kept_out_of_view(movable):
            is_usable &= ~self._in_view(movable.light.site, places)
        return is_usable

    def _in_view(self, site: Site, places: Floats) -> Bools:
        """Return at which places, (k,), a light is seen; of a panel, what surrounds its centre."""
        around = np.zeros((1, 3))
        if isinstance(site, PanelSite):
            around = np.vstack([around, site.side / 2 * np.eye(3), -site.side / 2 * np.eye(3)])
        seen = self._paths.in_view((places[:, None] + around).reshape(-1, 3))
        return np.asarray(seen.reshape(len(places), -1).any(axis=1))

    def keep_apart(
        self,
        movables: Sequence[Movable],
        sites: Sequence[Site],
        movable: Movable,
        places: Floats,
    ) -> Bools:
        """Return which places, (k,), are far enough from the other new lights of its group."""
        is_apart = np.ones(len(places), dtype=bool)
        if movable.group is None or not movable.group.apart:
            return is_apart
        for other, site in zip(movables, sites, strict=True):
            if other.group == movable.group and site.position is not None:
                away = np.linalg.norm(places - np.array(site.position), axis=1)
                is_apart &= away >= movable.group.apart
        return is_apart


def _is_kept_out_of_view(movable: Movable) -> bool:
    group, is_panel = movable.group, isinstance(movable.light.site, PanelSite)
    return group is not None and group.is_kept_out_of_view(is_panel=is_panel)
