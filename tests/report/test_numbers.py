"""Every number of the report stands in a file, and writing it neither solves nor sums anew."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly

from lightpaint import threads
from lightpaint.basis.light_basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.estimate import Estimate
from lightpaint.lighting import solver as solve_module
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.unknowns import reduced_problem
from lightpaint.pipeline.look import Look, write_report
from lightpaint.placement.suggestion import Suggestion
from lightpaint.relit.verification import compare
from lightpaint.target.painted_target import Target

SIZE = (24, 32)

#: What holds no result: headings, the command, versions.
FIXED = {"style", "script", "pre", "footer", "thead", "title", "option"}


class Words(HTMLParser):
    """What a page shows, and the words of its pictures."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.shown: list[str] = []
        self._open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.shown += [f" {value} " for key, value in attrs if key in ("alt", "title") and value]
        if tag not in ("meta", "link", "img", "input", "br", "wbr"):
            self._open.append(tag)
            self.shown.append(" ")

    def handle_endtag(self, tag: str) -> None:
        self._open.pop()
        self.shown.append(" ")

    def handle_data(self, data: str) -> None:
        if not set(self._open) & FIXED:
            self.shown.append(data)


def _look(make_basis: Any, *, lights: Any = None, **options: Any) -> Look:
    rng = np.random.default_rng(3)
    images = rng.random((5, *SIZE, 3)) + 3 * rng.random((5, 1, 1, 3))
    noise = rng.normal(0, 0.01, (2, *images.shape))
    basis = make_basis(
        images=images + noise[0],
        half_differences=noise[1],
        names=["key", "fill", "back", "rim", "sky"],
        emission=[*rng.random((4, 3)).tolist(), (1, 1, 1)],
        seen=rng.random(SIZE) < 0.1,
    )
    emitters = [replace(light, unit_flux=(3.0, 3.1, 3.2)) for light in basis.lights]
    emitters[-1] = replace(emitters[-1], is_fixed=True)
    basis = replace(basis, lights=tuple(emitters))
    image = np.einsum("nhwc,nc->hwc", images, rng.random((5, 3)) * [1, 0.6, 0.3])
    image = (image * rng.uniform(0.7, 1.2, (*SIZE, 1))).astype(np.float32)
    target = Target(
        *("dusk", image, rng.random(SIZE, np.float32), False),
        not_finite=5,
        at_least=image > 3,
        transform=ViewTransform("srgb", -1.5),
    )
    constraints = Constraints.of(lights, **options) if options else None
    solution = solve(basis, target, constraints=constraints, transform=target.transform)
    solution = replace(solution, lighting=replace(solution.lighting, cd_per_unit=120.0))
    [analysis] = analyse(solution)
    predicted = combine(basis, analysis.solution.lighting)
    noisy = rng.normal(0, 0.01, (2, *image.shape)).astype(np.float32)
    verified = Estimate(predicted.image + noisy[0], noisy[1])
    small = image[::3, ::4]
    numbers = ((1.23, 4.567, -2.5), (0.3, 0.21, 0.17))
    lamp = Suggestion("lamp", *numbers, 0.34, 0.61, "<emitter/>", (0.3, 0.4), small, small)
    lamp_off = replace(lamp, name="more", gain_share=0.11, missed_share=0.49)
    return Look(
        target=target,
        basis=basis,
        solution=analysis.solution,
        predicted=predicted,
        relit=None,
        verification=compare(predicted, verified),
        analysis=analysis,
        suggestions=(lamp, lamp_off),
    )


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _numbers(one)
    elif isinstance(value, int | float):
        yield float(value)


def _is_one_of(text: str, known_numbers: Any) -> bool:
    """Whether a printed number is one that is known, or it in percent, as far as its digits say."""
    mantissa, _, exponent = text.partition("e")
    step = 0.5 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    # A general format drops zeros at the end, and so may say less than it looks.
    step = max(step, 0.5 * 10.0 ** (np.floor(np.log10(max(abs(float(text)), 1e-300))) - 3))
    pool = np.concatenate([known_numbers, 100 * known_numbers])
    return bool((np.abs(pool - abs(float(text))) <= step * (1 + 1e-6)).any())


