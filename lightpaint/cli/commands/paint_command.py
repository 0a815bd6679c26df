"""`lightpaint paint`: opens the painter in a browser, and prints its address."""

import json
import os
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from shlex import quote
from threading import Thread
from typing import TYPE_CHECKING, Any

from lightpaint.cli.output import lines, terminal
from lightpaint.cli.output.lines import CommandOutcome, output_mode
from lightpaint.colour import TransformChoice
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.lighting import Constraints
from lightpaint.paint import DEFAULT_NEAR, Reach, SessionRequests
from lightpaint.pipeline import BasisFile, GroupsFile, SceneFile, Settings
from lightpaint.sentences import Hint

if TYPE_CHECKING:
    from lightpaint.dmx import ConsoleRig, ConsoleTarget
    from lightpaint.paint import Console, Server, SessionRequests, Subject

#: The risk of an address that others can reach.
RISK = (
    "anyone who has its address with the token can paint here and write results to {folder}, "
    "and the connection is not encrypted"
)

#: Who can reach the painter, printed if the user chose an address.
REACH_TEXTS = {
    Reach.MACHINE: "programs of this machine, and nobody else, can reach the painter at {name}",
    Reach.ADDRESS: "other machines can reach the painter at {name}; " + RISK,
    Reach.ALL: "other machines can reach the painter at every address of this one; " + RISK,
}


def paint(
    *,
    sources: Sequence[SceneFile | BasisFile | GroupsFile],
    folder: Path,
    settings: Settings,
    constraints: Constraints,
    choice: TransformChoice,
    options: tuple[str, ...],
    layers: Path | None,
    new: bool,
    host: str | None,
    port: int | None,
    with_browser: bool,
    console: Mapping[str, Any] | None = None,
) -> CommandOutcome:
    """Run `lightpaint paint SCENE|BASIS|LIGHTS`, for one view or several.

    console: the file of a rig, and the arguments of `_console`.
    """
    # The server and the session file import much that no other command needs.
    from lightpaint.paint import check_installed, make_subjects

    check_installed()
    if console is not None and settings.spectral:
        raise LightpaintError(
            Hint("spectral", True), " does not go with ", Hint("rig"), ": leave one out"
        )
    from lightpaint.cli.output.vocabulary import from_any_folder

    def command(paintings: Mapping[str, str], requests: "SessionRequests") -> str:
        # In the painter no light moves unless somebody moves it.
        is_still = subjects[0].lets_lights_move and not requests.placed
        words = (*options, *["--no-move"] * is_still)
        return from_any_folder(command_for_paintings(sources[0].path, paintings, words, requests))

    fixtures = None
    if console is not None:
        from lightpaint.cli.commands.console_commands import read_rig_file
        from lightpaint.dmx import check_lamps

        fixtures = read_rig_file(console["rig"])
    subjects = make_subjects(
        sources,
        folder,
        settings=settings,
        constraints=constraints,
        choice=choice,
        layers=layers,
        **({} if fixtures is None else {"check_lamps": partial(check_lamps, fixtures)}),
        # `solve` takes only one basis, which has one view.
        **({} if len(sources) > 1 and isinstance(sources[0], BasisFile) else {"command": command}),
    )
    if (groups := subjects[0].groups) is not None:
        for remark in groups.remarks:
            terminal.say(remark)
    link = None
    if console is not None and fixtures is not None:
        link = _console(fixtures, **{k: v for k, v in console.items() if k != "rig"})
    return _serve(subjects, new=new, host=host, port=port, with_browser=with_browser, console=link)


def _console(
    fixtures: "ConsoleRig",
    *,
    target: "ConsoleTarget | None",
    universes: dict[int, int],
    priority: int | None,
    positions: bool,
) -> "Console":
    """Return the console of a rig, and say what it will send to. Nothing is sent yet."""
    from lightpaint.dmx import PRIORITY, ConsoleLink, link_address
    from lightpaint.paint import Console

    if target is None:
        return Console(fixtures)
    chosen = PRIORITY if priority is None else priority
    address = link_address(target, fixtures, universes=universes, priority=chosen)
    terminal.say(f"console: {address}; nothing is sent before it is switched on in the page")
    open_link = partial(ConsoleLink.open, target, fixtures, universes=universes, priority=chosen)
    return Console(fixtures, open_link, address, has_positions=positions)


