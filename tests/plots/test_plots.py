"""Figures: what is in them, and that they are the same every time."""

from io import BytesIO

import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem.errors import InputError
from surfacechem.plots import figure, save
from surfacechem.plots.run import logarithmic, merged
from surfacechem.plots.style import symbol

pytestmark = pytest.mark.around


def dataset(times=None, **more):
    t = np.linspace(0.0, 2.0, 21) if times is None else times
    decay = np.exp(-t)
    variables = {
        "T_1": ("K", 300 + 10 * decay),
        "T_2": ("K", 300 - 10 * decay),
        "T_1_exact": ("K", 300 + 10 * decay),
        "phi": ("1", 1 - decay),
        "formed_phi": ("1", 1 - decay),
        "q_1": ("W m-2", 50 * decay),
        "q_2": ("W m-2", 50 * decay),
        "q_12": ("W m-2", 5 * decay),
        "v": ("m s-1", np.full(t.shape, 0.1)),
        "energy_residual": ("J m-2", 1e-9 * decay),
        **more,
    }
    data = {name: ("time", values, {"units": unit, "long_name": name}) for name, (unit, values) in variables.items()}
    attributes = {
        "title": "A test",
        "reason": "reached the end",
        "energy_error": 1e-12,
        "solver": "radau",
        "rtol": 1e-10,
    }
    return xarray.Dataset(data, coords={"time": ("time", t, {"units": "s"})}, attrs=attributes)


def labels(plot):
    return [[text.get_text() for text in ax.get_legend().get_texts()] for ax in plot.axes if ax.get_legend()]


def test_sliding_is_no_gap_and_logarithms_are_no_bonds():
    t = np.linspace(0.0, 2.0, 21)
    more = {"g_n": ("m", t), "u_t": ("m", 2 * t), "ln_theta": ("1", t), "gamma_m": ("1", 1 + t)}
    plot = figure(dataset(**more))
    titles = [ax.get_ylabel() for ax in plot.axes]
    assert titles[1:4] == ["Bonding [1]", "Gap [m]", "Displacement [m]"]
    assert labels(plot)[1:4] == [[r"$\phi$"], ["$g_{n}$"], ["$u_{t}$"]]


def test_panels_of_the_usual_figure():
    plot = figure(dataset())
    titles = [ax.get_ylabel() for ax in plot.axes]
    assert titles == ["Temperature [K]", "Bonding [1]", "Heat flux [W m$^{-2}$]", "Balance residual [1]"]
    assert labels(plot) == [["$T_{1}$", "$T_{2}$", "exact"], [r"$\phi$"], ["$q_{1}$ = $q_{2}$"], ["energy"]]
    assert plot.axes[-1].get_xlabel() == "Time [s]"
    assert plot.axes[-1].get_yscale() == "log"


def test_exact_curve_is_dashed_and_only_where_there_is_one():
    lines = figure(dataset()).axes[0].get_lines()
    assert [line.get_linestyle() for line in lines] == ["-", "-", "--"]


def test_residuals_are_relative():
    (line,) = figure(dataset()).axes[-1].get_lines()
    assert np.max(line.get_ydata()) == pytest.approx(1e-12)


def test_chosen_variables_are_grouped_by_unit():
    plot = figure(dataset(), ["q_12", "phi", "q_1"])
    assert labels(plot) == [["$q_{12}$", "$q_{1}$"], [r"$\phi$"]]
    with pytest.raises(InputError, match="Did you mean 'phi'"):
        figure(dataset(), ["phy"])


def test_a_constant_is_a_flat_line_when_asked_for():
    (ax,) = figure(dataset(), ["v"]).axes
    low, high = ax.get_ylim()
    assert (low, high) == pytest.approx((0.095, 0.105))


def test_time_axis_is_logarithmic_where_times_span_decades():
    spread = np.concatenate([[0.0], np.logspace(-5, 1, 61)])
    assert logarithmic(spread)
    assert figure(dataset(spread)).axes[0].get_xscale() == "log"
    assert figure(dataset(np.linspace(0, 1, 5001))).axes[0].get_xscale() == "linear"


def test_events_are_marked():
    events = {"event_time": ("event", np.array([0.5]), {"units": "s"})}
    plot = figure(dataset().assign(events))
    assert any(line.get_linestyle() == ":" for line in plot.axes[0].get_lines())


def texts(ax):
    return [text.get_text() for text in ax.texts]