ASKED: list[dict[str, Any]] = [
    {},
    {"sparse": 2},
    {"lights": {"key": {"color": "3200K"}, "fill": {"off": True}}, "sparse": 3},
]


@pytest.mark.parametrize("options", [*map(nightly, ASKED[:2]), ASKED[2]])
def test_every_number_of_the_page_stands_in_a_file(
    make_basis: Any, tmp_path: Path, options: Any
) -> None:
    look = _look(make_basis, **options)
    write_report(tmp_path, look, command="lightpaint solve")
    write_lighting(tmp_path / "lighting.json", look.lighting)
    files = [json.loads((tmp_path / f"{name}.json").read_text()) for name in ("report", "lighting")]
    fit, solved = files[0]["fit"], files[1]["solve"]
    # What docs/formats.md says is derived.
    norm2, errors = np.array(fit["norm2"]), np.array(solved["objective_error"])
    derived = [*np.sqrt(solved["relative_objective"]), fit["missed"] ** 2]
    derived += [*(errors / norm2), errors.sum() / norm2.sum()]
    lights = files[0]["lights"].values()
    derived += [x["relative_error"] * x["share"] for x in lights if "relative_error" in x]
    constants = [0, 1, 95, 255]
    known_numbers = np.abs(np.concatenate([list(_numbers(files)), derived, constants]))
    text = "".join(Words((tmp_path / "report.html").read_text(encoding="utf-8")).shown)
    visible_text = text.split("Change the painting")[0].replace("−", "-")
    visible_text = re.sub(r"#[0-9a-f]{6}|8×8|95 of 100|ΔE2000|at [-+\d.]+ stops", "", visible_text)
    numbers = re.findall(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", visible_text)
    assert len(numbers) > 150
    assert [number for number in numbers if not _is_one_of(number, known_numbers)] == []


def test_writing_neither_solves_nor_sums_anew(
    make_basis: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    look = _look(make_basis, sparse=2)
    calls: list[str] = []

    def count(owner: Any, name: str) -> None:
        plain = getattr(owner, name)

        def count_calls(*arguments: Any, **options: Any) -> Any:
            calls.append(name)
            return plain(*arguments, **options)

        monkeypatch.setattr(owner, name, count_calls)

    count(solve_module, "_solution")
    count(reduced_problem.ReducedSolver, "_solve_blocks")
    count(solve_module, "descend")
    count(Basis, "mix")
    count(Basis.__dict__["totals"], "func")
    # One that has kept nothing yet.
    basis = replace(look.basis, planes=look.basis.images.copy())
    write_report(tmp_path, replace(look, basis=basis), command="")
    # Of all lights: the current look, and what is shown of other answers.
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    others = len(re.findall(r"<strong>(Without constraints|With the constraints|With \d)", page))
    assert others > 2
    assert calls.count("mix") == 1 + others
    assert calls.count("func") == 1
    assert set(calls) == {"mix", "func"}


def test_no_picture_is_encoded_twice(
    make_basis: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The current look lies behind half of the pictures."""
    look = _look(make_basis)
    plain, encoded = ViewTransform.encode, []

    def count_encoding(self: ViewTransform, image: Any) -> Any:
        encoded.append(np.asarray(image).tobytes())
        return plain(self, image)

    monkeypatch.setattr(ViewTransform, "encode", count_encoding)
    # Two threads that need the same at the same time may both make it.
    monkeypatch.setattr(threads, "_limit", 1)
    write_report(tmp_path, look, command="")
    # Two suggestions have the same pictures here.
    full_size = [encoding for encoding in encoded if len(encoding) == look.predicted.image.nbytes]
    assert len(full_size) > 5
    assert len(set(full_size)) == len(full_size)
