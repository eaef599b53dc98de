"""Several datasets in one figure: a colour for each, named by what differs."""

import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem.errors import InputError
from surfacechem.plots import COLOURS, figure, opened
from surfacechem.plots.comparison import labels

pytestmark = pytest.mark.around


@pytest.fixture(scope="module")
def runs():
    case = surfacechem.load("reservoir-exchange")
    return [case.run().dataset, case.run({"initial.T_1": 450.0}).dataset]


@pytest.fixture(scope="module")
def sweeps():
    over = {"initial.T_1": [350.0, 400.0, 450.0]}
    return [
        surfacechem.load("reservoir-exchange", changes).sweep(over).dataset for changes in ((), ("run.until=10 s",))
    ]


def entries(legend):
    return [text.get_text() for text in legend.get_texts()]


def test_runs_have_colours_and_variables_have_dashes(runs):
    plot = figure(runs)
    assert entries(plot.legends[0]) == ["$T_{1}$ = 500 K", "$T_{1}$ = 450 K"]
    lines = [line for line in plot.axes[0].get_lines() if len(line.get_xdata())]
    assert [(line.get_color(), line.get_linestyle()) for line in lines] == [
        (colour, dash) for colour in COLOURS[:2] for dash in ["-", "--"]
    ]
    assert lines[2].get_ydata()[0] == 450
    twice = figure([runs[0], runs[0]])
    assert entries(twice.legends[0]) == ["dataset 1", "dataset 2, the same as dataset 1"]
    assert entries(plot.axes[0].get_legend()) == ["$T_{1}$", "$T_{2}$"]
    (phases,) = figure(runs, ["q_1"], "T_1").axes
    assert np.array_equal(phases.get_lines()[1].get_xdata(), runs[1]["T_1"])


def test_sweeps_over_the_same_parameter_are_compared(sweeps, runs):
    (ax,) = figure(sweeps, ["T_1"]).axes
    assert [line.get_ydata()[1] for line in ax.get_lines()] == [each["T_1"].values[1, -1] for each in sweeps]
    assert labels([*map(opened, sweeps)]) == ["until = 200 s", "until = 10 s"]
    several = sweeps[0].expand_dims(mu=[0.1, 0.2], axis=1)
    with pytest.raises(InputError, match="all are over one parameter, the same; these are over initial_T_1 by mu"):
        figure([several, several])
    with pytest.raises(InputError, match="takes runs or sweeps, not both"):
        figure([sweeps[0], runs[0]])


def test_changes_made_in_python_have_units_and_the_names_of_the_case():
    case = surfacechem.load("sliding-dry")
    changed = case.run({"loading.p": 2e5, "interface.friction.coulomb.mu": 0.6})
    names = labels([opened(case.run().dataset), opened(changed.dataset)])
    assert names == ["$\\mu$ = 0.3, $p$ = 100 kPa", "$\\mu$ = 0.6, $p$ = 200 kPa"]


def test_datasets_that_differ_in_all_are_named_by_title_or_file(runs, tmp_path):
    solution = surfacechem.run("pair-exchange")
    other = solution.dataset
    assert labels([opened(runs[0]), opened(other)]) == ["A body cools to a reservoir", "Two bodies exchange heat"]
    assert labels([opened(runs[0])] * 2) == ["dataset 1", "dataset 2"]
    figure([runs[0], other.assign_attrs(title="$x_$")]).canvas.draw()  # no formula
    figure(other.assign_attrs(title="$x_$")).canvas.draw()
    solution.write(tmp_path / "pair.nc")
    with pytest.raises(InputError, match=r"pair\.nc: no variable 'lost_1'"):
        figure([runs[0].assign(lost_1=runs[0]["T_1"]), tmp_path / "pair.nc"], ["lost_1"])


def test_one_run_that_needs_decades_gives_them_to_all():
    t = np.append(0.0, np.geomspace(1e-6, 10.0, 80) * np.linspace(1.0, 1.2, 80))

    def run(rate):
        values = ("time", 300 + np.exp(-rate * t), {"units": "K"})
        return xarray.Dataset({"T": values}, {"time": t}, {"status": "finished", "title": f"rate {rate:g}"})

    slow, fast = run(0.1), run(1e4)
    scales = [figure(each).axes[-1].get_xscale() for each in ([slow, slow], [slow, fast], [fast, slow])]
    assert scales == ["linear", "log", "log"]


def test_modes_go_in_steps():
    data = surfacechem.run("debonding").dataset
    for plot in (figure(data, ["bonded"]), figure([data, data], ["bonded"])):
        assert plot.axes[0].get_ylabel() == "Mode [1]"
        assert plot.axes[0].get_lines()[0].get_drawstyle() == "steps-post"
