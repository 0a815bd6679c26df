"""Rigs of fixtures, and the levels that a console sends them."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.dmx.console_link import PRIORITY, ConsoleLink, link_address
    from lightpaint.dmx.console_receiver import LOOPBACK, ConsoleReceiver
    from lightpaint.dmx.console_rig import (
        ConsoleRig, DmxChannel, RigFixture, RigLight, address_text,
    )
    from lightpaint.dmx.console_target import (
        PROTOCOLS, SACN, ConsoleTarget, network_universes, parse_target,
    )
    from lightpaint.dmx.levels import (
        RigDrives, check_drives, check_lamps, decode_levels, drives_of, encode_levels,
    )
    from lightpaint.dmx.mvr import (
        DESCRIPTION, KIND, MM, KindSummary, NamedFixture, Show, named_fixtures, read_rig, read_show,
        show_nodes,
    )
    from lightpaint.dmx.pan_tilt import aimed_rig, directions_of
    from lightpaint.dmx.rig_scene import (
        Room, RoomFiles, cd_per_unit, lights_of, lights_text, room_of_scene, room_of_show,
        scene_text, spectrum_tables,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
