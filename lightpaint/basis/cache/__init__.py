"""The cache: bases, denoised planes and facts about scenes from earlier runs."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.basis.cache.basis_cache import (
        PARTS, Entry, delete_orphans, folder, is_trusted_owner, write_from_cache,
    )
    from lightpaint.basis.cache.cached_render import (
        Render, check_same_view, obtain_basis, top_up_basis,
    )
    from lightpaint.basis.cache.opening import find_opening, keep_opening, open_kept
    from lightpaint.basis.cache.scene_facts import SceneFacts
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
