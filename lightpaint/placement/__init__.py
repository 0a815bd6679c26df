"""Better places of lights, and new lights: the search, and its results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.placement.applied_rigging import check_rigging as check_rigging
    from lightpaint.placement.applied_rigging import freedom_on as freedom_on
    from lightpaint.placement.applied_rigging import freedoms_of as freedoms_of
    from lightpaint.placement.applied_rigging import rigged_lights as rigged_lights
    from lightpaint.placement.applied_rigging import surfaces_of as surfaces_of
    from lightpaint.placement.freedom import Freedom as Freedom
    from lightpaint.placement.light_changes import HARDLY_VISIBLE as HARDLY_VISIBLE
    from lightpaint.placement.light_changes import TO_END as TO_END
    from lightpaint.placement.light_changes import AddedLight as AddedLight
    from lightpaint.placement.light_changes import Move as Move
    from lightpaint.placement.light_changes import Placement as Placement
    from lightpaint.placement.light_changes import PlacementRecord as PlacementRecord
    from lightpaint.placement.light_changes import read_placement as read_placement
    from lightpaint.placement.light_changes import record_of as record_of
    from lightpaint.placement.lights_to_place import free_light as free_light
    from lightpaint.placement.lights_to_place import why_not_searched as why_not_searched
    from lightpaint.placement.look_goals import on_small_film as on_small_film
    from lightpaint.placement.new_lights import NewLights as NewLights
    from lightpaint.placement.paths.frozen_paths import FrozenPaths as FrozenPaths
    from lightpaint.placement.paths.frozen_paths import PathSums as PathSums
    from lightpaint.placement.paths.panel_lights import PanelSite as PanelSite
    from lightpaint.placement.paths.panel_lights import is_panel as is_panel
    from lightpaint.placement.paths.panel_lights import panel_site as panel_site
    from lightpaint.placement.place_search import check_suggestible as check_suggestible
    from lightpaint.placement.place_search import place as place
    from lightpaint.placement.place_search import suggest_lights as suggest_lights
    from lightpaint.placement.rigging import LIGHT_KINDS as LIGHT_KINDS
    from lightpaint.placement.rigging import Rigging as Rigging
    from lightpaint.placement.rigging import rigging_of as rigging_of
    from lightpaint.placement.search.new_light_search import SearchSize as SearchSize
    from lightpaint.placement.search.new_light_search import usual_pace as usual_pace
    from lightpaint.placement.suggestion import MoveSuggestion as MoveSuggestion
    from lightpaint.placement.suggestion import Suggestion as Suggestion

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
