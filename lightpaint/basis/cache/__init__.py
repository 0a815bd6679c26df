"""The cache: bases, denoised planes and facts about scenes from earlier runs."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.basis.cache.basis_cache import PARTS as PARTS
    from lightpaint.basis.cache.basis_cache import Entry as Entry
    from lightpaint.basis.cache.basis_cache import delete_orphans as delete_orphans
    from lightpaint.basis.cache.basis_cache import folder as folder
    from lightpaint.basis.cache.basis_cache import is_trusted_owner as is_trusted_owner
    from lightpaint.basis.cache.basis_cache import write_from_cache as write_from_cache
    from lightpaint.basis.cache.cached_render import Render as Render
    from lightpaint.basis.cache.cached_render import check_same_view as check_same_view
    from lightpaint.basis.cache.cached_render import obtain_basis as obtain_basis
    from lightpaint.basis.cache.cached_render import top_up_basis as top_up_basis
    from lightpaint.basis.cache.opening import find_opening as find_opening
    from lightpaint.basis.cache.opening import keep_opening as keep_opening
    from lightpaint.basis.cache.opening import open_kept as open_kept
    from lightpaint.basis.cache.scene_facts import SceneFacts as SceneFacts

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
