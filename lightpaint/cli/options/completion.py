"""Shell completion with argcomplete: commands, options, file names."""

import argparse
from collections.abc import Iterator

#: Suffixes of files by the destination of an argument; other arguments take any file.
ENDINGS = {
    "scene": (".xml",),
    "source": (".xml", ".exr"),
    "targets": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "masks": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "lightings": (".json",),
    "lights_file": (".toml",),
}


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell's request for completions, and exit; without argcomplete answer nothing."""
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
    """Yield the arguments of all commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
