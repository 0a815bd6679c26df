"""Scene files of all kinds that Mitsuba reads are edited in place, or refused in one line."""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from renderer import LIGHTS, write_room

from lightpaint.arrays import RGB
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.xml_edit import Element, XmlFile, _parse
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

BULB = LIGHTS["bulb"]
COLOUR = (0.25, 1.5, 3.0)


def lighting_of(scene: Scene, rgb: RGB) -> Lighting:
    """All lights at `rgb`."""
    return Lighting(
        tuple(LightSetting(x.name, x.plugin, x.parameter, x.unit, rgb, rgb) for x in scene.lights)
    )


def relit_text(scene: Scene, folder: Path, rgb: RGB = COLOUR) -> str:
    """Relight all lights to `rgb`, see that they took it, and return the XML."""
    relit = relight(scene, lighting_of(scene, rgb), folder / "out" / "relit.xml")
    assert [x.name for x in relit.lights] == [x.name for x in scene.lights]
    for light in relit.lights:
        np.testing.assert_array_equal(np.float32(light.emission), np.float32(rgb))
    return (folder / "out" / "relit.xml").read_text(encoding="utf-8")


def rewrite(path: Path, change: Callable[[str], str], encoding: str = "utf-8") -> Path:
    path.write_bytes(change(path.read_text(encoding="utf-8")).encode(encoding))
    return path


# What Mitsuba's parser puts up with.


@pytest.mark.parametrize(
    "lights",
    [
        BULB.replace('id="bulb"', "id=\"bulb & <panel> '2'\""),
        BULB.replace('id="bulb"', "id='a &lt; &#98; &#x43; &quot;d&quot; &unknown;'"),
        f"<!-- -- {LIGHTS['sun']} -- --->{BULB}",
        f"<!--> {LIGHTS['sun']} -->{BULB}",
        f"<![CDATA[ <emitter> ]] > ]]>{BULB}",
        f"<?note <emitter> > ?>{BULB}",
        f"loose & text > here {BULB}",
        BULB.replace('type="point"', "type\n=\n'point'").replace("</emitter>", "</emitter\n>"),
    ],
    ids=["raw", "references", "comment", "short", "cdata", "instruction", "text", "spaces"],
)
def test_lenient_xml_is_relit(tmp_path: Path, lights: str) -> None:
    scene = load_scene(write_room(tmp_path, lights=lights))
    assert len(scene.lights) == 1
    text = relit_text(scene, tmp_path)
    assert lights.partition('<rgb name="intensity"')[0] in text


@pytest.mark.parametrize(
    ("before", "suffix"),
    [
        ('\n  <?xml version="1.0"?>\n', ""),
        ('<!-- x --><?xml version="1.0" encoding="utf-8"?>', ""),
        ("<!DOCTYPE scene>", ""),
        ('<!DOCTYPE scene SYSTEM "a>b" [<!ENTITY c "<d>"> <!-- \' > --> <?e >?>]>', ""),
        ("stray text", "<scene/> or </anything>"),
        ("\ufeff", "<!-- -- -->"),
    ],
)
def test_around_the_root(tmp_path: Path, before: str, suffix: str) -> None:
    path = rewrite(write_room(tmp_path), lambda text: before + text + suffix)
    if "</anything>" in suffix:
        with pytest.raises(SceneError, match="Mitsuba refuses"):
            load_scene(path)
        path = rewrite(path, lambda text: text.replace("</anything>", ""))
    text = relit_text(load_scene(path), tmp_path)
    assert text.startswith(before)


@pytest.mark.parametrize(
    ("encoding", "declared"),
    [
        ("latin-1", "<?xml version='1.0' encoding='Latin1'?>"),
        ("utf-16-le", ""),
        ("utf-32-be", ""),
        # Mitsuba knows no others, and takes these bytes for UTF-8.
        ("cp1252", '<?xml version="1.0" encoding="windows-1252"?>'),
        ("latin-1", '\n<?xml version="1.0" encoding="ISO-8859-1"?>'),
        ("latin-1", ""),
    ],
)
def test_encodings_as_mitsuba_guesses_them(tmp_path: Path, encoding: str, declared: str) -> None:
    path = rewrite(write_room(tmp_path), lambda text: f"{declared}<!-- Bühne -->{text}", encoding)
    scene = load_scene(path)
    relit = relight(scene, lighting_of(scene, COLOUR), tmp_path / "out" / "relit.xml")
    assert {x.emission for x in relit.lights} == {COLOUR}
    assert "<!-- Bühne -->".encode(encoding) in relit.path.read_bytes()


# Old scenes.


def old_room(folder: Path, lights: str, version: str = "0.5.0") -> Path:
    """A file of lights in the spelling of old, included by today's room."""
    (folder / "old.xml").write_text(f'<scene version="{version}">{lights}</scene>', "utf-8")
    return write_room(folder, lights='<include filename="old.xml"/>')


