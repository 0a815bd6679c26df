"""The browser's side of lightpaint: its modules as they ship, several of them as one script.

Small ES modules import each other by path. A server gives them out as they are; a page that is one
file, and a notebook, take one script. `bundled` makes it, without a tool: each module becomes a
function that is called once and whose exports are constants of the script. Nothing is evaluated
from text and nothing is loaded, so that it runs under the strictest content policy, as `blob:` in
JupyterLab, VS Code and marimo, and inline in a page from a disk. What this does not understand it
refuses, and tests bundle every module that ships.
"""

import posixpath
import re
from functools import cache
from importlib import resources

_IMPORT = re.compile(
    r"^import\s+(?:(?P<names>[^;'\"]+?)\s+from\s+)?(?P<q>['\"])(?P<path>[^'\"]+)(?P=q);?[ \t]*$",
    re.MULTILINE,
)
_DECLARED = re.compile(
    r"^export\s+(?=(?:async\s+)?(?:const|class|function\*?)\s+(?P<name>[\w$]+))", re.MULTILINE
)
_LISTED = re.compile(
    r"(?<![\w$.])export\s*\{(?P<names>[^}]*)\}"
    r"(?:\s*from\s*(?P<q>['\"])(?P<path>[^'\"]+)(?P=q))?;?"
)
_DYNAMIC = re.compile(r"(?<![\w$.])import\(")
_PATHS = re.compile(r"""\(\s*["'](\.[./\w-]*\.js)["']""")
_COMMENT = re.compile(
    r"^[ \t]*(?:/\*(?!!)(?:(?!\*/)[\s\S])*\*/[ \t]*(?=\n|\Z)|//[^\n]*(?=\n|\Z))", re.MULTILINE
)
_TYPE = re.compile(r"/\*\*\s*@(?:type|param|returns|this|template)\b[\s\S]*?\*/ ?")
_LEFT = re.compile(r"^\s*(?:import|export)(?:\s+[\w$*]|\s*[{'\"])|\bimport\.meta\b", re.MULTILINE)


class BundleError(Exception):
    """A module that is written in a way that `bundled` does not know."""


@cache
def source(path: str) -> str:
    """Return the text of one of the browser's files, by its path below the package."""
    return resources.files("lightpaint").joinpath(path).read_text(encoding="utf-8")


@cache
def _code(path: str) -> str:
    """What of a module does anything; of what others wrote, all of it, licence and names too."""
    text = source(path)
    return text if "/vendor/" in path else _spare(text)


@cache
def styles(*paths: str) -> str:
    """Style sheets, one after the other, without their comments."""
    return "\n".join(_spare(source(path)) for path in paths)


@cache
def bundled(entry: str) -> str:
    """A module and all that it imports as one ES module, which exports what it exports.

    entry: its path below the package. The same text wherever it is made. Raises BundleError.
    """
    order: list[str] = []
    _ordered(entry, order, ())
    number = {path: k for k, path in enumerate(order)}
    parts = [_wrapped(path, number) for path in order]
    names = _exported(entry)
    if any(_DYNAMIC.search(_code(path)) for path in order):
        table = ", ".join(f'"{path}": m{k}' for path, k in number.items())
        parts.append(f"const modules = {{ {table} }}\n{_AT_RUN_TIME}")
    last = "".join(
        f"export {'default' if name == 'default' else f'const {name} ='} m{number[entry]}.{name}\n"
        for name in names
    )
    return "\n".join(parts) + "\n" + last


#: `import(path)`, of a module that the script has.
_AT_RUN_TIME = """function loaded(from, path) {
  const there = new URL(path, "lightpaint:/" + from).pathname.slice(1)
  return modules[there] ? Promise.resolve(modules[there]) : Promise.reject(new Error(there))
}"""


def _ordered(path: str, order: list[str], above: tuple[str, ...]) -> None:
    """Put what a module needs before it into `order`, then itself."""
    if path in above:
        raise BundleError(f"modules that import each other: {' > '.join((*above, path))}")
    if path in order:
        return
    for needed in _needed(path):
        _ordered(needed, order, (*above, path))
    order.append(path)


def _needed(path: str) -> list[str]:
    """Paths of the modules that one imports, in the order that it names them."""
    text = _code(path)
    found = [match["path"] for match in _IMPORT.finditer(text)]
    found += [match["path"] for match in _LISTED.finditer(text) if match["path"]]
    if _DYNAMIC.search(text):
        found += _PATHS.findall(text)
    return [_resolved(path, one) for one in found]


def _resolved(path: str, named: str) -> str:
    if not named.startswith("."):
        raise BundleError(f"{path} imports {named!r}: expected a path that begins with a dot")
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), named))


def _wrapped(path: str, number: dict[str, int]) -> str:
    """A module as a constant of the script: an object with what it exports."""
    text, made = _code(path), []

    def imported(match: re.Match[str]) -> str:
        needed = _resolved(path, match["path"])
        return _constants(match["names"], f"m{number[needed]}", path, needed)

    def listed(match: re.Match[str]) -> str:
        its = "" if match["path"] is None else f"m{number[_resolved(path, match['path'])]}."
        for local, name in _pairs(match["names"]):
            made.append(f"{name}: {its}{local}" if its or local != name else name)
        return ""

    text = _IMPORT.sub(imported, text)
    text = _LISTED.sub(listed, text)
    made += [match["name"] for match in _DECLARED.finditer(text)]
    text = _DECLARED.sub("", text)
    text = _DYNAMIC.sub(f'loaded.bind(null, "{path}")(', text)
    if found := _LEFT.search(text):
        line = text[found.start() :].strip().splitlines()[0]
        raise BundleError(f"{path}: what is `{line[:60]}`?")
    # Where a line begins says nothing, in templates neither, and would be a tenth of a report.
    body = "\n".join(line.strip() for line in text.splitlines() if line.strip())
    return f"const m{number[path]} = (() => {{\n{body}\nreturn {{ {', '.join(made)} }}\n}})()"


def _constants(names: str | None, module: str, path: str, needed: str) -> str:
    """What an import statement of `path` names of the module at `needed`, as constants."""
    if names is None:
        return ""
    names = names.strip()
    if names.startswith("* as "):
        return f"const {names[5:].strip()} = {module}"
    if not (names.startswith("{") and names.endswith("}")):
        raise BundleError(f"{path}: imports {names!r}; expected {{ names }} or * as a name")
    pairs = [x if x == y else f"{x}: {y}" for x, y in _pairs(names[1:-1])]
    there = _exported(needed)
    if missing := [x for x, _ in _pairs(names[1:-1]) if x not in there]:
        raise BundleError(f"{path} imports {missing[0]!r}, which {needed} does not export")
    return f"const {{ {', '.join(pairs)} }} = {module}"


def _pairs(names: str) -> list[tuple[str, str]]:
    """`a, b as c` as (a, a), (b, c)."""
    parts = [x.split(" as ") for x in (" ".join(one.split()) for one in names.split(",")) if x]
    return [(x[0].strip(), x[-1].strip()) for x in parts]


@cache
def _exported(path: str) -> tuple[str, ...]:
    """Names that a module exports."""
    text = _code(path)
    names = [match["name"] for match in _DECLARED.finditer(text)]
    for match in _LISTED.finditer(text):
        names += [name for _, name in _pairs(match["names"])]
    return tuple(names)


def _spare(text: str) -> str:
    """Without types, and comments that have lines of their own; those of others, `/*!`, stay."""
    return re.sub(r"\n{2,}", "\n", _TYPE.sub("", _COMMENT.sub("", text))).strip() + "\n"