def with_events(times, names, **modes):
    given = {
        "event_time": ("event", np.array(times), {"units": "s"}),
        "event_name": ("event", np.array(names, dtype=object), {"units": "1"}),
    }
    return dataset(**modes).assign(given)


def test_more_events_than_outputs_are_said():
    """Curves over time do not show them."""
    events = xarray.Dataset({"event_time": ("event", np.linspace(0.0, 2.0, 22), {"units": "s"})})
    heading = figure(dataset().merge(events)).axes[0].get_title(loc="left")
    assert heading.endswith("22 events between 21 outputs")
    assert "events" not in figure(dataset()).axes[0].get_title(loc="left")


def test_few_events_have_their_names():
    assert texts(figure(with_events([0.5, 1.5], ["debond", "touch"])).axes[0]) == ["debond", "touch"]
    many = np.linspace(0.1, 1.9, 20)
    assert texts(figure(with_events(many, ["snap"] * 20)).axes[0]) == []


def test_modes_are_bands():
    t = np.linspace(0.0, 2.0, 21)
    data = with_events([0.55], ["debond"], bonded=("1", np.where(t < 0.55, 1.0, 0.0)))
    data["bonded"].attrs["long_name"] = "mode (0: debonded, 1: bonded)"
    first, *_ = figure(data).axes
    (band,) = first.patches
    assert (band.get_x(), band.get_width()) == pytest.approx((0.55, 1.45))
    assert "bonded" not in "".join(str(names) for names in labels(figure(data)))


def test_stages_have_their_names():
    t = np.linspace(0.0, 2.0, 21)
    data = with_events([0.55], ["end of press"], stage=("1", np.where(t < 0.55, 0.0, 1.0)))
    data["stage"].attrs["long_name"] = "mode (0: press, 1: after the last stage)"
    assert texts(figure(data).axes[0]) == ["press", "after the last stage"]


def test_another_axis_than_time():
    plot = figure(dataset(), ["T_1", "phi"], "phi")
    (ax,) = plot.axes
    assert ax.get_xlabel() == r"Phi $\phi$ [1]"
    assert ax.get_lines()[0].get_xdata()[-1] == pytest.approx(1 - np.exp(-2.0))
    assert all("residual" not in ax.get_ylabel() for ax in figure(dataset(), against="phi").axes)
    with pytest.raises(InputError, match="Did you mean 'phi'"):
        figure(dataset(), against="phy")


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_files_are_the_same_every_time(kind):
    first, second = BytesIO(), BytesIO()
    save(figure(dataset()), first, kind)
    save(figure(dataset()), second, kind)
    assert first.getvalue() == second.getvalue()
    assert len(first.getvalue()) > 10_000


def test_notebooks_show_it_and_settings_stay_as_they_were():
    import matplotlib

    before = dict(matplotlib.rcParams)
    assert figure(dataset())._repr_png_().startswith(b"\x89PNG")
    assert dict(matplotlib.rcParams) == before


def test_a_file_is_read(tmp_path):
    path = tmp_path / "x.nc"
    dataset().to_netcdf(path)
    assert len(figure(path).axes) == 4
    with pytest.raises(InputError, match="not a readable"):
        figure(tmp_path / "nothing.nc")


def test_a_run_with_events_is_drawn_from_its_file(tmp_path):
    """Whatever else the dataset holds, such as the reasons of the events in words."""
    path = surfacechem.run("coulomb-stop").write(tmp_path / "stop.nc")
    assert texts(figure(path).axes[0]) == ["stop"]


@pytest.mark.parametrize("count", [0, 1])
def test_runs_that_ended_at_once(count):
    short = dataset(np.linspace(0.0, 1.0, count))
    if count:
        assert figure(short).axes
    else:
        with pytest.raises(InputError, match="nothing to plot"):
            figure(short)


def test_values_that_are_not_finite_leave_gaps():
    values = np.linspace(300.0, 400.0, 21)
    values[3] = np.nan
    save(figure(dataset(T_3=("K", values))), BytesIO(), "png")


def test_curves_that_coincide_share_a_label():
    assert merged(dataset(), ("q_1", "q_2", "q_12")) == [["q_1", "q_2"], ["q_12"]]


def test_symbols():
    assert symbol("theta_bond_s") == r"$\theta_{\mathrm{bond\ s}}$"


def test_a_dataset_that_misses_a_variable_is_named(tmp_path):
    path = tmp_path / "foreign.nc"
    xarray.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(path)
    with pytest.raises(InputError, match=r"foreign\.nc: has no variable 'time'"):
        figure(path)
