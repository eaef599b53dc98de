"""Lists of figures: what is drawn is what runs give, and how far that is from exact curves is measured."""

import numpy as np
import pytest
from typer.testing import CliRunner

from surfacechem.cli import app
from surfacechem.errors import InputError
from surfacechem.format import load
from surfacechem.studies.figures import Line, lists, pictures, read_list

pytestmark = pytest.mark.around

HEAD = """
title: Two figures
figures:
  - name: one
    title: A figure
    x: {variable: time, name: t, per: 0.5 s}
    y: {variable: T, name: T, per: 300 K}
"""
LIST = HEAD + "    curves:\n      - {case: exothermic, label: runs, set: {run.until: 1 s}}\n"


def written(folder, text):
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_run_in_the_units_of_the_axes_lies_on_its_exact_curve(tmp_path):
    (picture,) = pictures(read_list(written(tmp_path, LIST)))
    (curve,) = picture.curves
    assert curve.x[-1] == 2.0
    assert curve.y[-1] == pytest.approx(np.sqrt(1 + 0.5 * (1 - np.exp(-4))), rel=1e-10)
    assert curve.distance < 1e-10
    assert "Largest distance from the exact curve" in picture.caption
    assert [line.get_text() for line in picture.draw().axes[0].get_legend().get_texts()] == ["runs", "exact"]


def test_what_runs_end_at_is_marked_where_it_breaks_the_second_law(tmp_path):
    text = LIST.replace(
        "{case: exothermic, label: runs, set: {run.until: 1 s}}",
        """{case: debonding,
          set: {interface.potential.bond-energy.K_0: 300 J/m^2},
          over: {interface.limits.tensile-strength.t_max.value: [20 MPa, 50 MPa, 60 MPa, 70 MPa]}}""",
    )
    text = text.replace("variable: time, name: t, per: 0.5 s", "variable: t_max, name: t, per: 77.45966692414834 MPa")
    (picture,) = pictures(read_list(written(tmp_path, text)))
    (curve,) = picture.curves
    assert curve.y == pytest.approx(np.sqrt(0.5 + curve.x**2), rel=1e-9)
    assert curve.refused.tolist() == (curve.y < 1).tolist() == [True, True, False, False]
    assert curve.distance < 1e-12


def test_published_data_are_drawn_in_the_units_of_the_axes(tmp_path):
    (tmp_path / "data.csv").write_text("t [ms], T [degC]\n250, 26.85\n", encoding="utf-8")
    (picture,) = pictures(read_list(written(tmp_path, LIST[:-2] + ", data: {file: data.csv, x: t, y: T}}\n")))
    x, y = picture.curves[0].data
    assert (x, y) == (pytest.approx([0.5]), pytest.approx([1.0]))


def test_published_data_without_a_unit_are_numbers_of_the_axis(tmp_path):
    (tmp_path / "data.csv").write_text("t [ms], T\n250, 1.05\n", encoding="utf-8")
    (picture,) = pictures(read_list(written(tmp_path, LIST[:-2] + ", data: {file: data.csv, x: t, y: T}}\n")))
    assert picture.curves[0].data == (pytest.approx([0.5]), pytest.approx([1.05]))
    legend = picture.draw().figure.axes[0].get_legend()
    assert "published" in [text.get_text() for text in legend.get_texts()]


def test_the_fits_to_published_measurements_follow_the_points():
    spectrum, steps, lifetimes, cure = pictures(read_list("published"))
    for picture, within in ((spectrum, 0.1), (steps, 0.005), (lifetimes, 0.25)):
        (curve,) = picture.curves
        x, y = curve.data
        assert np.interp(x, curve.x, curve.y) == pytest.approx(y, rel=within)
        assert "Measured: " in picture.caption
    for curve in cure.curves:
        x, y = curve.data
        # 0.3 % of the time where a reaction of first order has 5 % left, and a thousandth for lines between outputs.
        assert np.interp(x, curve.x, curve.y) == pytest.approx([0.95], abs=0.003 * 0.05 * np.log(20) + 1e-3)
        assert y == pytest.approx([0.95])


def test_the_distance_is_that_from_the_line_between_its_corners():
    nothing = np.zeros(2, dtype=bool)
    corners = np.array([0.0, 1.0, 1.0, 4.0]), np.array([0.0, 2.0, 0.0, 0.0])
    assert Line("", np.array([0.5, 1.0]), np.array([1.0, 1.3]), nothing, corners, None).distance == 0
    assert Line("", np.array([2.0, 3.0]), np.array([0.0, 0.5]), nothing, corners, None).distance == 0.25


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("variable: T,", "variable: temperature,"), "no variable 'temperature'"),
        (("exothermic", "exothermal"), "exothermal"),
        (("0.5 s", "0.5 m"), "m"),
        (("title: A figure", "titel: A figure"), "Did you mean 'title'"),
        (("{case: exothermic,", "{case: exothermic, data: {file: ../x.csv, x: t, y: T},"), "x.csv"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path, change, message):
    with pytest.raises(InputError, match=message) as error:
        list(pictures(read_list(written(tmp_path, LIST.replace(*change)))))
    assert error.value.place.line


@pytest.mark.parametrize("path", sorted(lists().glob("*.yaml")), ids=lambda path: path.stem)
def test_the_shipped_lists_name_cases_that_there_are(path):
    if "figures:" in path.read_text(encoding="utf-8"):
        for figure in read_list(path.stem).figures:
            for curve in figure.curves:
                load(str(path.parent / curve.case) if curve.case.endswith(".yaml") else curve.case)
    else:
        load(str(path))


def test_the_command_writes_a_file_for_each_figure(tmp_path):
    shown = CliRunner().invoke(app, ["figures", written(tmp_path, LIST), "-o", str(tmp_path / "new" / "folder")])
    assert shown.exit_code == 0, shown.output
    assert (tmp_path / "new" / "folder" / "one.svg").read_bytes().startswith(b"<?xml")
    refused = CliRunner().invoke(app, ["figures", "papre"])
    assert refused.exit_code == 2
    assert "paper" in refused.output