def _serve(
    subjects: Sequence["Subject"],
    *,
    new: bool,
    host: str | None,
    port: int | None,
    with_browser: bool,
    console: "Console | None",
) -> CommandOutcome:
    """Serve the painter until its end."""
    from lightpaint.paint import paint_in_browser

    name, folder, addresses = subjects[0].name, subjects[0].folder, []

    def on_open(server: "Server") -> None:
        addresses.append(server.url)
        _announce(server, name, folder, is_reachable=host is not None)
        if with_browser and _has_browser():
            # Some browsers block the process that starts them.
            urls = (server.one_time_url(),)
            Thread(target=_show, args=urls, name="browser", daemon=True).start()

    try:
        paint_in_browser(
            subjects,
            on_open,
            new=new,
            host=host,
            port=port,
            console=console,
            say=lambda text: _print_lines(text),
        )
    except KeyboardInterrupt:
        if not addresses:  # it had not started
            raise
        terminal.say(f"the painter has ended; the session is kept in {folder}")
    except OutputError as error:  # also after an interrupt
        terminal.complain("paint", error.sentence)
        return CommandOutcome(None, 2)
    return CommandOutcome(None)


def _announce(server: "Server", name: str, folder: Path, *, is_reachable: bool) -> None:
    """Print the painter's address, and with --host who can reach it.

    name: of the scene or basis. is_reachable: whether the user gave an address to listen at.
    """
    if is_reachable:
        reach_text = REACH_TEXTS[server.address.reach].format(
            name=server.address.name, folder=folder
        )
        is_open = server.address.reach is not Reach.MACHINE
        (partial(terminal.complain, "paint") if is_open else terminal.say)(reach_text)
    sentence = f"painting {name} at {server.url} (Ctrl-C ends it; everything is kept in {folder})"
    if output_mode().as_json:  # at once and in one line: programs connect while it runs
        lines.err(sentence)
        lines.out(json.dumps({**server.connection, "folder": str(folder), "scene": name}))
    else:
        terminal.write(sentence)


def _print_lines(text: str) -> None:
    """Print a message of the server; the message of a bug has many lines."""
    lines_of_text = text.rstrip().split("\n")
    for line in lines_of_text if len(lines_of_text) > 1 else [text]:
        terminal.say(line)


def _show(url: str) -> None:
    import webbrowser

    webbrowser.open(url)


def _has_browser() -> bool:
    """Return True if there is a browser that does not take over the terminal."""
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("BROWSER")
    ):
        return False
    return True


def command_for_paintings(
    source: str, paintings: Mapping[str, str], options: Sequence[str], requests: SessionRequests
) -> str:
    """Return the command that gives the same answer to exported paintings as their session.

    paintings: paths by sensor, "" for the painting of the only view. source, options: the options
    of the painter.
    """
    words = ["lightpaint solve", quote(source)]
    for sensor, path in paintings.items():
        words.append(f"--target {quote(f'{sensor}={path}')}" if sensor else quote(path))
    if requests.placed:
        from lightpaint.paint import places_path

        folder = Path(next(iter(paintings.values()))).parent
        words.append(f"--places {quote(str(places_path(folder)))}")
    return " ".join([*words, *options, *options_of(requests)])


def options_of(requests: SessionRequests) -> list[str]:
    """Return requests as options of `lightpaint solve`."""
    options = []
    for name, constraint in requests.lights.items():
        options += [option for key in constraint for option in _options(name, key, constraint)]
    for names in requests.ties:
        options.append(f"--tie {quote(','.join(names))}")
    for name, emission in requests.start.items():
        options.append(f"--start {quote(f'{name}={_value_text(emission)}')}")
    if requests.start and "near" not in requests.values:
        options.append(f"--near {DEFAULT_NEAR:g}")
    for key, value in requests.values.items():
        option = f"--{key.replace('_', '-')}"
        options.append(option if value is True else f"{option} {value}")
    return options


def _options(name: str, key: str, constraint: Mapping[str, Any]) -> list[str]:
    """Return one request for a light as options; duv goes with its kelvin."""
    value = constraint[key]
    if key in ("off", "lock") and value is True:
        return [f"--{key} {quote(name)}"]
    if key == "limits":
        ends = ":".join(
            "" if end not in value else _value_text(value[end]) for end in ("min", "max")
        )
        return [f"--limit {quote(f'{name}={ends}')}"]
    if key == "kelvin":
        duv = f",duv={constraint['duv']:g}" if "duv" in constraint else ""
        kelvin = (
            ":".join(map(_value_text, value))
            if isinstance(value, list | tuple)
            else _value_text(value)
        )
        return [f"--kelvin {quote(f'{name}={kelvin}{duv}')}"]
    if key == "duv":
        return []
    return [f"--{key} {quote(f'{name}={_value_text(value)}')}"]


def _value_text(value: Any) -> str:
    """Return a value of a lights file as an option has it, with all digits."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(map(_value_text, value))
    return repr(float(value)) if isinstance(value, int | float) else str(value)
