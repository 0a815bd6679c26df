"""A list of cues for consoles: a row for each channel of each look."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lightpaint.arrays import Position
from lightpaint.dmx.console_rig import ConsoleRig, DmxChannel, RigFixture
from lightpaint.dmx.levels import encode_levels
from lightpaint.dmx.pan_tilt import aimed_rig
from lightpaint.dmx.rig_drives import RigDrives, check_drives
from lightpaint.relit.export.exports import plain_cell
from lightpaint.relit.export.level_table import channel_level, light_channels

#: The full level of a channel, whatever its bytes.
FULL = 65535

COLUMNS = ("cue", "label", "fade", "fixture", "channel", "value")


@dataclass(frozen=True)
class Cue:
    """A look with a name.

    fade_s: seconds to get there. directions: where its lights point, by name, if pan and tilt are
    to follow.
    """

    label: str
    fade_s: float
    drives: RigDrives
    directions: Mapping[str, Position] | None = None


def cue_list_csv(rig: ConsoleRig, cues: Sequence[Cue]) -> str:
    """Return a table of cues, counted from 1, with all channels that give light, and with pan and
    tilt of cues that have directions.

    A fixture goes by its id, or by its name if it has none; a channel by its attribute, after its
    geometry where a fixture has several. Values are 0 to 65535, whatever bytes a channel has.
    Raises RigError for drives that do not fit the rig.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    aimed = rig
    for number, cue in enumerate(cues, start=1):
        check_drives(rig, cue.drives)
        if cue.directions is not None:
            # From one cue to the next heads go the shortest way.
            aimed, _ = aimed_rig(aimed, cue.directions)
        levels = encode_levels(aimed, cue.drives)
        for fixture in aimed.fixtures:
            names = _channel_names(fixture)
            for channel in _set_channels(fixture):
                level = channel_level(fixture, channel, levels)
                value = round(level / channel.highest * FULL)
                words = (cue.label, fixture.fixture_id or fixture.name, names[channel])
                label, name, attribute = map(plain_cell, words)
                table.writerow((number, label, f"{cue.fade_s:g}", name, attribute, value))
    return text.getvalue()


def _set_channels(fixture: RigFixture) -> list[DmxChannel]:
    """Return the channels that a fixture's lights set, and axes that are aimed, in order."""
    used = {k for light in fixture.lights for _, k in light_channels(light)}
    if fixture.is_aimed:
        used |= {axis.channel for head in fixture.heads for axis in head.axes}
    return [fixture.channels[k] for k in sorted(used)]


def _channel_names(fixture: RigFixture) -> dict[DmxChannel, str]:
    counts = Counter(channel.attribute for channel in fixture.channels)
    return {
        channel: channel.attribute
        if counts[channel.attribute] == 1
        else f"{channel.geometry}.{channel.attribute}"
        for channel in fixture.channels
    }
