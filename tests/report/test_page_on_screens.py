"""report.html as a browser lays it out: on phones and desktops, with few lights and hundreds."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from patience import PATIENCE_S

from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.answer_analysis import without_constraints
from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.solution import Solution
from lightpaint.relit.verification import compare
from lightpaint.report.measures import ReportedAnswer
from lightpaint.report.page.html import ROWS_SHOWN
from lightpaint.report.page.report_page import report_page
from lightpaint.target.painted_target import Target

SIZE = (27, 48)
WIDTHS = (320, 360, 390, 768, 1280)

#: What the page says of itself, and who listens: frames have any width, which windows have not.
TELLS = "<script>parent.postMessage([innerWidth, ...['Width', 'Height'].map((side) =>"
TELLS += "document.documentElement['scroll' + side])].join(' '), '*');</script>"
LISTENS = "<script>onmessage = (told) => { document.body.append(`<${told.data}>`); };</script>"


def _page(make_basis: Any, n: int, name: str = "ceiling_lamp_{}", **options: Any) -> str:
    """A page with all that it may have, of spots of light and a painting that they cannot do."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    far = np.hypot(x - rng.uniform(0, SIZE[1], (n, 1, 1)), y - rng.uniform(0, SIZE[0], (n, 1, 1)))
    images = np.repeat((0.02 + np.exp(-((far / 6) ** 2)))[..., None], 3, axis=-1)
    noise = rng.normal(0, 0.02, (2, *images.shape)) * images
    basis = make_basis(
        images=images + noise[0],
        half_differences=noise[1],
        names=[name.format(k) for k in range(n)],
        emission=rng.uniform(0, 0.05, (n, 3)),
    )
    weights = np.where(rng.random((n, 1)) < 0.5, rng.uniform(0, 0.3, (n, 3)), 0)
    image = basis.mix(weights) * (1 + 0.6 * np.sin(x / 4))[..., None]
    importance = np.ones(SIZE, np.float32)
    importance[:, :5] = 0.2
    target = Target("evening", image.astype(np.float32), importance, everything=False)
    constraints = Constraints.of(**options) if options else None
    solution = solve(basis, target, constraints=constraints)
    predicted = combine(basis, solution.lighting)
    return report_page(
        ReportedAnswer(
            basis=basis,
            target=target,
            solution=solution,
            predicted=predicted,
            verification=compare(predicted, Estimate(predicted.image, -predicted.half_difference)),
            command="lightpaint solve scenes/hall.xml targets/evening.exr "
            "-o results/evening-final-2",
            uncertainty=_errors(solution),
            diagnosis=diagnose(solution),
            unconstrained=without_constraints(solution),
        )
    )


def _errors(solution: Solution) -> Uncertainty:
    """Some of every light, since the true ones of hundreds take long."""
    weights, each = solution.weights, np.full(3, 1e-3)
    scatter = 0.1 * weights + 1e-3
    interval = (np.maximum(weights - 2 * scatter, 0), weights + 2 * scatter)
    norm2 = solution.equations.target_norm2
    is_bright = np.zeros(len(weights), dtype=bool)
    return Uncertainty(
        weights, scatter, scatter, 0 * scatter, interval, each, each, each, norm2, is_bright
    )


def _laid_out(folder: Path, page: str) -> dict[int, tuple[int, int]]:
    """Width and height of all of the page, by width of the screen."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("Chromium")
    (folder / "page.html").write_text(page.replace("</body>", TELLS + "</body>"), encoding="utf-8")
    frames = "".join(
        f'<iframe src="page.html" style="width: {w}px; height: 800px; border: 0"></iframe>'
        for w in WIDTHS
    )
    (folder / "screens.html").write_text(f"<!doctype html>{LISTENS}<body>{frames}")
    options = ("--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/profile")
    wait = "--virtual-time-budget=10000"
    url = (folder / "screens.html").as_uri()
    completed = subprocess.run(
        [program, *options, wait, "--dump-dom", url],
        capture_output=True,
        timeout=PATIENCE_S,
        check=False,
    )
    sizes = re.findall(r"&lt;(\d+) (\d+) (\d+)&gt;", completed.stdout.decode())
    assert len(sizes) == len(WIDTHS), completed.stderr.decode()[-2000:]
    return {int(screen): (int(width), int(height)) for screen, width, height in sizes}


@pytest.fixture(scope="module")
def hall(make_basis: Any) -> str:
    """The page of 302 lights."""
    return _page(make_basis, 302)


@pytest.mark.parametrize(
    ("n", "name", "options"),
    [
        nightly(3, "spot_{}", {}),
        (302, "ceiling_lamp_{}", {}),
        nightly(40, "Sternwartenkuppelbeleuchtungskoerper{}", {"sparse": 6}),
    ],
)
def test_nothing_scrolls_sideways_and_hundreds_of_lights_are_folded(
    make_basis: Any, hall: str, tmp_path: Path, n: int, name: str, options: Any
) -> None:
    page = hall if n == 302 else _page(make_basis, n, name, **options)
    screens = _laid_out(tmp_path, page)
    assert set(screens) == set(WIDTHS)
    for screen, (width, height) in screens.items():
        assert width <= screen
        if n == 302:
            assert height < (5600 if screen < 390 else 5200)


def test_what_is_folded_is_there(hall: str) -> None:
    """Without a script, closed, and in text that a browser searches."""
    page = hall
    script = page.index("<script>")
    assert page.index("ceiling_<wbr>lamp_<wbr>301<") < script
    visible_text = re.sub(r"<details.*?</details>", "", page[:script], flags=re.DOTALL)
    assert len(re.findall('<td class="thumb">', visible_text)) == ROWS_SHOWN
    assert len(re.findall('<td class="thumb">', page)) == 302
    assert "292 more lights, each at most" in page
    assert not re.search(r"<details[^>]*\bopen\b", page)
    # They are in the order of the scene, and none of the rest does more than any of them.
    shares = {
        int(number): float(share)
        for number, share in re.findall(
            r"lamp_<wbr>(\d+)<small>.*?<span>([\d.]+) %</span>", page, flags=re.DOTALL
        )
    }
    first = [int(k) for k in re.findall(r'"name">ceiling_<wbr>lamp_<wbr>(\d+)', visible_text)]
    assert first == sorted(first)
    rest = [share for k, share in shares.items() if k not in first]
    assert min(shares[k] for k in first) >= max(rest)


def test_folded_lights_have_no_pictures(make_basis: Any, hall: str) -> None:
    """Of hundreds they would be most of the page, 10 kB each, and take seconds."""
    for page in (hall, _page(make_basis, ROWS_SHOWN + 20)):
        assert page.count('<td class="thumb"><img') == ROWS_SHOWN
    few = ROWS_SHOWN + 3
    assert _page(make_basis, few).count('<td class="thumb"><img') == few


def test_few_lights_are_not_folded(make_basis: Any) -> None:
    page = _page(make_basis, ROWS_SHOWN + 3)
    assert 'class="more"' not in page.split('id="lights"')[1].split("How sure")[0]
