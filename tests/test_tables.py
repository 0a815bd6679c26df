"""Bases, lightings and solutions as tables of pandas and labelled arrays of xarray."""

import csv
import io
import sys
from dataclasses import replace

import numpy as np
import pytest
from batches import small_basis

import lightpaint as lp
from lightpaint.batch.gallery.summary import LightRow, SummaryRow, summary_csv
from lightpaint.colour.color import luminance


def solution() -> lp.Solution:
    basis = small_basis()
    weights = np.array([[0.5, 0.6, 0.2], [2.0, 1.0, 3.0], [0.0, 0.0, 0.0]])
    return lp.solve(basis, lp.Target.of(lp.combine(basis, weights).image))


def test_rows_are_lights_and_numbers_are_those_of_the_objects() -> None:
    pytest.importorskip("pandas", reason="pandas")
    answer = solution()
    basis, rgb = answer.basis, ["red", "green", "blue"]
    for table in (
        basis.to_dataframe(),
        answer.lighting.to_dataframe(),
        answer.to_dataframe(),
    ):
        assert list(table.index) == list(basis.names)
    emission = np.array(list(answer.lighting.emission.values()))
    table = answer.to_dataframe()
    np.testing.assert_array_equal(table[rgb], emission)
    np.testing.assert_array_equal(
        table[["was_red", "was_green", "was_blue"]], basis.current_weights
    )
    np.testing.assert_allclose(table.y, luminance(emission))
    stops = np.log2(luminance(emission[:2]) / luminance(basis.current_weights[:2]))
    np.testing.assert_allclose(table.stops[:2], stops)
    assert table.stops["lamp 2"] < -20  # off, but for the rounding of the target
    # Numbers are numbers, known or not.
    plain = answer.lighting.to_dataframe()
    assert all(plain[name].dtype == np.float64 for name in ("kelvin", "error_red", "upper_blue"))
    look = np.array([lp.combine(basis, {name: 1}).image.mean() for name in basis.names])
    assert (basis.to_dataframe()["mean"] / look > 0.5).all()


def test_arrays_are_labelled_and_solve_the_same_problem() -> None:
    xarray = pytest.importorskip("xarray", reason="xarray")
    answer = solution()
    images = answer.basis.to_xarray()
    assert isinstance(images, xarray.Dataset)
    np.testing.assert_array_equal(images.images.sel(light="lamp 1"), answer.basis.image("lamp 1"))
    dataset = answer.to_xarray()
    # M w = b where nothing is at a bound: here for what is on.
    on = dataset.sel(light=["lamp 0", "lamp 1"])
    products = (dataset.M * dataset.weights.rename(light="other")).sum("other").sel(light=on.light)
    np.testing.assert_allclose(products.transpose(*on.b.dims), on.b, rtol=1e-6)
    mixed = (images.images * dataset.weights).sum("light")
    np.testing.assert_allclose(mixed, dataset.predicted, rtol=1e-5)
    np.testing.assert_array_equal(answer.lighting.to_xarray().weight, dataset.weights)


def test_without_them_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = solution()
    for name, method in (("pandas", "to_dataframe"), ("xarray", "to_xarray")):
        monkeypatch.setitem(sys.modules, name, None)
        for one in (answer, answer.lighting, answer.basis):
            with pytest.raises(lp.LightpaintError, match=rf"needs {name}.*lightpaint\[tables\]"):
                getattr(one, method)()


def test_a_summary_has_rgb_and_kelvin_of_each_light() -> None:
    lights = (
        LightRow("key", 2.0, (3.0, 2.0, 1.0), "#ffcc99", 3200.4),
        LightRow("=fill", 0.0, (0.0, 0.0, 0.0)),
    )
    row = SummaryRow("evening", "done", "", "evening", lights=lights)
    other = replace(row, look="other", lights=lights[:1])
    [first, second] = csv.DictReader(io.StringIO(summary_csv([row, other])))
    assert (first["key"], first["key R"], first["key G"], first["key B"]) == ("2", "3", "2", "1")
    assert (first["key K"], first["'=fill K"], first["'=fill R"]) == ("3200", "", "0")
    assert (second["key R"], second["'=fill"], second["'=fill R"]) == ("3", "", "")


def test_a_summary_has_the_drives_of_lamps_behind_all_else() -> None:
    lamp = LightRow("par", 1.0, (1.0, 1.0, 1.0), drives={"red": 0.25, "white": 1.0})
    row = SummaryRow("evening", "done", "", "evening", lights=(LightRow("key", 2.0), lamp))
    failed = SummaryRow("dawn", "failed", "no such painting", "dawn")
    [first, second] = csv.DictReader(io.StringIO(summary_csv([row, failed])))
    assert [*first][-2:] == ["par drive red", "par drive white"]
    assert (first["par drive red"], first["par drive white"]) == ("0.25", "1")
    assert second["par drive red"] == ""