WEIGHED = BULB.replace("</emitter>", '<float name="samplingWeight" value="2"/></emitter>')


@pytest.mark.parametrize("version", ["0.5.0", " 1.99.9"])
def test_old_scenes_keep_their_spelling(tmp_path: Path, version: str) -> None:
    scene = load_scene(old_room(tmp_path, WEIGHED + LIGHTS["sky"], version))
    bulb, sky = scene.lights
    emission: dict[str, RGB] = {bulb.name: (0, 0, 0), sky.name: COLOUR}
    lighting = Lighting(
        tuple(
            LightSetting(x.name, x.plugin, x.parameter, x.unit, emission[x.name], emission[x.name])
            for x in scene.lights
        )
    )
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    relit.load()
    assert [x.sampling_weight for x in relit.emitters] == [0, 1]
    text = (tmp_path / "out" / "old.xml").read_text("utf-8")
    assert text.count("samplingWeight") == 1
    assert "sampling_weight" not in text


def test_old_root_and_insertion_into_it(tmp_path: Path) -> None:
    lights = LIGHTS["sky"] + WEIGHED.replace('value="2"', 'value="0"')
    path = rewrite(
        write_room(tmp_path, lights=lights),
        lambda text: text.replace('version="3.0.0"', 'version="1.2.0"'),
    )
    text = relit_text(load_scene(path), tmp_path)
    assert '<float name="samplingWeight" value="1"/>' in text


def test_old_factors_are_scaled_in_their_place(tmp_path: Path) -> None:
    sun = '<emitter type="sunsky" id="day"><float name="sunScale" value="2"/></emitter>'
    scene = load_scene(old_room(tmp_path, sun))
    relit = relight(scene, lighting_of(scene, (3, 3, 3)), tmp_path / "out" / "relit.xml")
    relit.load()
    text = (tmp_path / "out" / "old.xml").read_text("utf-8")
    assert '<float name="sunScale" value="6"/>' in text
    assert '<float name="sky_scale" value="3"/>' in text


def test_names_are_converted_as_mitsuba_does() -> None:
    names = ["samplingWeight", "fooBARBaz", "aB1C", "XYz", "sampling_weight"]
    body = "".join(f'<float name="{name}"/>' for name in names)
    old, _ = _parse(f'<scene version="0.6.0">{body}</scene>'.encode())
    # Read off from Mitsuba 3.9.
    assert [c.name for c in old.children] == [
        *("sampling_weight", "foo_barbaz", "a_b1C", "XYz", "sampling_weight")
    ]
    new, _ = _parse(f'<scene version="2.0.0">{body}</scene>'.encode())
    assert [c.name for c in new.children] == names


# What cannot be edited.


def test_parameter_in_a_name_is_refused(tmp_path: Path) -> None:
    lights = BULB.replace('name="intensity"', 'name="$nm"')
    scene = load_scene(write_room(tmp_path, lights=lights), parameters={"nm": "intensity"})
    with pytest.raises(SceneError, match=r"line \d+: <rgb name='\$nm'>.*'bulb'") as refusal:
        relit_text(scene, tmp_path)
    line = next(
        k for k, x in enumerate(scene.path.read_text("utf-8").splitlines(), 1) if "$nm" in x
    )
    assert f"room.xml, line {line}:" in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert not (tmp_path / "out").exists()


def test_parameter_in_another_name_does_no_harm(tmp_path: Path) -> None:
    lights = LIGHTS["beam"].replace('name="cutoff_angle"', 'name="$nm"')
    scene = load_scene(write_room(tmp_path, lights=lights), parameters={"nm": "cutoff_angle"})
    assert 'name="$nm"' in relit_text(scene, tmp_path)


def test_dollar_in_the_folder_is_refused(tmp_path: Path) -> None:
    home = tmp_path / "a$b"
    home.mkdir()
    scene = load_scene(write_room(home))
    with pytest.raises(SceneError, match=r"a\$b.*rename the folder"):
        relit_text(scene, tmp_path)
    assert not (tmp_path / "out").exists()
    # Beside the original there is nothing to write down.
    relight(scene, lighting_of(scene, COLOUR), home / "relit.xml")


