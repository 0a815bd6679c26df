"""What is loaded at the start, and when: the public names and --help wait for no library."""

import ast
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import lightpaint as lp
from lightpaint.scene.runtime import variant

#: What takes long to load, or needs a part that may be missing.
LIBRARIES = {
    *("mitsuba", "drjit", "numpy", "OpenImageIO", "OpenEXR", "PIL", "rich", "colour", "scipy"),
    *("importlib.metadata", "asyncio", "urllib.request", "json"),
}


def _loaded_by(code: str) -> set[str]:
    """Modules that a fresh Python has loaded at the end of this code."""
    code = f"import sys\ntry:\n    {code}\nexcept SystemExit: pass\nprint('\\n', *sys.modules)"
    command = [sys.executable, "-c", code]
    completed = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(completed.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "code",
    [
        "import lightpaint",
        "import lightpaint as lp; dir(lp); lp.__version__; lp.LightpaintError",
        "import lightpaint as lp; lp.Settings(spp=64, space='display')",
        *(
            f"import lightpaint.cli as c; c.main({arguments})"
            for arguments in (["--help"], ["--version"], ["solve", "--help"])
        ),
    ],
)
def test_start_loads_no_library(code: str):
    loaded = _loaded_by(code)
    assert "lightpaint" in loaded
    assert loaded & LIBRARIES <= _loaded_by("pass")  # what an editable installation loads itself


def test_a_name_loads_its_own_room_and_no_renderer():
    loaded = _loaded_by("import lightpaint as lp; lp.solve; lp.read_target; lp.display_picture")
    assert "lightpaint.lighting.solver" in loaded
    assert not loaded & {"mitsuba", "OpenImageIO", "colour", "rich", "lightpaint.pipeline.job_run"}


def test_every_public_name_is_there_and_seen_by_type_checkers():
    assert len(lp.__all__) == len(set(lp.__all__))
    assert set(lp.__all__) <= set(dir(lp))
    tree = ast.parse(Path(lp.__file__).read_text(encoding="utf-8"))
    names = {}
    for block in (node for node in tree.body if isinstance(node, ast.If)):
        if not isinstance(block.test, ast.Name):
            continue  # what type checkers leave out
        for line in block.body:
            assert isinstance(line, ast.ImportFrom)
            for name in line.names:
                assert name.asname == name.name  # which is what makes it public to them
                names[name.name] = line.module
    assert set(names) == {*lp.__all__, *lp._EXTRAS} - {"__version__"}
    for name, module in names.items():
        assert getattr(lp, name) is getattr(sys.modules[str(module)], name)
        # Not by way of a module that only imports it.
        assert getattr(lp, name).__module__ == module


def test_no_name_is_that_of_a_room():
    import lightpaint.lighting.default_solve as module

    assert module.solve is lp.solve
    for name in set(lp.__all__) - {"__version__"}:
        assert not isinstance(getattr(lp, name), type(lp))


def test_what_there_is_none_of():
    with pytest.raises(AttributeError, match="module 'lightpaint' has no attribute 'relit_scene'"):
        _ = lp.relit_scene


@pytest.mark.nightly
def test_imports_in_order_of_the_alphabet_render_as_fast_as_others() -> None:
    """Dr.Jit takes the LLVM of the system when it is imported, which may be too old."""
    code = "import lightpaint as lp, mitsuba; print(lp.use_variant().variant)"
    alone = "import lightpaint as lp; print(lp.use_variant().variant)"
    variants = [
        subprocess.run(
            [sys.executable, "-c", x], capture_output=True, text=True, check=True
        ).stdout.split()[-1]
        for x in (alone, code)
    ]
    assert variants[0] == variants[1]


def test_a_slow_backend_is_warned_of_at_every_line_that_renders(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slow = variant.Backend("scalar_rgb", note="no usable LLVM: many times slower")
    monkeypatch.setattr(variant, "_current", slow)
    monkeypatch.setattr(variant, "_check_unchanged", lambda backend: None)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(3):
            lp.use_variant()
        lp.use_variant()
    assert [Path(x.filename).name for x in caught] == ["test_start.py"] * 2
    assert len({x.lineno for x in caught}) == 2
