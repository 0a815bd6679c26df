"""The JSON schemas of the site: what lightpaint writes and reads fits them, and nothing else."""

import json
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from nightly import nightly
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.batch.gallery.summary import LightRow, SummaryRow, summary_json
from lightpaint.batch.manifest.keys import (
    DEFAULT_KEYS,
    FINAL_KEYS,
    HANDOVER_KEYS,
    LOOK_KEYS,
    SEQUENCE_KEYS,
    SETTINGS,
)
from lightpaint.relit.export.fixtures import COLUMNS, fixtures_csv, fixtures_json
from lightpaint.validation import Check

pytest.importorskip("sphinx", reason="sphinx")
jsonschema = pytest.importorskip("jsonschema", reason="jsonschema")
sys.path.insert(0, str(REPOSITORY / "docs" / "site"))

from field_pages import described, fields_of  # noqa: E402
from schema_pages import DESCRIBED_ELSEWHERE, schemas  # noqa: E402

SCHEMAS = {name: schema for name, (_, schema) in schemas().items()}

#: Values of all kinds that a file may have in any place.
VALUES: list[Any] = [
    *("", "a", "1/4", "linear", "display", "white", "places", "log", "over", "polished", "preview"),
    *(True, False, -1, 0, 1, 2, 33, 10_001, 2**40, -0.5, 0.0, 1e-5, 0.5, 1.0, 1.5, 1e29),
    *([], [1], ["a"], ["solve"], ["solve", "solve"], ["predict"], ["csv"], ["warmer"], [""]),
    *({}, {"a": 1}, {"a": "b"}, {"a": ""}, {"a": ["b"]}, {"a": []}, {"spp": 8}, {"spp": "8"}),
]


def fits(value: Any, name: str) -> bool:
    """Whether a value fits a schema."""
    return bool(jsonschema.Draft202012Validator(SCHEMAS[name]).is_valid(value))


def test_every_schema_is_one() -> None:
    for schema in SCHEMAS.values():
        jsonschema.Draft202012Validator.check_schema(schema)


@pytest.mark.parametrize("name", sorted({*SCHEMAS} - {*DESCRIBED_ELSEWHERE}))
def test_every_field_of_a_file_has_a_meaning(name: str) -> None:
    """The documents leave them to the page of fields."""
    meanings = {path: field.get("description", "") for path, field in fields_of(SCHEMAS[name])}
    assert [path for path, meaning in meanings.items() if len(meaning) < 3] == []
    assert [path for path, meaning in meanings.items() if "None" in meaning] == []


def test_a_meaning_of_no_field_is_found() -> None:
    with pytest.raises(KeyError, match="basis"):
        described("report", {"type": "object", "properties": {}})


def test_a_lighting_that_is_written_fits_its_schema(tmp_path: Path) -> None:
    light = {"plugin": "point", "parameter": "intensity", "unit": "W/sr"}
    light |= {"emission": [1.0, 0.5, 0.25], "weight": [1.0, 0.5, 0.25]}
    text = json.dumps({"format": "lightpaint-lighting 1", "lights": {"lamp": light}})
    (tmp_path / "first.json").write_text(text, "utf-8")
    lp.write_lighting(tmp_path / "second.json", lp.read_lighting(tmp_path / "first.json"))
    written = json.loads((tmp_path / "second.json").read_text("utf-8"))
    jsonschema.validate(written, SCHEMAS["lighting"])
    for damage in ({"format": "other"}, {"lights": {"lamp": {**light, "emission": [1.0]}}}):
        assert not fits({**written, **damage}, "lighting")


def test_a_summary_that_is_written_fits_its_schema() -> None:
    light = LightRow("lamp", 1.0, (1.0, 1.0, 1.0), kelvin=3200.0, drives={"red": 0.5})
    done = SummaryRow("dusk", "done", "", "dusk", delta_e=1.5, view=("srgb", 0.0), lights=(light,))
    failed = SummaryRow("dawn", "failed", "no such painting", "dawn")
    written = json.loads(summary_json([done, failed]))
    jsonschema.validate(written, SCHEMAS["summary"])
    unknown_state = {**written["looks"][0], "state": "lost"}
    for looks in ([{"look": "dusk"}], [unknown_state]):
        assert not fits({**written, "looks": looks}, "summary")


