#!/usr/bin/env bash
# pygdtf 1.4.5 (pygdtf==1.4.5).
#
# A bar of two cells in GDTF refers twice to a geometry `Cell`, which holds a beam `Lens`. A channel
# of `Cell` becomes two channels, one at each reference. One expects the same of a channel of `Lens`,
# which is part of each cell. It is gone: the mode has no channel, and nothing says so.
#
# Output seen:
#   channel of Cell: [('Cell 1', [1]), ('Cell 2', [2])]
#   channel of Lens: []
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pygdtf==1.4.5
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import zipfile

import pygdtf

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<GDTF DataVersion="1.2"><FixtureType Name="Bar" ShortName="Bar" LongName="Bar" Manufacturer="None"
 Description="" FixtureTypeID="00000000-0000-0000-0000-000000000001">
<AttributeDefinitions>
<FeatureGroups><FeatureGroup Name="Dimmer" Pretty="Dimmer"><Feature Name="Dimmer"/></FeatureGroup>
</FeatureGroups>
<Attributes><Attribute Name="Dimmer" Pretty="Dim" Feature="Dimmer.Dimmer"/></Attributes>
</AttributeDefinitions>
<Geometries>
<Geometry Name="Body">
<GeometryReference Name="Cell 1" Geometry="Cell"><Break DMXBreak="1" DMXOffset="1"/>
</GeometryReference>
<GeometryReference Name="Cell 2" Geometry="Cell"><Break DMXBreak="1" DMXOffset="2"/>
</GeometryReference>
</Geometry>
<Geometry Name="Cell"><Beam Name="Lens"/></Geometry>
</Geometries>
<DMXModes><DMXMode Name="Mode" Geometry="Body"><DMXChannels>
<DMXChannel DMXBreak="1" Offset="1" Geometry="GEOMETRY"
 InitialFunction="GEOMETRY_Dimmer.Dimmer.Dimmer 1">
<LogicalChannel Attribute="Dimmer">
<ChannelFunction Name="Dimmer 1" Attribute="Dimmer" Default="0/1" DMXFrom="0/1"/>
</LogicalChannel></DMXChannel>
</DMXChannels></DMXMode></DMXModes>
</FixtureType></GDTF>"""

found = []
for geometry in ("Cell", "Lens"):
    with zipfile.ZipFile("bar.gdtf", "w") as archive:
        archive.writestr("description.xml", DESCRIPTION.replace("GEOMETRY", geometry))
    [mode] = pygdtf.FixtureType("bar.gdtf").dmx_modes
    found.append([(str(x.geometry), x.offset) for x in mode.dmx_channels])
    print(f"channel of {geometry}: {found[-1]}")
sys.exit(found != [[("Cell 1", [1]), ("Cell 2", [2])], []])
PYTHON
