"""Rigs of fixtures, and the levels that a console sends them."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.dmx.console_rig import ConsoleRig as ConsoleRig
    from lightpaint.dmx.console_rig import DmxChannel as DmxChannel
    from lightpaint.dmx.console_rig import RigFixture as RigFixture
    from lightpaint.dmx.console_rig import RigLight as RigLight
    from lightpaint.dmx.console_rig import address_text as address_text
    from lightpaint.dmx.levels import RigDrives as RigDrives
    from lightpaint.dmx.levels import check_drives as check_drives
    from lightpaint.dmx.levels import check_lamps as check_lamps
    from lightpaint.dmx.levels import decode_levels as decode_levels
    from lightpaint.dmx.levels import drives_of as drives_of
    from lightpaint.dmx.levels import encode_levels as encode_levels
    from lightpaint.dmx.mvr import DESCRIPTION as DESCRIPTION
    from lightpaint.dmx.mvr import KIND as KIND
    from lightpaint.dmx.mvr import MM as MM
    from lightpaint.dmx.mvr import KindSummary as KindSummary
    from lightpaint.dmx.mvr import NamedFixture as NamedFixture
    from lightpaint.dmx.mvr import Show as Show
    from lightpaint.dmx.mvr import named_fixtures as named_fixtures
    from lightpaint.dmx.mvr import read_rig as read_rig
    from lightpaint.dmx.mvr import read_show as read_show
    from lightpaint.dmx.mvr import show_nodes as show_nodes
    from lightpaint.dmx.network.console_link import PRIORITY as PRIORITY
    from lightpaint.dmx.network.console_link import ConsoleLink as ConsoleLink
    from lightpaint.dmx.network.console_link import link_address as link_address
    from lightpaint.dmx.network.console_receiver import LOOPBACK as LOOPBACK
    from lightpaint.dmx.network.console_receiver import ConsoleReceiver as ConsoleReceiver
    from lightpaint.dmx.network.console_target import PROTOCOLS as PROTOCOLS
    from lightpaint.dmx.network.console_target import SACN as SACN
    from lightpaint.dmx.network.console_target import ConsoleTarget as ConsoleTarget
    from lightpaint.dmx.network.console_target import network_universes as network_universes
    from lightpaint.dmx.network.console_target import parse_target as parse_target
    from lightpaint.dmx.pan_tilt import aimed_rig as aimed_rig
    from lightpaint.dmx.pan_tilt import directions_of as directions_of
    from lightpaint.dmx.rig_scene import Room as Room
    from lightpaint.dmx.rig_scene import RoomFiles as RoomFiles
    from lightpaint.dmx.rig_scene import cd_per_unit as cd_per_unit
    from lightpaint.dmx.rig_scene import lights_of as lights_of
    from lightpaint.dmx.rig_scene import lights_text as lights_text
    from lightpaint.dmx.rig_scene import room_of_scene as room_of_scene
    from lightpaint.dmx.rig_scene import room_of_show as room_of_show
    from lightpaint.dmx.rig_scene import scene_text as scene_text
    from lightpaint.dmx.rig_scene import spectrum_tables as spectrum_tables

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
