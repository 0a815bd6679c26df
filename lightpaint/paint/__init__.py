"""Paint light, and see the answer while the brush moves."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.paint.launch import paint_in_browser as paint_in_browser
    from lightpaint.paint.server.address import Reach as Reach
    from lightpaint.paint.server.page_server import Server as Server
    from lightpaint.paint.server.page_server import check_installed as check_installed
    from lightpaint.paint.store.database import SESSION_FILE as SESSION_FILE
    from lightpaint.paint.store.session_requests import DEFAULT_NEAR as DEFAULT_NEAR
    from lightpaint.paint.store.session_requests import SessionRequests as SessionRequests
    from lightpaint.paint.store.stored_arrays import read_kept_looks as read_kept_looks
    from lightpaint.paint.studio.console_switch import Console as Console
    from lightpaint.paint.subject import Subject as Subject
    from lightpaint.paint.subject import places_path as places_path
    from lightpaint.paint.subject_factory import make_subjects as make_subjects

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
