"""Pages that somebody reads first are read once: short sentences, and no words that say nothing.

Docstrings and comments are in the same English: nouns are repeated, programs print and send.
"""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest
from test_docs import DOCUMENTS, ROOT

#: Pages of measurements, derivations and generated tables, whose readers look something up.
LOOKED_UP = {"benchmarks.md", "decisions.md", "method.md", "protocol.md"}
PAGES = [path for path in DOCUMENTS if path.name not in LOOKED_UP]

#: Most words of a sentence, and of the mean sentence of a page.
MAX_WORDS, MAX_MEAN = 45, 22

#: Most words of all documents together, as `split` counts them.
MAX_ALL_WORDS = 65_000

#: Words that a sentence says as much without.
EMPTY = (
    "actually|basically|easily|extremely|fairly|leverage|obviously|of course|powerful|quite|really|"
    "robust|seamless|seamlessly|simply|state-of-the-art|utilize|very"
)

#: A pronoun where the noun is clearer: `the flux of the lamp`, not `that of the lamp`.
PRONOUN = re.compile(r"(?<!so )(?<!say )\b(?:that|those) of\b")

#: A denial without an article, other than of an amount, a degree or a time.
NO_ARTICLE = re.compile(
    r"(?<!there )(?<!There )(?<!where )\bis no "
    r"(?!longer|more|other|one|such|need|light\b|noise|reason)[a-z]+(?<!er)\b"
)


#: Speech of programs: they print, show and send. `cannot be told` is a label of answers.
SPEECH = re.compile(r"(?<!cannot be )(?<!\.)\b(?:told|said|spoken)\b(?!:)")

#: A word that stands twice, as a rename may leave it.
TWICE = re.compile(r"\b([a-z]+) \1\b")

#: Nouns of this house, and what says in a page what they are: italics or quotes, or a colon or a
#: parenthesis behind.
HOUSE = {
    word: re.compile(rf"[*\"]{word}s?[*\"]|\b{word}s?(?: \(|: )")
    for word in ("cap", "hat", "knob", "tether")
}

PACKAGE = [
    path
    for ending in ("py", "js")
    for path in sorted((ROOT / "lightpaint").rglob(f"*.{ending}"))
    if "vendor" not in path.parts
]


def notes(path: Path) -> str:
    """Return the comments and docstrings of a module of Python or JavaScript."""
    text = path.read_text("utf-8")
    if path.suffix == ".js":
        found = re.findall(r"/\*.*?\*/|(?<!:)//[^\n]*", text, re.DOTALL)
    else:
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        found = [token.string for token in tokens if token.type == tokenize.COMMENT]
        found += [
            ast.get_docstring(node) or ""
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        ]
    return " ".join(re.sub(r"^#:? |\n *(?:#:?|\*) ", " ", " ".join(found)).split())


def found_in(pattern: re.Pattern[str], text: str) -> list[str]:
    """Return where a pattern is in a text, with some of what stands around it."""
    return [text[max(0, x.start() - 40) : x.end() + 20] for x in pattern.finditer(text)]


def undefined(text: str) -> list[str]:
    """Return nouns of this house that a page uses before it says what they are."""
    plain = " ".join(re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL).split())
    uses = {word: re.search(rf"\b{word}(?:s|es)?\b", plain) for word in HOUSE}
    return [
        word
        for word, use in uses.items()
        if use
        and not HOUSE[word].match(plain, max(0, use.start() - (plain[use.start() - 1] in '*"')))
    ]


def prose(text: str) -> list[str]:
    """Return the paragraphs and list entries of a document, without code, tables and pictures."""
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d\.) )", text)
    return [" ".join(x.split()) for x in blocks if not re.match(r"\s*[|<#]|    |\s*:::|\s*!\[", x)]


def sentences(text: str) -> list[str]:
    """Return the sentences of a document."""
    parts = (re.split(r"(?<=[.!?:])\s+(?=[A-Z0-9*`\[(]|lightpaint)", x) for x in prose(text))
    return [sentence for some in parts for sentence in some if len(sentence.split()) > 2]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_sentences_are_short(page: Path) -> None:
    lengths = {x: len(x.split()) for x in sentences(page.read_text("utf-8"))}
    assert [x for x, words in lengths.items() if words > MAX_WORDS] == []
    assert sum(lengths.values()) <= MAX_MEAN * max(len(lengths), 1)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_no_word_is_empty(page: Path) -> None:
    text = " ".join(prose(page.read_text("utf-8")))
    assert re.findall(rf"\b(?:{EMPTY})\b[^.]{{0,30}}", text, re.IGNORECASE) == []


def test_what_a_thing_is_not_has_an_article() -> None:
    """`is not a scene`, not `is no scene`: in documents, docstrings, comments and errors."""
    places = [*DOCUMENTS, *(ROOT / "lightpaint").rglob("*.py")]
    assert {p.name: x for p in places if (x := NO_ARTICLE.findall(p.read_text("utf-8")))} == {}


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda path: path.name)
def test_nouns_are_repeated(page: Path) -> None:
    text = " ".join(page.read_text("utf-8").split())
    assert re.findall(rf".{{40}}{PRONOUN.pattern}.{{20}}", text) == []


def test_notes_of_the_package_are_in_plain_english() -> None:
    """Comments and docstrings: nouns repeated, programs that print, no word twice."""
    texts = {path: notes(path) for path in PACKAGE}
    assert len(texts) > 400
    for pattern in (PRONOUN, SPEECH, TWICE):
        faults = {path.name: x for path, text in texts.items() if (x := found_in(pattern, text))}
        assert faults == {}, pattern.pattern


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda path: path.name)
def test_nouns_of_the_house_are_defined_where_they_are_used(page: Path) -> None:
    assert undefined(page.read_text("utf-8")) == []


def test_modules_define_nouns_of_the_house_that_they_begin_with() -> None:
    modules = [path for path in PACKAGE if path.suffix == ".py"]
    first = {path: ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "" for path in modules}
    assert {path.name: x for path, text in first.items() if (x := undefined(text))} == {}


def test_documents_are_read_in_a_day() -> None:
    """All but the changelog, of security what is reported, and generated pages."""
    read = [path for path in DOCUMENTS if path.name not in {"CHANGELOG.md", "SECURITY.md"}]
    assert sum(len(path.read_text("utf-8").split()) for path in read) <= MAX_ALL_WORDS


def test_the_checks_would_find_it() -> None:
    assert found_in(SPEECH, "The page is told of it; its `x.spoken` cannot be told.") == [
        "The page is told of it; its `x.spoke"
    ]
    assert TWICE.findall("It is too too_strong, too too strong.") == ["too"]
    assert undefined("Finer hats add up. A *cap* is a limit; caps hold.") == ["hat"]
    assert PRONOUN.findall("The flux is that of the lamp, so that of two one is off.") == [
        "that of"
    ]
    assert NO_ARTICLE.findall("It is no scene. There is no light.") == ["is no scene"]
    long = "It " + "is said " * MAX_WORDS + "here."
    assert [x for x in sentences(f"Short one. {long}") if len(x.split()) > MAX_WORDS] == [long]
    assert prose("```\ncode\n```\n\n| table |\n\nText\nof two lines.") == ["", "Text of two lines."]
