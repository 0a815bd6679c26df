"""Pages that somebody reads first are read once: short sentences, and no words that say nothing."""

import re
from pathlib import Path

import pytest
from test_docs import DOCUMENTS, ROOT

#: Pages of measurements, derivations and generated tables, whose readers look something up.
LOOKED_UP = {"benchmarks.md", "decisions.md", "method.md", "protocol.md"}
PAGES = [path for path in DOCUMENTS if path.name not in LOOKED_UP]

#: Most words of a sentence, and of the mean sentence of a page.
MAX_WORDS, MAX_MEAN = 45, 22

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


def test_the_checks_would_find_it() -> None:
    assert PRONOUN.findall("The flux is that of the lamp, so that of two one is off.") == [
        "that of"
    ]
    assert NO_ARTICLE.findall("It is no scene. There is no light.") == ["is no scene"]
    long = "It " + "is said " * MAX_WORDS + "here."
    assert [x for x in sentences(f"Short one. {long}") if len(x.split()) > MAX_WORDS] == [long]
    assert prose("```\ncode\n```\n\n| table |\n\nText\nof two lines.") == ["", "Text of two lines."]
