"""Better places of lights, and new lights: the search, and its results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.placement.applied_rigging import (
        check_rigging, freedom_on, freedoms_of, rigged_lights, surfaces_of,
    )
    from lightpaint.placement.freedom import Freedom
    from lightpaint.placement.light_changes import (
        HARDLY_VISIBLE, TO_END, AddedLight, Move, Placement, PlacementRecord, read_placement,
        record_of,
    )
    from lightpaint.placement.lights_to_place import free_light, why_not_searched
    from lightpaint.placement.look_goals import on_small_film
    from lightpaint.placement.new_lights import NewLights
    from lightpaint.placement.paths.frozen_paths import FrozenPaths, PathSums
    from lightpaint.placement.paths.panel_lights import PanelSite, is_panel, panel_site
    from lightpaint.placement.place_search import (
        check_suggestible, place, place_rigged, suggest_lights,
    )
    from lightpaint.placement.rigging import LIGHT_KINDS, Rigging, rigging_of
    from lightpaint.placement.search.new_light_search import SearchSize, usual_pace
    from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
