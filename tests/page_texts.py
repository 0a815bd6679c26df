"""Sentences of the page that its code marks for translation, and texts that it does not mark.

`python tests/page_texts.py` prints all sentences as a translation in which each stands for itself,
which is a start for a file like `lightpaint/paint/page/language/de.js`.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[1] / "lightpaint" / "paint" / "page"

_LITERAL = r"""('[^'\\\n]*'|"[^"\\\n]*")"""

#: A call that gives a sentence in the language of the page.
CALL = re.compile(r"(?<![\w.$])(?:t|plural)\(")

#: The same with a literal, as translators need it; and with the two forms of a number in English.
SENTENCE = re.compile(rf"(?<![\w.$])t\(\s*{_LITERAL}(?:,\s*\{{ context: '(\w+)' \}})?")
FORMS = re.compile(
    rf"(?<![\w.$])plural\([^{{;]*\{{\s*one:\s*{_LITERAL},\s*other:\s*{_LITERAL},?\s*\}}"
)

#: Names of forms, as `Intl.PluralRules` has them.
CATEGORIES = {"zero", "one", "two", "few", "many", "other"}

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


def modules() -> Iterator[Path]:
    """Yield the modules of the page that are written here and have sentences."""
    for path in sorted(PAGE.rglob("*.js")):
        if path.relative_to(PAGE).parts[0] not in ("vendor", "language"):
            yield path


def sentences_in(source: str) -> dict[str, str | dict[str, str]]:
    """Return the marked sentences of a module by their keys in a translation."""
    found: dict[str, str | dict[str, str]] = {}
    for literal, context in SENTENCE.findall(source):
        text = literal[1:-1]
        found[f"{text} ({context})" if context else text] = text
    for one, other in FORMS.findall(source):
        found[one[1:-1]] = {"one": one[1:-1], "other": other[1:-1]}
    return found


def all_sentences() -> dict[str, str | dict[str, str]]:
    """Return the marked sentences of the page by their keys in a translation."""
    found: dict[str, str | dict[str, str]] = {}
    for path in modules():
        for key, text in sentences_in(path.read_text("utf-8")).items():
            assert found.setdefault(key, text) == text, (
                f"{path.name}: {key!r} with a number, and without"
            )
    return found


def calls_without_literal(source: str) -> list[str]:
    """Return the beginnings of calls whose sentence no translator would be given."""
    marked = {match.start() for pattern in (SENTENCE, FORMS) for match in pattern.finditer(source)}
    starts = [match.start() for match in CALL.finditer(source)]
    return [source[start : start + 60] for start in starts if start not in marked]


def _names(text: str) -> set[str]:
    return set(re.findall(r"\{(\w+)\}", text))


def faults(
    translation: dict[str, Any], sentences: dict[str, str | dict[str, str]]
) -> list[tuple[str, str]]:
    """Return keys of a translation with what is wrong there. What it lacks is not a fault."""
    found = []
    for key, text in translation.items():
        english = sentences.get(key)
        if english is None:
            found.append((key, "no sentence of the page"))
            continue
        forms = {"other": text} if isinstance(text, str) else text
        names = _names(english if isinstance(english, str) else english["other"])
        if forms is text and isinstance(english, str):
            found.append((key, "forms of a sentence that has no number"))
        elif not {"other"} <= set(forms) <= CATEGORIES:
            found.append((key, "unknown forms, or none that is called other"))
        elif any(_names(form) | {"count"} != names | {"count"} for form in forms.values()) or (
            _names(forms["other"]) != names
        ):
            found.append((key, "other names in braces"))
    return found


def _is_read(text: str) -> bool:
    return bool(_SENTENCE.search(text)) and not NOT_READ.fullmatch(text)


def texts_in(source: str) -> list[str]:
    """Return the texts of a module that somebody reads and no translation reaches."""
    source = re.sub(r"^import [\s\S]*?;$", "", source, flags=re.MULTILINE)
    source = FORMS.sub("plural(0", SENTENCE.sub("t(''", source))
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


if __name__ == "__main__":
    print("/** @type {import('./languages.js').Translation} */")
    print(
        f"export const translation = {json.dumps(all_sentences(), indent=2, ensure_ascii=False)};"
    )
