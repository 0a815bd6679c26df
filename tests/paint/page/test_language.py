"""Every text of the page comes from its language file, so that another file translates all."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from page_texts import texts_in
from painter_page import Painter
from renderer import REPOSITORY

PAGE = REPOSITORY / "lightpaint" / "paint" / "page"

#: Texts in the code that nobody reads, by module: the name of an array.
EXCEPTIONS = {"engine/layers/layer_picture.js": ["… of halves"]}

#: A second language, in which each text stands in brackets.
BRACKETS = """
import { en } from './en.js';
const inBrackets = (texts) => typeof texts === 'string' ? `\u27e6${texts}\u27e7`
  : Object.fromEntries(Object.entries(texts).map(([name, text]) => [name, inBrackets(text)]));
export const LANGUAGES = { en, qq: inBrackets(en) };
"""

#: What a person reads, hears or sees under the pointer, without the texts of session and person.
READ = """() => {
  const { lights, looks, views, headline, sentences, advice, history, state, layers, rig }
    = window.painter.store.value;
  const data = JSON.stringify([lights, looks, views, headline, sentences, advice, history,
    state.objects, state.scene, state.folder, state.transforms, state.presets, layers,
    rig?.surfaces]);
  const texts = [];
  const walk = (node) => {
    if (node.nodeType === Node.TEXT_NODE) return texts.push(node.textContent);
    if (node.nodeType !== Node.ELEMENT_NODE || !node.checkVisibility?.()) return undefined;
    for (const name of ['aria-label', 'data-tip', 'placeholder', 'aria-valuetext'])
      if (node.hasAttribute(name)) texts.push(node.getAttribute(name));
    return node.childNodes.forEach(walk);
  };
  walk(document.querySelector('.lightpaint'));
  return [texts.map((text) => text.trim()).filter(Boolean), data];
}"""


def outside_brackets(text: str) -> str:
    """Return a text without its bracketed parts, which may be inside each other."""
    while "\u27e6" in text:
        shorter = re.sub("\u27e6[^\u27e6\u27e7]*\u27e7", "", text)
        if shorter == text:
            break
        text = shorter
    return text


def untranslated(painter: Painter) -> set[str]:
    painter.still()
    texts, data = painter.page.evaluate(READ)
    known = sorted({one for one in strings(json.loads(data)) if len(one) > 1}, key=len)[::-1]
    found = set()
    for text in texts:
        rest = outside_brackets(text)
        for one in known:
            rest = rest.replace(one, "")
        rest = re.sub(r"#[0-9a-f]{6}\b|\b[A-Z]\b", "", rest)
        if re.search("[A-Za-z]", rest):
            found.add(text)
    return found


def strings(value: Any) -> list[str]:
    if isinstance(value, str):
        return [value]
    values = value.values() if isinstance(value, dict) else value
    return (
        [one for part in values for one in strings(part)] if isinstance(value, dict | list) else []
    )


def test_no_text_stands_in_the_code() -> None:
    found = {}
    for file in sorted(PAGE.rglob("*.js")):
        name = file.relative_to(PAGE).as_posix()
        if not name.startswith(("vendor/", "language/")):
            found[name] = texts_in(file.read_text())
    assert {name: texts for name, texts in found.items() if texts} == EXCEPTIONS


@pytest.mark.parametrize(
    "code",
    [
        "const a = html`<p>Some words</p>`;",
        "const a = html`<p>${count} lights</p>`;",
        'const a = html`<button aria-label="stop">x</button>`;',
        'const a = html`<div>${open && html`<${Button} label="Close" />`}</div>`;',
        "app.session.toast('Nothing was exported.');",
        "const tip = `Load ${name} again`;",
        "const CHOICES = [{ value: 'a', label: 'all' }];",
    ],
)
def test_a_text_in_the_code_is_found(code: str) -> None:
    assert texts_in(code)


def show(changes: str) -> Callable[[Painter], None]:
    return lambda painter: painter.page.evaluate(f"() => painter.store.set({changes})")


ALL_FOLDS = (
    "{ open: { colour: true, ask: true, layers: true, history: true, lights: true, select: true,"
    " truth: true, plan: true }, openLights: [0, 1], openLayer: 1 }"
)

#: States of the page that together show most of its texts.
STATES: dict[str, Callable[[Painter], None]] = {
    "first": show("{}"),
    "panels": show(ALL_FOLDS),
    "settings": show("{ panel: 'settings' }"),
    "shortcuts": show("{ dialog: 'keys' }"),
    "export": show("{ dialog: 'export' }"),
    "render": show("{ dialog: 'render' }"),
    "looks": show("{ dialog: 'looks' }"),
    "presets": show("{ dialog: 'presets' }"),
    "lights": show("{ selectedLights: [0, 1], master: 0.5, solo: [0], openLights: [0] }"),
    "marked": show("{ areLampsMarked: true, lamp: 0, openLights: [0] }"),
    "select": show("{ tool: 'select', open: { select: true } }"),
    "gradient": show("{ tool: 'gradient' }"),
    "adjust": show("{ tool: 'adjust', dragAdjustment: { stops: 1, mired: 20 } }"),
    "importance": show(
        "{ tool: 'weight', display: { ...painter.store.value.display, overlay: 'missed' } }"
    ),
    "tour": show("{ tour: 2 }"),
    "references": show("{ isReferenceOpen: true }"),
    "lost": show("{ connection: 'lost', lostStrokes: 3 }"),
    "wall": show("{ mix: { a: 1, b: 2, share: 1, more: [] } }"),
    "comparison": show("{ mix: { a: 1, b: 2, share: 0.5 } }"),
}


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    """A page in the second language, chosen by its code as a person's choice is kept."""

    def route(context: Any) -> None:
        context.route(
            "**/language/languages.js",
            lambda route: route.fulfill(body=BRACKETS, content_type="text/javascript"),
        )

    opened: Painter = new_painter(
        "lights=5",
        init="localStorage.setItem('lightpaint.language', 'qq')",
        prepare=route,
        with_modules=True,
    )
    opened.page.evaluate("() => engine.makeLayers(3)")
    for _ in range(2):
        opened.page.keyboard.press("Control+s")
        opened.still()
    return opened


