"""`lightpaint rig`, `send` and `listen`: the fixtures of a show as a scene, levels for a console,
and what arrives of them.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lightpaint import dmx
from lightpaint.cli.options.console_options import RigFile, Sending
from lightpaint.cli.output import documents, lines, terminal
from lightpaint.cli.output.lines import CommandOutcome, output_mode
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.display_text import some_names, some_of
from lightpaint.errors import ConsoleError, LightingError, OutputError, RigError
from lightpaint.files import check_files, check_writable, write_bytes, write_text
from lightpaint.lighting import Lighting, read_lighting
from lightpaint.relit import LevelRow, level_csv, level_document, level_json, level_rows
from lightpaint.scene.lights.lights_file import lights_file_beside
from lightpaint.sentences import Hint, Sentence
from lightpaint.signals import interruptible_between_pieces
from lightpaint.storage.staging import finish, staged

#: Seconds between two looks at the link.
POLL_S = 0.05

#: Suffixes of files for levels.
DUMP_SUFFIXES = (".csv", ".json")

#: Seconds between lines on the same subject, so that a fade can be read.
LINE_S = 0.2


def rig(
    *,
    show: Path,
    output: Path,
    room: Path | None,
    only_lights: bool,
    force: bool,
    gdtf_folder: Path | None,
    zoom: float | None,
    pixels: bool,
    usual_colors: bool,
    open_wheels: bool,
) -> CommandOutcome:
    """Run `lightpaint rig SHOW.mvr -o F.xml`."""
    if room is not None and only_lights:
        raise RigError("--only-lights leaves the room out: give --room, or --only-lights")
    content = dmx.read_show(
        show, gdtf_folder=gdtf_folder, zoom=zoom, pixels=pixels, usual_colors=usual_colors
    )
    folder, surroundings = output.parent, dmx.RoomFiles(dmx.Room(), {})
    if room is not None:
        surroundings = dmx.RoomFiles(dmx.room_of_scene(room, folder), {})
    elif not only_lights:
        surroundings = dmx.room_of_show(show, content.models)
    unit = dmx.cd_per_unit(content.rig)
    texts = {
        output: dmx.scene_text(content.rig, unit, None if only_lights else surroundings.room),
        lights_file_beside(output): dmx.lights_text(
            content.rig, unit, open_wheels=open_wheels, stem=output.stem
        ),
    }
    tables = dmx.spectrum_tables(content.rig, output.stem)
    texts |= {folder / name: text for name, text in tables.items()}
    files = [*texts, *(folder / name for name in surroundings.files)]
    _check(files, [show, *([] if room is None else [room])], folder, force=force)
    with staged(folder) as stage:
        for file, text in texts.items():
            write_text(stage / file.name, text)
        for name, data in surroundings.files.items():
            write_bytes(stage / name, data)
    _print(content, files)
    remarks = [*content.remarks, *surroundings.remarks]
    for remark in remarks:
        terminal.say(remark)
    return CommandOutcome(lambda: _document(show, files, content, unit, remarks))


def _check(files: list[Path], inputs: list[Path], folder: Path, *, force: bool) -> None:
    check_files(files, inputs)
    check_writable(folder)
    finish(folder)
    if not force and (existing_files := [file for file in files if file.exists()]):
        raise OutputError(
            f"{existing_files[0]} exists: name another file with -o, or pass ",
            Hint("force", True),
        )


def _print(show: dmx.Show, files: list[Path]) -> None:
    """Print a row for each type, with what is to know of it below, and the main files."""
    table = terminal.table("fixtures", "type", "mode", "emitters", "light from")
    for kind in show.kinds:
        emitters = ", ".join(kind.emitters) or "none"
        table.row(str(len(kind.fixtures)), kind.kind, kind.mode, emitters, kind.emission)
    terminal.print_table(table)
    for kind in show.kinds:
        for remark in kind.remarks:
            terminal.write(spoken(Sentence(f"{kind.kind}: ", remark)))
    count = len(dmx.lights_of(show.rig))
    universes = ", ".join(map(str, show.rig.universes))
    terminal.write(f"{count} {'lights' if count > 1 else 'light'}, universes {universes}")
    for file in files[:2]:
        terminal.write(str(file))


def _document(
    path: Path, files: list[Path], show: dmx.Show, unit: float, remarks: list[str]
) -> dict[str, Any]:
    """Return the document of `rig`."""
    fixtures = [
        {
            "id": fixture.fixture_id,
            "name": fixture.name,
            "type": fixture.kind,
            "mode": fixture.mode,
            "addresses": {str(k): dmx.address_text(x) for k, x in fixture.addresses.items()},
            "lights": [light.name for light in fixture.lights],
        }
        for fixture in show.rig.fixtures
    ]
    return documents.files_document(
        files[0].parent,
        files,
        rig=str(path),
        cd_per_unit=unit,
        types=[_kind(kind) for kind in show.kinds],
        fixtures=fixtures,
        remarks=[spoken(x) for x in remarks],
    )


def _kind(kind: dmx.KindSummary) -> dict[str, Any]:
    fields = {("type" if key == "kind" else key): value for key, value in vars(kind).items()}
    return {**fields, "remarks": [spoken(x) for x in kind.remarks]}


def read_rig_file(rig: RigFile) -> dmx.ConsoleRig:
    """Return a rig. Raises RigError for anything else than an MVR with fixtures."""
    from lightpaint.dmx import read_rig

    # The colours of lights are as in the scene and its lights file.
    return read_rig(rig.path, gdtf_folder=rig.gdtf, pixels=rig.pixels, usual_colors=True)


def read_answer(path: Path) -> tuple[Lighting, dmx.RigDrives]:
    """Return a lighting and its drives. Raises LightingError if none of its lights has
    emitters."""
    finish(path.parent)
    lighting = read_lighting(path)
    drives = dmx.drives_of(lighting)
    if not drives:
        raise LightingError(
            f"{path} has no drives: none of its lights has emitters, as in a scene that was "
            "made from a rig"
        )
    return lighting, drives


def send(
    *, lighting: Path, rig: RigFile, sending: Sending, dump: Path | None, force: bool
) -> CommandOutcome:
    """Run `lightpaint send lighting.json --rig show.mvr --to TARGET`."""
    if dump is not None:
        _check_dump(dump, [lighting, rig.path], force=force)
    (answer, drives), fixtures = read_answer(lighting), read_rig_file(rig)
    dmx.check_drives(fixtures, drives)
    if sending.positions:
        fixtures, remarks = dmx.aimed_rig(fixtures, dmx.directions_of(answer))
        for remark in remarks:
            terminal.say(remark)
    universes = _universes_of(fixtures, sending)
    if dark := [light for light in fixtures.owners if light not in drives]:
        terminal.say(f"{lighting} has no drives for {some_names(dark)}, which stay dark")
    if sending.target is not None:
        with _link(fixtures, sending) as link:
            if dump is not None:
                _write_dump(dump, fixtures, drives, universes)
            _announce(f"sending to {link.address}{_how_to_end(sending)}")
            _send(link, drives, sending)
    elif dump is not None:
        _write_dump(dump, fixtures, drives, universes)
    else:
        _print_rows(level_rows(fixtures, drives, universes))
        terminal.say("nothing is sent without --to, such as --to sacn://127.0.0.1")
    where = {"target": None if sending.target is None else str(sending.target)}
    return CommandOutcome(lambda: where | level_document(fixtures, drives, universes))


def _universes_of(rig: dmx.ConsoleRig, sending: Sending) -> dict[int, int]:
    """Return the universes of the network by the universes of the rig; without a target the
    universes of sACN."""
    protocol = dmx.PROTOCOLS["sacn"] if sending.target is None else sending.target.protocol
    return dmx.network_universes(rig, protocol, sending.universes)


def _check_dump(dump: Path, inputs: list[Path], *, force: bool) -> None:
    if dump.suffix.lower() not in DUMP_SUFFIXES:
        raise OutputError(f"--dump {dump}: expected a file {' or '.join(DUMP_SUFFIXES)}")
    check_files([dump], inputs)
    check_writable(dump.parent)
    if dump.exists() and not force:
        raise OutputError(f"{dump} exists: name another file, or pass --force")


def _write_dump(
    dump: Path, rig: dmx.ConsoleRig, drives: dmx.RigDrives, universes: Mapping[int, int]
) -> None:
    is_csv = dump.suffix.lower() == ".csv"
    text = (
        level_csv(level_rows(rig, drives, universes))
        if is_csv
        else level_json(rig, drives, universes)
    )
    write_text(dump, text)
    terminal.write(str(dump))


def _print_rows(rows: list[LevelRow]) -> None:
    table = terminal.table("id", "fixture", "light", "emitter", "drive", "channel", "value")
    for row in rows:
        channels = "+".join(map(str, row.channels))
        drive = "" if row.drive is None else f"{row.drive:.3f}"
        where = ("", "") if row.value is None else (f"{row.universe}.{channels}", str(row.value))
        table.row(row.fixture_id, row.fixture, row.light, row.emitter, drive, *where)
    terminal.print_table(table)


@contextmanager
def _link(rig: dmx.ConsoleRig, sending: Sending) -> Iterator[dmx.ConsoleLink]:
    """Yield an open link, and end it whole: an interrupt waits until its last packet has left."""
    assert sending.target is not None
    link = dmx.ConsoleLink.open(
        *(sending.target, rig),
        universes=sending.universes,
        priority=dmx.PRIORITY if sending.priority is None else sending.priority,
        fps=sending.fps,
        interface=sending.interface,
    )
    try:
        yield link
    finally:
        with interruptible_between_pieces():
            link.close(blackout=sending.blackout)


def _how_to_end(sending: Sending) -> str:
    return " (Ctrl-C ends it)" if sending.until == "ctrl-c" else ""


def _send(link: dmx.ConsoleLink, drives: dmx.RigDrives, sending: Sending) -> None:
    """Show drives until the end. Raises ConsoleError if the network takes no packet."""
    end_s = time.monotonic() + sending.until if isinstance(sending.until, float) else None
    had_trouble = False
    try:
        link.show(drives, fade_s=sending.fade_s)
        while end_s is None or time.monotonic() < end_s:
            time.sleep(POLL_S)
            trouble = link.trouble
            if trouble is not None and not link.has_sent:
                raise ConsoleError(trouble)
            if (trouble is not None) != had_trouble:
                had_trouble = trouble is not None
                terminal.say(f"{trouble}; trying again" if trouble else "sending again")
            if sending.until == "done" and link.is_settled:
                break
    except KeyboardInterrupt:
        if sending.until != "ctrl-c":
            raise
    if link.trouble is not None:
        raise ConsoleError(link.trouble)


def _announce(text: str) -> None:
    """Print what happens now: on stderr if stdout is a document for programs."""
    if not output_mode().as_json:
        terminal.write(text)
    elif output_mode().json_progress:
        lines.err_json({"remark": text})
    else:
        lines.err(text)


def listen(
    *,
    rig: RigFile | None,
    protocol: str,
    universes: dict[int, int],
    address: str | None,
    port: int | None,
    seconds: float | None,
) -> CommandOutcome:
    """Run `lightpaint listen --rig show.mvr`."""
    fixtures = None if rig is None else read_rig_file(rig)
    if fixtures is None and universes:
        raise ConsoleError("--universe belongs to the universes of a rig: give --rig, too")
    known = dmx.PROTOCOLS[protocol]
    numbers = {} if fixtures is None else dmx.network_universes(fixtures, known, universes)
    at = address or dmx.LOOPBACK
    with dmx.ConsoleReceiver.open(
        known, address=at, port=port, groups=numbers.values()
    ) as receiver:
        monitor = ConsoleMonitor(receiver, fixtures, numbers)
        how = " (Ctrl-C ends it)" if seconds is None else ""
        _announce(f"listening for {known.name} at {at}, port {receiver.port}{how}")
        end_s = None if seconds is None else time.monotonic() + seconds
        try:
            while end_s is None or time.monotonic() < end_s:
                left_s = LINE_S if end_s is None else min(LINE_S, end_s - time.monotonic())
                receiver.receive(left_s)
                monitor.print_changes()
        except KeyboardInterrupt:
            if seconds is not None:
                raise
        monitor.print_changes(at_once=True)
        if not receiver.levels:
            terminal.say(f"nothing arrived at {at}, port {receiver.port}")
        return CommandOutcome(monitor.document)


class ConsoleMonitor:
    """The contents of a receiver, printed as they change.

    universes: of the network, by the universes of the rig. Without a rig it shows channels.
    """

    def __init__(
        self,
        receiver: dmx.ConsoleReceiver,
        rig: dmx.ConsoleRig | None,
        universes: Mapping[int, int],
    ) -> None:
        self._receiver, self._rig, self._universes = receiver, rig, universes
        self._printed: dict[str, str] = {}
        self._printed_s = -LINE_S

    def print_changes(self, *, at_once: bool = False) -> None:
        """Print what is not as it was printed, unless the last lines are too recent."""
        now_s = time.monotonic()
        if not at_once and now_s < self._printed_s + LINE_S:
            return
        sources = self._receiver.sources
        texts = {
            f"universe {universe}": f"from {sources[universe].name!r}, priority "
            f"{sources[universe].priority}"
            if universe in sources
            else "no source any more; its levels stay"
            for universe in sorted(self._receiver.levels)
        }
        texts |= self._channel_texts() if self._rig is None else self._light_texts()
        for subject, text in texts.items():
            if self._printed.get(subject) != text:
                terminal.write(f"{subject}: {text}")
        self._printed, self._printed_s = texts, now_s

    def document(self) -> dict[str, Any]:
        """Return what has arrived, for programs."""
        sources, levels = self._receiver.sources, self._receiver.levels
        universes = {
            str(universe): {
                "source": sources[universe].name if universe in sources else None,
                "priority": sources[universe].priority if universe in sources else None,
                "levels": {str(k): level for k, level in enumerate(values, start=1) if level},
            }
            for universe, values in sorted(levels.items())
        }
        document = {"protocol": self._receiver.protocol.scheme, "universes": universes}
        return document if self._rig is None else {**document, "lights": self._drives()}

    def _channel_texts(self) -> dict[str, str]:
        """Return the channels of each universe that are not at 0."""
        return {
            f"channels of universe {universe}": some_of(
                [f"{k}={level}" for k, level in enumerate(values, start=1) if level], " "
            )
            or "all at 0"
            for universe, values in sorted(self._receiver.levels.items())
        }

    def _light_texts(self) -> dict[str, str]:
        """Return the drives of each light, with the address of its fixture; of a colour wheel the
        drive of the slot which shines.
        """
        assert self._rig is not None
        owners = self._rig.owners
        wheels = {
            light.name
            for fixture in self._rig.fixtures
            for light in fixture.lights
            if light.has_slots_for_emitters
        }
        return {
            f"{light} at {_address_of(owners[light])}": " ".join(
                f"{name}={drive:.3f}"
                for name, drive in drives.items()
                if drive or light not in wheels
            )
            or "dark"
            for light, drives in self._drives().items()
        }

    def _drives(self) -> dict[str, dict[str, float]]:
        """Return the drives of lights whose universes have arrived."""
        assert self._rig is not None
        received = self._receiver.levels
        levels = {own: received[x] for own, x in self._universes.items() if x in received}
        owners = self._rig.owners
        return {
            light: drives
            for light, drives in dmx.decode_levels(self._rig, levels).items()
            if drives and _universes_in(owners[light]) <= set(levels)
        }


def _universes_in(fixture: dmx.RigFixture) -> set[int]:
    return {x for channel in fixture.channels for x, _ in fixture.places(channel)}


def _address_of(fixture: dmx.RigFixture) -> str:
    return " and ".join(map(dmx.address_text, fixture.addresses.values()))