def tables() -> Iterator[tuple[Mapping[str, Check], list[str]]]:
    """Each table of a manifest: its keys, and where its schema stands."""
    look = ["look", "items"]
    yield DEFAULT_KEYS, ["defaults"]
    yield LOOK_KEYS, look
    yield SEQUENCE_KEYS, ["sequence", "items"]
    for top in (["defaults"], look):
        yield SETTINGS, [*top, "settings"]
        yield FINAL_KEYS, [*top, "render"]
        yield HANDOVER_KEYS, [*top, "export"]


@pytest.mark.parametrize(("keys", "path"), [*tables()], ids=lambda x: ".".join(x))
def test_the_schema_of_a_manifest_expects_what_the_code_does(
    keys: Mapping[str, Check], path: list[str]
) -> None:
    schema = SCHEMAS["manifest"]
    for name in path:
        schema = schema["items"] if name == "items" else schema["properties"][name]
    assert set(schema["properties"]) == set(keys)
    for key, check in keys.items():
        validator = jsonschema.Draft202012Validator(schema["properties"][key])
        # Tables within have keys of their own, which other rows of this test try.
        is_table = isinstance(schema["properties"][key].get("additionalProperties"), bool)
        if key == "constraints" or is_table:
            assert not validator.is_valid([1])
            continue
        for value in VALUES:
            # JSON has one kind of numbers, of which 1.0 is a whole one.
            if isinstance(value, float) and value.is_integer():
                continue
            assert validator.is_valid(value) == bool(check.is_valid(value)), (key, value, check)


@pytest.mark.parametrize("path", sorted((REPOSITORY / "scenes").glob("*/*looks*.toml")), ids=str)
def test_manifests_fit_their_schema(path: Path) -> None:
    jsonschema.validate(tomllib.loads(path.read_text("utf-8")), SCHEMAS["manifest"])


def test_the_manifest_that_is_explained_fits_its_schema() -> None:
    page = (REPOSITORY / "docs" / "batch.md").read_text("utf-8")
    texts = [x for x in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[look]]" in x]
    for text in texts:
        manifest = tomllib.loads(text)
        jsonschema.validate(manifest, SCHEMAS["manifest"])
    for table in ("light = 1", "light.key = { lok = true }", "tie = 1", "prefr_current = 0.1"):
        wrong = tomllib.loads(f"[[look]]\npainting = 'a'\n[look.constraints]\n{table}")
        assert not fits(wrong, "manifest")
    assert not fits({**manifest, "looks": []}, "manifest")


@pytest.mark.parametrize("options", [nightly({}), {"space": "display", "hold": 1.0}])
def test_a_report_that_is_written_fits_its_schema(tmp_path: Path, options: Any) -> None:
    folder, scene = tmp_path / "out", REPOSITORY / "scenes/cornell/scene.xml"
    target = lp.read_target(REPOSITORY / "targets/cornell/warm.exr")
    constraints = lp.Constraints.of({"ceiling": {"lock": "50%"}, "window": {"off": True}})
    options |= {"spp": 4, "resolution": "1/4", "resize": True, "use_cache": False}
    lp.paint_with_light(scene, target, folder, constraints=constraints, **options)
    written = json.loads((folder / "report.json").read_text("utf-8"))
    jsonschema.validate(written, SCHEMAS["report"])
    assert written["missed"]["bounds"]
    # Nothing may be there that the schema does not know.
    for part in ("basis", "seen", "fit", "missed", "meant", "uncertainty", "verification"):
        assert not fits({**written, part: {**written[part], "unknown": 1}}, "report")
        assert not fits({**written, part: [1]}, "report")


def test_fixtures_that_are_written_fit_their_schema(make_basis: Any) -> None:
    lighting = lp.Lighting.current(make_basis(2))
    written = json.loads(fixtures_json(lighting))
    jsonschema.validate(written, SCHEMAS["fixtures"])
    wrong = {**written["fixtures"][0], "red": "bright"}
    assert not fits({**written, "fixtures": [wrong]}, "fixtures")


def test_the_columns_of_fixtures_are_those_that_are_explained(make_basis: Any) -> None:
    page = (REPOSITORY / "docs" / "formats.md").read_text("utf-8")
    _, _, section = page.partition("The columns of `fixtures.csv`")
    table, _, _ = section.partition("\n- **")
    rows = re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
    explained = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert explained == ["frame", *COLUMNS]
    head, *_ = fixtures_csv(lp.Lighting.current(make_basis(2))).splitlines()
    assert head.split(",") == list(COLUMNS)
