"""Every text of the page is a sentence that a translation reaches."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from page_texts import PAGE, all_sentences, calls_without_literal, faults, modules, texts_in
from painter_page import Painter

#: Texts in the code that nobody reads, by module: the name of an array.
EXCEPTIONS = {"engine/layers/layer_picture.js": ["… of halves"]}

#: A second language, in which each text stands in brackets.
BRACKETS = """
const inBrackets = { get: (_, key) => `\u27e6${key}\u27e7` };
export const LANGUAGES = { en: {}, qq: new Proxy({}, inBrackets) };
"""

#: A language with more forms than English, and without most sentences.
POLISH = """
export const LANGUAGES = { en: {}, pl: {
  '{count} light': { one: '{count} lampa', few: '{count} lampy', other: '{count} lamp' },
  'Light': 'Lampa', 'Light (theme)': 'Jasny', 'Delete': 'Usuń', 'Show {name}': 'Pokaż: {name}',
} };
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


def test_all_texts_are_marked_for_translation() -> None:
    found = {}
    for file in modules():
        if texts := texts_in(file.read_text("utf-8")):
            found[file.relative_to(PAGE).as_posix()] = texts
    assert found == EXCEPTIONS


def test_translators_are_given_all_sentences() -> None:
    """The code has them as literals; the types of `t` check the values of their names."""
    calls = {file.name: calls_without_literal(file.read_text("utf-8")) for file in modules()}
    assert {name: found for name, found in calls.items() if found} == {}
    assert len(all_sentences()) > 1000


@pytest.mark.parametrize(
    "code", ["t(text)", "t(`on ${name}`)", "t(isOn ? 'On' : 'Off')", "plural(2, forms)"]
)
def test_a_sentence_that_is_no_literal_is_found(code: str) -> None:
    assert calls_without_literal(f"const a = {code};") == [f"{code};"]


@pytest.mark.parametrize(
    ("key", "text", "fault"),
    [
        ("Lock", "Sperren", ""),
        ("Light (theme)", "Hell", ""),
        ("Show {name}", "{name} zeigen", ""),
        ("{count} light", "{count} lamp", ""),
        ("{count} light", {"one": "eine Lampe", "other": "{count} Lampen"}, ""),
        ("Lokc", "Sperren", "no sentence of the page"),
        ("Show {name}", "zeigen", "other names in braces"),
        ("Show {name}", "{Name} zeigen", "other names in braces"),
        ("{count} light", {"one": "{count} Lampe", "other": "Lampen"}, "other names in braces"),
        ("{count} light", {"one": "{n} Lampe", "other": "{count} Lampen"}, "other names in braces"),
        ("{count} light", {"one": "{count} Lampe"}, "unknown forms, or none that is called other"),
        ("Lock", {"other": "Sperren"}, "forms of a sentence that has no number"),
    ],
)
def test_a_wrong_translation(key: str, text: Any, fault: str) -> None:
    assert faults({key: text}, all_sentences()) == ([(key, fault)] if fault else [])


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


def in_language(new_painter: Any, code: str, languages: str, query: str = "") -> Painter:
    """Open a page in a language, chosen by its code as a person's choice is kept."""

    def route(context: Any) -> None:
        context.route(
            "**/language/languages.js",
            lambda route: route.fulfill(body=languages, content_type="text/javascript"),
        )

    opened: Painter = new_painter(
        query,
        init=f"localStorage.setItem('lightpaint.language', '{code}')",
        prepare=route,
        with_modules=True,
    )
    return opened


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    """A page in the second language."""
    opened = in_language(new_painter, "qq", BRACKETS, "lights=5")
    opened.page.evaluate("() => engine.makeLayers(3)")
    for _ in range(2):
        opened.page.keyboard.press("Control+s")
        opened.still()
    return opened


@pytest.mark.nightly
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


@pytest.mark.nightly
def test_a_translation_has_its_own_forms_and_may_lack_sentences(new_painter: Any) -> None:
    painter = in_language(new_painter, "pl", POLISH)
    texts = painter.page.evaluate(
        """async () => {
          const { plural, t } = await import('/language/language.js');
          const lights = (count) =>
            plural(count, { one: '{count} light', other: '{count} lights' });
          return {
            counts: [lights(1), lights(3), lights(5)],
            meanings: [
              t('Light'), t('Light', { context: 'theme' }), t('Delete', { context: 'key' }),
            ],
            names: [t('Show {name}', { name: 'a' }), t('Hide {name}', { name: 'b' })],
          };
        }"""
    )
    assert texts == {
        "counts": ["1 lampa", "3 lampy", "5 lamp"],
        "meanings": ["Lampa", "Jasny", "Usuń"],
        "names": ["Pokaż: a", "Hide b"],
    }


def test_the_translations_that_ship(page: Any, site: Any) -> None:
    """They have no sentences that the page has not, and no other names in braces."""
    languages = page.evaluate("async () => (await import('/language/languages.js')).LANGUAGES")
    sentences = all_sentences()
    assert {code: found for code, x in languages.items() if (found := faults(x, sentences))} == {}
