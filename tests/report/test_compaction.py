"""Scripts of a page without space: they mean what they meant, and keep names and licences."""

import re

import pytest
from renderer import REPOSITORY

from lightpaint.viewer import bundled, compact_script, source, styles


@pytest.mark.parametrize(
    ("script", "compacted"),
    [
        ("const x = 3; // three\nlet y = x;\n", "const x=3;let y=x;"),
        ("a = b\nc = d\n", "a=b\nc=d"),
        ("a = b +\n  c", "a=b+\nc"),
        ("x = a + +b - -c / d", "x=a+ +b- -c/d"),
        ("f(\n  1,\n  [2, 3],\n)\n;", "f(1,[2,3],);"),
        ("const text = 'a  =  b // c';", "const text='a  =  b // c';"),
        ('say("it\'s // \\" no  comment");', 'say("it\'s // \\" no  comment");'),
        ("const t = `a  ${x + 1}  b`;", "const t=`a  ${x + 1}  b`;"),
        ("const r = /[/] '  \\/ /g; // x", "const r=/[/] '  \\/ /g;"),
        ("const q = a / b / c;", "const q=a/b/c;"),
        ("return / x'/.test(y)", "return/ x'/.test(y)"),
        ("const z = (a + b) / 2, y = 'x / y';", "const z=(a+b)/2,y='x / y';"),
        ("/*! licence */\n/* no */ x  =  1", "/*! licence */x=1"),
        ("if (a) return\nb()", "if(a)return\nb()"),
        ("a\n++b", "a\n++b"),
        ("const { a, b } = m0\nconst c = 1", "const{a,b}=m0\nconst c=1"),
        ("typeof x === 'y' && !z", "typeof x==='y'&&!z"),
    ],
)
def test_a_script_keeps_its_meaning(script: str, compacted: str) -> None:
    assert compact_script(script) == compacted
    assert compact_script(compacted) == compacted


def test_style_sheets_lose_comments_alone() -> None:
    style = styles("viewer/mixer/wipe.css")
    assert "/*" not in style
    assert style.startswith(".wipe-stage{position:relative;")


def test_a_style_sheet_has_those_that_it_imports_in_their_place() -> None:
    parts = re.findall(r'"(styles/\w+\.css)"', source("paint/page/style.css"))
    assert len(parts) > 10
    assert styles("paint/page/style.css") == "".join(styles(f"paint/page/{x}") for x in parts)
    folder = REPOSITORY / "lightpaint" / "paint" / "page"
    assert {f"styles/{sheet.name}" for sheet in folder.glob("styles/*")} == {*parts}


def test_pseudo_classes_of_descendants_stay_theirs() -> None:
    """`.a :is(.b)` is another selector than `.a:is(.b)`, also in blocks like `@container`."""
    parts = re.findall(r'"(styles/\w+\.css)"', source("paint/page/style.css"))
    descendant = re.compile(r"[\w)\]] (?:\*)?:(?:has|is|not|where)\(")
    counts = [
        sum(len(descendant.findall(text(f"paint/page/{part}"))) for part in parts)
        for text in (source, styles)
    ]
    assert counts[0] == counts[1] > 20


def test_names_and_texts_of_the_mixer_stay() -> None:
    words = re.compile(r"[\w$]{3,}")
    script = bundled("viewer/mixer/mixer.js")
    code = re.sub(r"//[^\n]*", "", script)
    assert words.findall(compact_script(script)) == words.findall(code)
