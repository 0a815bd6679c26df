"""JavaScript modules of lightpaint, bundled into one script.

The modules are small and import each other by path. A server serves them as they are; a page of one
file, and a notebook, need one script. `bundled` makes it without other tools: each module becomes a
function that is called once, and its exports become constants of the script. The script evaluates
no text and loads nothing, so it runs under the strictest content policy, as `blob:` in JupyterLab,
VS Code and marimo, and inline in a page opened from a disk. `bundled` refuses syntax that it does
not understand, and tests bundle every module that ships.
"""

import posixpath
import re
from functools import cache
from importlib import resources

import rcssmin
import rjsmin

_IMPORT = re.compile(
    r"^import\s+(?:(?P<names>[^;'\"]+?)\s+from\s+)?(?P<q>['\"])(?P<path>[^'\"]+)(?P=q);?[ \t]*$",
    re.MULTILINE,
)
_EXPORT = re.compile(
    r"^export\s+(?=(?:async\s+)?(?:const|class|function\*?)\s+(?P<name>[\w$]+))", re.MULTILINE
)
#: What must not come before a word is looked for behind it: a pattern that begins with a text is
#: found ten times as fast, and a painter's page waits for this.
_EXPORT_LIST = re.compile(
    r"export(?<![\w$.]export)\s*\{(?P<names>[^}]*)\}"
    r"(?:\s*from\s*(?P<q>['\"])(?P<path>[^'\"]+)(?P=q))?;?"
)
_SHEET_IMPORT = re.compile(r'^@import "(?P<path>[^"]+)";$', re.MULTILINE)
#: The space before a pseudo-class of a descendant, which rcssmin 1.3.0 drops within `@container`.
_DESCENDANT = re.compile(r"(?<=[\w)\]]) (?=:(?:has|is|not|where)\()")
_DYNAMIC = re.compile(r"import\((?<![\w$.]import\()")
_PATHS = re.compile(r"""\(\s*["'](\.[./\w-]*\.js)["']""")
_COMMENT = re.compile(
    r"^[ \t]*(?:/\*(?!!)(?:(?!\*/)[\s\S])*\*/[ \t]*(?=\n|\Z)|//[^\n]*(?=\n|\Z))", re.MULTILINE
)
_TYPE = re.compile(r"/\*\*\s*@(?:type|param|returns|this|template)\b[\s\S]*?\*/ ?")
_NOT_UNDERSTOOD = re.compile(r"^[^\S\n]*(?:import|export)(?:\s+[\w$*]|\s*[{'\"])", re.MULTILINE)
_META = re.compile(r"import\.meta\b(?<!\wimport\.meta)")


class BundleError(Exception):
    """A module that uses syntax which `bundled` does not understand."""


@cache
def source(path: str) -> str:
    """Return the text of one of the browser's files, by its path below the package."""
    return resources.files("lightpaint").joinpath(path).read_text(encoding="utf-8")


@cache
def _code(path: str) -> str:
    """Return the code of a module; third-party modules whole, with their licence."""
    text = source(path)
    return text if "/vendor/" in path else _minified(text)


@cache
def styles(*paths: str) -> str:
    """Return style sheets joined, with all that they import, without comments and space that has no
    meaning."""
    sheets = (_DESCENDANT.sub(" *", _whole_sheet(path)) for path in paths)
    return "\n".join(map(rcssmin.cssmin, sheets))


def _whole_sheet(path: str) -> str:
    """Return a style sheet with the sheets that it imports in place."""
    folder = posixpath.dirname(path)
    return _SHEET_IMPORT.sub(
        lambda match: _whole_sheet(posixpath.join(folder, match["path"])), source(path)
    )


def compact_script(text: str) -> str:
    """Return a script without comments and space that has no meaning; licences, `/*!`, stay.

    Names stay, too, so that errors of a page name the source.
    """
    return str(rjsmin.jsmin(text, keep_bang_comments=True))


def unindented(text: str) -> str:
    """Return code without indentation and empty lines, which would be a tenth of a report.

    Neither has a meaning, not even in the templates of these scripts.
    """
    return "\n".join(line.strip() for line in text.splitlines() if line.strip())


@cache
def bundled(entry: str) -> str:
    """Return a module and all that it imports as one ES module with the same exports.

    entry: its path below the package. The text is the same wherever it is made. Raises BundleError.
    """
    order: list[str] = []
    _append_in_order(entry, order, ())
    number = {path: k for k, path in enumerate(order)}
    parts = [_as_constant(path, number) for path in order]
    names = _exported(entry)
    if any(_DYNAMIC.search(_code(path)) for path in order):
        table = ", ".join(f'"{path}": m{k}' for path, k in number.items())
        parts.append(f"const modules = {{ {table} }}\n{_DYNAMIC_IMPORT}")
    last = "".join(
        f"export {'default' if name == 'default' else f'const {name} ='} m{number[entry]}.{name}\n"
        for name in names
    )
    return "\n".join(parts) + "\n" + last


