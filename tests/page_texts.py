"""Texts of the page that stand in its code and not in its language file."""

import re
from dataclasses import dataclass

#: Properties and attributes whose literal text somebody reads.
READ = "aria-label|aria-valuetext|data-tip|description|label|placeholder|text|tip|title|unit"

#: Literals that nobody reads: keys, types of elements and files, values of attributes.
NOT_READ = re.compile(
    r"""(?:Enter|Escape|Arrow(?:Up|Down|Left|Right)|Home|End|Delete|Backspace|Tab|Space|Control|Shift
    |Alt|AltGraph|Ctrl|Esc|Meta|INPUT|TEXTAREA|SELECT|HEAD|Files|[A-Z]|[A-Z]\d?
    |\(.*\)|[.\#\[].*|.*\bis-.*|[a-z]\[.*|[\w-]+\[.*|M\d.*|Bearer\ |.*sans-serif)""",
    re.VERBOSE,
)

#: Code before a literal that somebody reads. Units are codes in code, and texts in attributes.
READ_BEFORE = re.compile(rf"\b(?:{READ.removesuffix('|unit')}):\s*$")

#: Code before a literal that nobody reads: comparisons, classes, errors of the program itself.
UNREAD_BEFORE = re.compile(r"(?:===|!==)\s*$|Error\(\s*$|\b(?:key|value|keys): $|class=\$\{\s*$")

_WORD = r"[A-Za-z\u0394]{2,}"
_SENTENCE = re.compile(rf"^[A-Z\u0394].*[a-z]|{_WORD}[,:.]? {_WORD}")


@dataclass
class Template:
    """A template literal: its text, with `\\0` for each expression, and the code before it."""

    text: str
    before: str

    @property
    def is_html(self) -> bool:
        return self.before.endswith("html")


def literals(source: str) -> tuple[list[tuple[str, str]], list[Template]]:
    """Return the quoted texts of a module, each with the code before it, and its templates."""
    quoted: list[tuple[str, str]] = []
    templates: list[Template] = []

    def code(at: int, is_expression: bool) -> int:
        """Read code from a place, up to the brace that ends an expression."""
        depth, start = 0, at
        while at < len(source):
            two, one = source[at : at + 2], source[at]
            if two == "//":
                at = source.find("\n", at)
            elif two == "/*":
                at = source.index("*/", at) + 2
            elif one == "/" and re.search(r"[(,=:[!&|?{};]\s*$|return\s*$", source[start:at]):
                at = (
                    re.compile(r"(?:\\.|\[(?:\\.|[^\]])*\]|[^/\\\n])+/\w*")
                    .match(source, at + 1)
                    .end()
                )
            elif one in "'\"":
                end = re.compile(rf"(?:\\.|[^{one}\\])*").match(source, at + 1).end()
                quoted.append((source[at + 1 : end], source[max(0, at - 60) : at]))
                at = end + 1
            elif one == "`":
                at = template(at + 1, source[max(0, at - 60) : at])
            elif one == "}" and is_expression and depth == 0:
                return at + 1
            else:
                depth += (one == "{") - (one == "}")
                at += 1
            if at < 0:
                break
        return len(source)

    def template(at: int, before: str) -> int:
        text = ""
        while source[at] != "`":
            if source[at : at + 2] == "${":
                at = code(at + 2, True)
                text += "\0"
            elif source[at] == "\\":
                text += source[at : at + 2]
                at += 2
            else:
                text += source[at]
                at += 1
        templates.append(Template(text, before))
        return at + 1

    code(0, False)
    return quoted, templates


def _is_read(text: str) -> bool:
    return bool(_SENTENCE.search(text)) and not NOT_READ.fullmatch(text)


def texts_in(source: str) -> list[str]:
    """Return the texts in the code of a module that somebody reads."""
    source = re.sub(r"^import [\s\S]*?;$", "", source, flags=re.MULTILINE)
    quoted, templates = literals(source)
    found = []
    for text, before in quoted:
        if UNREAD_BEFORE.search(before):
            continue
        if _is_read(text) or (
            re.search(rf"\b(?:{READ.replace('|unit', '')}):\s*$", before)
            and re.search(r"[a-z]{2}", text)
        ):
            found.append(text)
    for template in templates:
        if template.is_html:
            found += re.findall(rf'\s(?:{READ})="([^"]*[A-Za-z][^"]*)"', template.text)
            inner = re.findall(r">([^<>]*)(?=<|$)", template.text)
            found += [text.strip() for text in inner if re.search("[A-Za-z]", text)]
        else:
            bare = template.text.replace("\0", "x")
            is_style = re.search(r"\bis-|\b[\w-]+\(|^\w+ x$|\[data", bare)
            is_unread = is_style or UNREAD_BEFORE.search(template.before)
            if re.search(rf"{_WORD}[,:.]? ", bare) and not is_unread:
                found.append(template.text.replace("\0", "…"))
    return [text for text in found if text]
