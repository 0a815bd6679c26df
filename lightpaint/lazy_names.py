"""Names that a package offers, each imported when it is first used (PEP 562)."""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

#: An import for type checkers: its module, and its names, in brackets or in one line; and a name.
IMPORT = re.compile(r"^    from (\S+) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)
NAME = re.compile(r"(\w+)(?: as \1)?")


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package that is being imported.

    They offer what the package imports under `if TYPE_CHECKING:`, so that a name stands once.
    package: its `__name__`.
    """
    module = sys.modules[package]
    source = module.__spec__.loader.get_source(package)  # type: ignore[union-attr]
    found = IMPORT.findall(source)
    homes = {name: home for home, more, one in found for name in NAME.findall(more or one)}

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(homes[name]), name)
        setattr(module, name, value)  # from now on found without asking here
        return value

    return get, lambda: sorted({*vars(module), *homes}), list(homes)