#: The script's own `import(path)`, for modules that are in it.
_DYNAMIC_IMPORT = """function loaded(from, path) {
  const there = new URL(path, "lightpaint:/" + from).pathname.slice(1)
  return modules[there] ? Promise.resolve(modules[there]) : Promise.reject(new Error(there))
}"""


def _append_in_order(path: str, order: list[str], ancestors: tuple[str, ...]) -> None:
    """Append to `order` all that a module imports, then the module itself."""
    if path in ancestors:
        raise BundleError(f"modules that import each other: {' > '.join((*ancestors, path))}")
    if path in order:
        return
    for needed in _imported_paths(path):
        _append_in_order(needed, order, (*ancestors, path))
    order.append(path)


def _imported_paths(path: str) -> list[str]:
    """Return the paths of the modules that a module imports, in its order."""
    text = _code(path)
    paths = [match["path"] for match in _IMPORT.finditer(text)]
    paths += [match["path"] for match in _EXPORT_LIST.finditer(text) if match["path"]]
    if _DYNAMIC.search(text):
        paths += _PATHS.findall(text)
    return [_resolved(path, specifier) for specifier in paths]


def _resolved(path: str, named: str) -> str:
    if not named.startswith("."):
        raise BundleError(f"{path} imports {named!r}: expected a path that begins with a dot")
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), named))


def _as_constant(path: str, number: dict[str, int]) -> str:
    """Return a module as a constant of the script: an object of its exports."""
    text, exports = _code(path), []

    def imported(match: re.Match[str]) -> str:
        needed = _resolved(path, match["path"])
        return _constants(match["names"], f"m{number[needed]}", path, needed)

    def listed(match: re.Match[str]) -> str:
        prefix = "" if match["path"] is None else f"m{number[_resolved(path, match['path'])]}."
        for local, name in _pairs(match["names"]):
            exports.append(f"{name}: {prefix}{local}" if prefix or local != name else name)
        return ""

    text = _IMPORT.sub(imported, text)
    text = _EXPORT_LIST.sub(listed, text)
    exports += [match["name"] for match in _EXPORT.finditer(text)]
    text = _EXPORT.sub("", text)
    text = _DYNAMIC.sub(f'loaded.bind(null, "{path}")(', text)
    if unknown := _NOT_UNDERSTOOD.search(text) or _META.search(text):
        line = text[unknown.start() :].strip().splitlines()[0]
        raise BundleError(
            f"{path}: cannot bundle `{line[:60]}`: write it as another import or export"
        )
    body = unindented(text)
    return f"const m{number[path]} = (() => {{\n{body}\nreturn {{ {', '.join(exports)} }}\n}})()"


def _constants(names: str | None, module: str, path: str, needed: str) -> str:
    """Return the names that an import statement of `path` takes from `needed`, as constants."""
    if names is None:
        return ""
    names = names.strip()
    if names.startswith("* as "):
        return f"const {names[5:].strip()} = {module}"
    if not (names.startswith("{") and names.endswith("}")):
        raise BundleError(f"{path}: imports {names!r}; expected {{ names }} or * as a name")
    pairs = [x if x == y else f"{x}: {y}" for x, y in _pairs(names[1:-1])]
    exported = _exported(needed)
    if missing := [x for x, _ in _pairs(names[1:-1]) if x not in exported]:
        raise BundleError(f"{path} imports {missing[0]!r}, which {needed} does not export")
    return f"const {{ {', '.join(pairs)} }} = {module}"


def _pairs(names: str) -> list[tuple[str, str]]:
    """Return `a, b as c` as (a, a), (b, c)."""
    parts = [x.split(" as ") for x in (" ".join(entry.split()) for entry in names.split(",")) if x]
    return [(x[0].strip(), x[-1].strip()) for x in parts]


@cache
def _exported(path: str) -> tuple[str, ...]:
    """Return the names that a module exports."""
    text = _code(path)
    names = [match["name"] for match in _EXPORT.finditer(text)]
    for match in _EXPORT_LIST.finditer(text):
        names += [name for _, name in _pairs(match["names"])]
    return tuple(names)


def _minified(text: str) -> str:
    """Return code without type comments and whole-line comments; licences, `/*!`, stay."""
    return re.sub(r"\n{2,}", "\n", _TYPE.sub("", _COMMENT.sub("", text))).strip() + "\n"
