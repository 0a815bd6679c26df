"""The room of what draws in browsers: it knows nothing of the pages that it draws in."""

import re
from posixpath import dirname, join, normpath

from renderer import REPOSITORY

ROOM = REPOSITORY / "lightpaint" / "viewer"


def test_no_module_of_the_viewer_imports_one_of_a_page():
    scripts = sorted(ROOM.rglob("*.js"))
    assert scripts
    for script in scripts:
        place = script.relative_to(ROOM).as_posix()
        for specifier in re.findall(
            r"""(?:from |import\()\s*['"]([^'"]+)['"]""", script.read_text()
        ):
            path = normpath(join(dirname(place), specifier))
            assert (ROOM / path).is_file(), f"{place} imports {specifier}"
            assert not path.startswith(".."), f"{place} imports {specifier}"
