"""What the report shows of the cost of constraints."""

import re
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.answer_analysis import without_constraints
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.report.page.limit_sections import constraints_section
from lightpaint.target.painted_target import Target

SIZE = (10, 12)


def _solved(make_basis: Any, constraints: Constraints | None, n: int = 5) -> Any:
    basis = make_basis(n, SIZE, half_differences=np.full((n, *SIZE, 3), 1e-4))
    image = np.random.default_rng(1).random((*SIZE, 3)).astype(np.float32)
    target = Target("t", image, np.ones(SIZE, np.float32), everything=False)
    return basis, target, solve(basis, target, constraints=constraints)


def _missed(solution: Any) -> float:
    quality = solution.certificate
    return float(np.sqrt(sum(quality.objective) / solution.equations.target_norm2.sum()))


def _section(basis: Any, target: Target, solution: Any) -> str:
    return constraints_section(
        basis, solution, without_constraints(solution), transform=ViewTransform()
    )


def test_the_free_optimum_stands_beside_what_was_asked(make_basis: Any) -> None:
    constraints = Constraints.of({"light 1": {"off": True}, "light 2": {"color": "#00f"}})
    basis, target, solution = _solved(make_basis, constraints)
    page = _section(basis, target, solution)
    free = _missed(solve(basis, target))
    captions = re.findall(r"<strong>(.*?)\.</strong> (\d+) % missed", page)
    expected = [("Without constraints", free), ("With the constraints", _missed(solution))]
    assert captions == [(name, f"{100 * missed_share:.0f}") for name, missed_share in expected]
    assert captions[0][1] != captions[1][1]
    assert page.count("<img") == 2
    pictures = re.findall(r'src="(data:[^"]*)"', page)
    assert pictures[0] != pictures[1]
    # Of an answer with the noise taken out it is asked of the same equations.
    assert "Without constraints" in _section(basis, target, correct_noise(solution))


def test_without_constraints_there_is_nothing_to_show(make_basis: Any) -> None:
    basis, target, solution = _solved(make_basis, None)
    assert _section(basis, target, solution) == ""
    empty = solve(basis, target, constraints=Constraints())
    assert _section(basis, target, empty) == ""
    constraints = Constraints.of({"light 1": {"off": True}})
    one, _ = solve([basis, basis], [target, target], constraints=constraints).views
    assert _section(basis, target, one) == ""


@pytest.mark.parametrize(("sparse", "neighbours"), [(1, [2, 3]), (3, [1, 2, 4, 5]), (5, [3, 4])])
def test_what_fewer_and_more_lights_would_miss(
    make_basis: Any, sparse: int, neighbours: list[int]
) -> None:
    basis, target, solution = _solved(make_basis, Constraints.of(sparse=sparse))
    page = _section(basis, target, solution)
    counts = [int(count) for count in re.findall(r"<strong>With (\d) lights?", page)]
    assert counts == neighbours
    assert f"{sparse} light{'' if sparse == 1 else 's'}, as asked" in page
    assert page.count("<tr>") == 1 + len(solution.certificate.curve) + 1
    for count, missed_share in solution.certificate.curve:
        assert f"{count} light" in page
        assert f"{100 * missed_share:.0f} %" in page


def test_large_pictures_are_reduced(make_basis: Any) -> None:
    basis = make_basis(2, (9, 1001))
    target = Target("t", basis.images[0], np.ones((9, 1001), np.float32), everything=False)
    constraints = Constraints.of({"light 1": {"off": True}})
    page = _section(basis, target, solve(basis, target, constraints=constraints))
    assert re.findall(r'<img width="(\d+)" height="(\d+)"', page) == [("333", "3")] * 2
