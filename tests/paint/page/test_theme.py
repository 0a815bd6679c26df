"""The dark and the light theme: which one is shown, and that both can be read."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from axe import violations
from nightly import nightly
from page_texts import PAGE
from painter_page import Painter

STYLES = "".join(sheet.read_text("utf-8") for sheet in sorted(PAGE.glob("styles/*.css")))

#: A colour that no custom property names.
LITERAL = re.compile(r"#[0-9a-fA-F]{3,8}\b|\brgba?\(|\bhsla?\(|:\s*(?:white|black)\b")

GROUND = "getComputedStyle(document.querySelector('.lightpaint')).backgroundColor"


def theme_of(painter: Painter) -> str:
    painter.still()
    theme = painter.page.evaluate("() => document.querySelector('.lightpaint').dataset.theme")
    is_light = painter.page.evaluate(f"() => Number({GROUND}.match(/[0-9]+/)[0]) > 128")
    assert is_light == (theme == "light")
    return str(theme)


@pytest.mark.nightly
def test_the_theme_follows_the_system_until_one_is_chosen(new_painter: Any) -> None:
    painter: Painter = new_painter(is_fresh=True, color_scheme="light")
    assert theme_of(painter) == "light"
    painter.page.emulate_media(color_scheme="dark")
    assert theme_of(painter) == "dark"
    painter.button("Solve settings").click()
    choice = painter.page.get_by_role("group", name="Theme")
    choice.get_by_role("button", name="Light").click()
    assert theme_of(painter) == "light"
    painter.page.reload()
    painter.page.wait_for_selector(".lightpaint .tag")
    assert theme_of(painter) == "light"
    painter.button("Solve settings").click()
    choice.get_by_role("button", name="System").click()
    assert theme_of(painter) == "dark"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("say", "theme"),
    [
        ("body.dataset.jpThemeLight = 'true'", "light"),
        ("body.dataset.jpThemeLight = 'false'", "dark"),
        ("body.dataset.vscodeThemeKind = 'vscode-high-contrast-light'", "light"),
        ("body.dataset.vscodeThemeKind = 'vscode-dark'", "dark"),
        ("body.classList.add('light', 'light-theme')", "light"),
        ("body.classList.add('dark', 'dark-theme')", "dark"),
    ],
)
def test_the_theme_of_a_notebook_goes_before_that_of_the_system(
    new_painter: Any, say: str, theme: str
) -> None:
    """JupyterLab, VS Code and marimo say theirs on the body, also while they change it."""
    other: Any = "dark" if theme == "light" else "light"
    painter: Painter = new_painter("shadow", is_fresh=True, color_scheme=other)
    painter.page.evaluate(f"() => {{ document.{say}; }}")
    painter.still()
    shown = painter.page.locator(".lightpaint").get_attribute("data-theme")
    assert shown == theme


def test_the_surround_of_the_pictures_has_one_grey(new_painter: Any) -> None:
    painter: Painter = new_painter(is_fresh=True)
    surround = "() => getComputedStyle(document.querySelector('.stage')).backgroundColor"
    colours = []
    for theme in ("dark", "light"):
        painter.page.emulate_media(color_scheme=theme)
        painter.still()
        colours.append(painter.page.evaluate(surround))
    assert colours[0] == colours[1]
    red, green, blue = map(int, re.findall(r"\d+", colours[0]))
    assert max(red, green, blue) - min(red, green, blue) <= 2


def test_all_colours_are_custom_properties() -> None:
    """Except those of legends, which repeat what the overlays draw in both themes."""
    rules = re.sub(r"/\*.*?\*/", "", STYLES, flags=re.DOTALL)
    found = []
    for selector, body in re.findall(r"([^{}]+)\{([^{}]*)\}", rules):
        plain = re.sub(r"^\s*--[\w-]+:[^;]*;", "", body, flags=re.MULTILINE)
        plain = re.sub(r"var\(--[\w-]+, #[0-9a-f]+\)", "", plain)
        if ".legend .is-" not in selector and LITERAL.search(plain):
            found.append((selector.strip(), LITERAL.findall(plain)))
    assert found == []


def press(name: str) -> Callable[[Painter], None]:
    return lambda painter: painter.button(name).click()


def open_light(painter: Painter) -> None:
    painter.page.evaluate("() => painter.store.set({ openLights: [0], open: { lights: true } })")


def show_layers(painter: Painter) -> None:
    painter.page.evaluate(
        "() => { engine.makeLayers(4); painter.store.set({ openLayer: 1, selectedLights: [0, 1],"
        " open: { layers: true, lights: true, history: true } }); }"
    )


def show_notices(painter: Painter) -> None:
    painter.page.evaluate(
        "() => painter.store.set({ connection: 'lost', toasts: ["
        "{ id: 1, text: 'One', tone: 'info' }, { id: 2, text: 'Two', tone: 'warn' }] })"
    )


#: What is shown when axe looks.
STATES: dict[str, Callable[[Painter], None]] = {
    "settings": press("Solve settings"),
    "shortcuts": press("Keyboard shortcuts"),
    "export": press("Export"),
    "presets": press("Presets"),
    "light": open_light,
    "layers": show_layers,
    "notices": show_notices,
    "select": press("Select"),
    "references": press("References"),
    "tour": lambda painter: painter.page.evaluate("() => painter.store.set({ tour: 2 })"),
    "lights marked": press("Lights in the picture"),
}


#: Waits until what has just appeared is opaque.
FADED_IN = """() => Promise.all(document.getAnimations().filter(({ animationName }) =>
  animationName === 'lightpaint-in').map((animation) => animation.finished))"""


@pytest.mark.parametrize("theme", [nightly("dark"), nightly("light")])
def test_axe_finds_enough_contrast_in_any_state(new_painter: Any, axe: str, theme: str) -> None:
    """That of WCAG AA. Its other rules know no theme."""
    painter: Painter = new_painter("lights=5", axe=axe, color_scheme=theme)
    first = "window.painter.store.value"
    painter.page.evaluate(f"() => {{ window.first = {first}; }}")
    found = {}
    for name, show in STATES.items():
        show(painter)
        painter.still()
        painter.page.evaluate(FADED_IN)
        if wrong := violations(painter.page, ".lightpaint", ["color-contrast"]):
            found[name] = wrong
        painter.page.evaluate("() => painter.store.set({ ...window.first })")
        painter.still()
    assert found == {}


@pytest.mark.nightly
@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_focus_is_seen(new_painter: Any, theme: str) -> None:
    """Rings have at least the contrast of 3 that WCAG asks for, on panels and over pictures."""
    painter: Painter = new_painter("lights=5", color_scheme=theme)
    contrasts = painter.page.evaluate(
        """() => {
          const luminance = (text) => {
            const [r, g, b] = text.match(/[0-9.]+/g).map((code) => {
              const x = code / 255;
              return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
            });
            return 0.2126 * r + 0.7152 * g + 0.0722 * b;
          };
          const ground = (element) => {
            const { backgroundColor: its } = getComputedStyle(element);
            return its.includes(', 0)') ? ground(element.parentElement) : its;
          };
          return ['.top .button', '.tools .button', '.light-name', '.tag'].map((where) => {
            const element = document.querySelector(where);
            const ring = document.createElement('i');
            ring.style.color = 'var(--focus)';
            element.append(ring);
            const colours = [getComputedStyle(ring).color, ground(element.parentElement)];
            const pair = colours.map(luminance);
            ring.remove();
            return (Math.max(...pair) + 0.05) / (Math.min(...pair) + 0.05);
          });
        }"""
    )
    assert min(contrasts) > 3
