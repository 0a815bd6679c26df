"""Completion in the shell, with argcomplete: commands, options, names of files."""

import argparse
from collections.abc import Iterator

#: Endings of the files that an argument takes, by where its value goes; others take any.
ENDINGS = {
    "scene": (".xml",),
    "source": (".xml", ".exr"),
    "targets": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "masks": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "lightings": (".json",),
    "lights_file": (".toml",),
}


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell that asks, and exit; without argcomplete there is no answer."""
    try:
        import argcomplete
    except ImportError:
        raise SystemExit(1) from None
    for action in _actions(parser):
        if action.dest in ENDINGS:
            files = argcomplete.completers.FilesCompleter(ENDINGS[action.dest])
            action.completer = files  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser, default_completer=argcomplete.completers.FilesCompleter())


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """What all commands take."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