def test_another_language_replaces_all_texts(painter: Painter) -> None:
    painter.page.evaluate("() => { window.first = window.painter.store.value; }")
    found = {}
    for name, bring in STATES.items():
        bring(painter)
        if texts := untranslated(painter):
            found[name] = sorted(texts)
        painter.page.evaluate("() => painter.store.set({ ...window.first })")
    assert found == {}


@pytest.mark.nightly
def test_a_language_is_chosen_in_the_settings(painter: Painter) -> None:
    """It is there when the page opens next, and says on its element which one it is."""
    kept = "() => localStorage.getItem('lightpaint.language')"
    assert painter.page.locator(".lightpaint").get_attribute("lang") == "qq"
    painter.page.evaluate("() => painter.store.set({ panel: 'settings' })")
    painter.choose("⟦Language⟧", "en")
    assert painter.page.evaluate(kept) == "en"


def test_languages_have_the_same_placeholders(painter: Painter) -> None:
    """A translation that misses one shows less, one that adds one shows braces."""
    wrong = painter.page.evaluate(
        """async () => {
          const { LANGUAGES } = await import('/language/languages.js');
          const { en } = LANGUAGES;
          const holders = (text) => [...new Set(JSON.stringify(text).match(/\\{\\w+\\}/g))].sort();
          return Object.entries(LANGUAGES).flatMap(([code, words]) =>
            Object.keys(en).flatMap((part) => Object.keys(en[part]).filter((name) =>
              String(holders(words[part][name])) !== String(holders(en[part][name]))
            ).map((name) => [code, part, name])));
        }"""
    )
    assert wrong == []
