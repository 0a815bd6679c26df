"""Paint light, and see the answer while the brush moves."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.paint.launch import paint_in_browser
    from lightpaint.paint.server.address import Reach
    from lightpaint.paint.server.page_server import Server, check_installed
    from lightpaint.paint.store.database import SESSION_FILE
    from lightpaint.paint.store.session_requests import DEFAULT_NEAR, SessionRequests
    from lightpaint.paint.store.stored_arrays import read_kept_looks
    from lightpaint.paint.studio.console_switch import Console
    from lightpaint.paint.subject import Subject, places_path
    from lightpaint.paint.subject_factory import make_subjects

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