def test_dollar_in_a_value_is_refused() -> None:
    assert tag("default", name="x", value='1 < "2"') == """<default name="x" value='1 &lt; "2"'/>"""
    with pytest.raises(SceneError, match=r"\$ as the start of a parameter.* parameters=\.\.\."):
        tag("default", name="x", value="a$b")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<scene>\n<emitter>\n</scene>", "line 3: </scene> closes <emitter> of line 2"),
        ("<scene>\n<emitter/>\n", "<scene> of line 1 has no end tag"),
        ("\n</scene>", "line 2: </scene> closes nothing"),
        ("<scene>\n<emitter type=point/></scene>", "line 2: cannot read '<emitter type=point/>"),
        ("<scene><!-- ", "line 1: cannot read '<!--'"),
        ("", "it has no element"),
    ],
)
def test_broken_tags_are_one_line_with_the_file(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as refusal:
        XmlFile(path)
    assert str(refusal.value).startswith(f"cannot edit {path}: {message}")
    assert "\n" not in str(refusal.value)


def test_no_light_at_an_offset(tmp_path: Path) -> None:
    xml = XmlFile(write_room(tmp_path))
    with pytest.raises(SceneError, match="has it changed"):
        xml.element_at(xml.root.start + 1)


# Line breaks.


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_inserted_lines_end_as_the_others(tmp_path: Path, newline: str) -> None:
    lights = """<emitter type="point" id="empty"/>
    <emitter type="constant" id="inside">
        <!-- nothing -->
    </emitter>"""
    path = rewrite(
        write_room(tmp_path, lights=lights), lambda text: text.replace("\n", newline), "utf-8"
    )
    scene = load_scene(path)
    relight(scene, lighting_of(scene, COLOUR), tmp_path / "out" / "relit.xml")
    content = (tmp_path / "out" / "relit.xml").read_bytes()
    assert content.count(b"\n") > path.read_bytes().count(b"\n")
    assert content.count(b"\n") == content.count(newline.encode())
    assert content.count(b"\r") == (content.count(b"\n") if newline == "\r\n" else 0)


def test_insertion_before_a_replacement_at_the_same_place(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_text("<a><b/></a>", encoding="utf-8")
    for insert_first in (True, False):
        xml = XmlFile(path)
        if insert_first:
            xml.insert_first(xml.root, ["<c/>"])
        xml.replace(xml.root.children[0], "<d/>")
        if not insert_first:
            xml.insert_first(xml.root, ["<c/>"])
        assert xml.edited() == b"<a>\n    <c/><d/></a>"


# The scanner against another parser.

NAMES = st.from_regex(r"[A-Za-z_é][A-Za-z0-9_.é-]{0,5}", fullmatch=True)
VALUES = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cc", "Cs"), exclude_characters="￾￿")
    | st.sampled_from("<>&'\"\n\t$"),
    max_size=8,
)
BETWEEN = st.sampled_from(
    ["", " ", "\n  ", "\r\n", "text > ]", "<!-- <a b='> - -->", "<![CDATA[<a></b>]]>", "<?p <a> ?>"]
)


@st.composite
def quoted(draw: st.DrawFn) -> str:
    """A value in quotes of either kind, as well-formed XML."""
    quote, name = draw(st.sampled_from([('"', "&quot;"), ("'", "&apos;")]))
    value = escape(draw(VALUES), {quote: name})
    if value and draw(st.booleans()) and "&" not in value:
        value = draw(st.sampled_from(["&#{};", "&#x{:x};"])).format(ord(value[0])) + value[1:]
    return f"{quote}{value}{quote}"


@st.composite
def trees(draw: st.DrawFn, depth: int = 3) -> str:
    name = draw(NAMES)
    space = st.sampled_from([" ", "\n", " \t"])
    attributes = "".join(
        f"{draw(space)}{key}{draw(st.sampled_from(['=', ' = ']))}{draw(quoted())}"
        for key in draw(st.lists(NAMES, max_size=3, unique=True))
    )
    children = draw(st.lists(trees(depth - 1), max_size=3)) if depth else []
    if not children and draw(st.booleans()):
        return f"<{name}{attributes}/>"
    body = "".join(draw(BETWEEN) + child for child in children) + draw(BETWEEN)
    return f"<{name}{attributes}>{body}</{name}{draw(st.sampled_from(['', ' ']))}>"


@pytest.mark.nightly
@given(tree=trees(), before=st.sampled_from(["", '<?xml version="1.0"?>\n', "<!DOCTYPE a>"]))
def test_scanner_finds_the_tree_that_another_parser_finds(tree: str, before: str) -> None:
    text = (before + tree).encode()
    root, elements = _parse(text)
    assert_same(root, ElementTree.fromstring(text))
    for offset, element in elements.items():
        assert element.start == offset
        opening = f"<{element.tag}".encode()
        assert text[offset:].startswith(opening)
        closing = b"/>" if element.is_empty_tag else f"</{element.tag}".encode()
        assert closing in text[offset : element.end]
        assert text[element.inner - 1 : element.inner] == b">"
        assert text[element.end - 1 : element.end] == b">"
        # An element cut out is a file of its own.
        assert_same(element, ElementTree.fromstring(text[offset : element.end]))


def assert_same(actual: Element, expected: ElementTree.Element) -> None:
    assert actual.tag == expected.tag
    assert dict(actual.attributes) == expected.attrib
    assert len(actual.children) == len(expected)
    for child, other in zip(actual.children, expected, strict=True):
        assert_same(child, other)


def test_a_broken_doctype_is_given_up_in_time() -> None:
    with pytest.raises(ValueError, match=r"line 1: cannot read .<!DOCTYPE"):
        _parse(b"<!DOCTYPE a [" + b"<!-- x --> <!b 'c'> <?d?>" * 2000)
