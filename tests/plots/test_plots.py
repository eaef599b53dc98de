"""Figures: what is in them, and that they are the same every time."""

from io import BytesIO

import matplotlib
import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem.errors import InputError
from surfacechem.plots import figure, save, style
from surfacechem.plots.time_series import group_coinciding, wants_log_axis

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
    said = {"title": "A test", "reason": "reached the end", "solver": "radau"}
    attributes = {**said, "energy_error": 1e-12, "rtol": 1e-10}
    return xarray.Dataset(data, coords={"time": ("time", t, {"units": "s"})}, attrs=attributes)


def labels(plot):
    return [[text.get_text() for text in ax.get_legend().get_texts()] for ax in plot.axes if ax.get_legend()]


def titles(plot):
    return [ax.get_ylabel() for ax in plot.axes]


def texts(ax):
    return [text.get_text() for text in ax.texts]


def with_events(times, names, mode="", text=""):
    given = {
        "event_time": ("event", np.array(times), {"units": "s"}),
        "event_name": ("event", np.array(names, dtype=object), {"units": "1"}),
    }
    t = np.linspace(0.0, 2.0, 21)
    data = dataset(**({mode: ("1", np.where(t < 0.55, 0.0, 1.0))} if mode else {})).assign(given)
    if mode:
        data[mode].attrs["long_name"] = text
    return data


def test_panels_of_the_usual_figure():
    plot = figure(dataset())
    assert titles(plot) == ["Temperature [K]", "Bonding [1]", "Heat flux [W m⁻²]", "Balance residual [1]"]
    assert labels(plot) == [["$T_{1}$", "$T_{2}$", "exact"], [r"$\phi$"], ["$q_{1}$ = $q_{2}$"], ["energy"]]
    assert [line.get_linestyle() for line in plot.axes[0].get_lines()] == ["-", "-", "--"]  # exact: where there is one
    assert plot.axes[-1].get_xlabel() == "Time [s]"
    assert plot.axes[-1].get_yscale() == "log"
    (residual,) = plot.axes[-1].get_lines()
    assert np.max(residual.get_ydata()) == pytest.approx(1e-12)  # relative, as the attribute states
    assert group_coinciding(dataset(), ("q_1", "q_2", "q_12")) == [["q_1", "q_2"], ["q_12"]]


def test_sliding_is_no_gap_and_logarithms_are_no_bonds():
    t = np.linspace(0.0, 2.0, 21)
    more = {"g_n": ("m", t), "u_t": ("m", 2 * t), "ln_theta": ("1", t), "gamma_m": ("1", 1 + t)}
    plot = figure(dataset(**more))
    assert titles(plot)[1:4] == ["Bonding [1]", "Gap [m]", "Displacement [m]"]
    assert labels(plot)[1:4] == [[r"$\phi$"], ["$g_{n}$"], ["$u_{t}$"]]


def test_coverages_and_mole_fractions_have_panels_of_their_own():
    t = np.linspace(0.0, 2.0, 21)
    plot = figure(dataset(theta_free_s=("1", 1 - t / 2), x_gas_H=("1", t / 100)))
    assert titles(plot)[1:3] == ["Coverage [1]", "Mole fraction [1]"]


def test_electrodes_have_panels_of_potential_and_current():
    t = np.linspace(0.0, 2.0, 21)
    plot = figure(dataset(V_electron=("V", t - 3), i_electron=("A m-2", 5 - t)))
    assert titles(plot)[2:4] == ["Potential [V]", "Current [A m⁻²]"]


def test_chosen_variables_are_grouped_by_unit():
    assert labels(figure(dataset(), ["q_12", "phi", "q_1"])) == [["$q_{12}$", "$q_{1}$"], [r"$\phi$"]]
    (constant,) = figure(dataset(), ["v"]).axes
    assert constant.get_ylim() == pytest.approx((0.095, 0.105))
    for arguments in ((["phy"],), (None, "phy")):
        with pytest.raises(InputError, match="Did you mean 'phi'"):
            figure(dataset(), *arguments)
    with pytest.raises(InputError, match=r"a list of names, not 'x\.png'; a figure is written by its savefig"):
        figure(dataset(), "x.png")


def test_the_largest_of_many_have_colours_and_names():
    t = np.linspace(0.0, 2.0, 21)
    many = {f"theta_{k}": ("1", (k + 1) * t / 40) for k in range(20)}
    plot = figure(dataset(**many), [*many])
    assert labels(plot)[0] == [*(rf"$\theta_{{{k}}}$" for k in range(19, 13, -1)), "14 smaller"]
    assert [line.get_color() for line in plot.axes[0].get_lines()][6:] == 14 * ["0.75"]


def test_another_axis_than_time():
    (ax,) = figure(dataset(), ["T_1", "phi"], "phi").axes
    assert ax.get_xlabel() == r"Phi $\phi$ [1]"
    assert ax.get_lines()[0].get_xdata()[-1] == pytest.approx(1 - np.exp(-2.0))
    assert all("residual" not in title for title in titles(figure(dataset(), against="phi")))
    assert titles(figure(dataset(), against="time")) == titles(figure(dataset()))


def test_time_axis_is_logarithmic_where_times_span_decades():
    spread = np.concatenate([[0.0], np.logspace(-5, 1, 61)])
    assert wants_log_axis(spread)
    assert figure(dataset(spread)).axes[0].get_xscale() == "log"
    assert figure(dataset(np.linspace(0, 1, 5001))).axes[0].get_xscale() == "linear"


def test_few_events_have_lines_and_names_and_many_are_counted():
    """Curves over time do not show more events than outputs."""
    few = figure(with_events([0.5, 1.5], ["debond", "touch"])).axes[0]
    assert any(line.get_linestyle() == ":" for line in few.get_lines())
    assert texts(few) == ["debond", "touch"]
    assert [text.xyann[1] for text in few.texts] == [2, 2]  # beside each other
    near = figure(with_events([0.5, 0.53], ["debond", "touch"])).axes[0]
    assert [text.xyann[1] for text in near.texts] == [2, 11]  # one above the other
    many = figure(with_events(np.linspace(0.1, 1.9, 22), ["snap"] * 22)).axes[0]
    assert texts(many) == []
    assert many.get_title(loc="left").endswith("22 events between 21 outputs   22 snap")
    assert "events" not in few.get_title(loc="left")


def test_a_slip_and_the_stop_that_ends_it_are_one_line_with_a_number():
    slips = [moment for k in range(6) for moment in (0.1 + 0.3 * k, 0.1 + 0.3 * k + 1e-3)]
    ax = figure(with_events(slips, ["slip forward", "stop"] * 6)).axes[0]
    assert texts(ax) == ["1", "2", "3", "4", "5", "6"]
    assert [line.get_xdata()[0] for line in ax.get_lines()[-6:]] == slips[::2]
    assert ax.get_title(loc="left").endswith("1 to 6: slip forward and stop")


def test_events_whose_names_repeat_have_a_kind_of_line_each():
    stick_slip = with_events(np.linspace(0.1, 1.9, 12), ["slip", "stop"] * 6)
    ax = figure(stick_slip).axes[0]
    assert [line.get_linestyle() for line in ax.get_lines()[-12:]] == [":", "--"] * 6
    assert ax.get_title(loc="left").endswith("6 slip (dotted), 6 stop (dashed)")
    assert figure(stick_slip, against="phi").axes[0].get_title(loc="left").endswith("6 slip, 6 stop")


def test_rebounds_without_end_have_lines_as_far_as_they_are_told_apart():
    """Their number is that of the events, not that of the lines."""
    ax = figure(with_events(2 - 2 * 0.7 ** np.arange(1, 100), ["impact"] * 98 + ["rest"])).axes[0]
    assert 10 < sum(line.get_linestyle() in (":", "--") for line in ax.get_lines()) < 30
    assert ax.get_title(loc="left").endswith("98 impact (dotted), rest")


def test_events_that_decades_would_crowd_keep_the_time_linear():
    t = np.append(0.0, np.geomspace(1e-5, 2, 61) + np.linspace(0, 1e-6, 61))
    early = {"w": ("m", 1 - np.exp(-1e3 * t))}
    assert figure(dataset(t, **early), ["w"]).axes[0].get_xscale() == "log"
    late = {"event_time": ("event", [0.5, 1.0, 1.5]), "event_name": ("event", np.array(["stop"] * 3, dtype=object))}
    assert figure(dataset(t, **early).assign(late), ["w"]).axes[0].get_xscale() == "linear"


def test_a_flux_that_is_a_spike_at_the_start_is_shown_behind_it():
    spike = np.where(np.linspace(0.0, 2.0, 2001) < 0.001, 1e6, 50 * np.exp(-np.linspace(0.0, 2.0, 2001)))
    (ax,) = figure(dataset(np.linspace(0.0, 2.0, 2001), q_1=("W m-2", spike)), ["q_1"]).axes
    assert 50 < ax.get_ylim()[1] < 60
    assert texts(ax) == ["1 MW m⁻² at the start"]


def test_the_force_on_a_bond_has_a_panel_and_balances_that_close_have_none():
    closed = dataset(f=("N", 1e-10 * np.linspace(0.0, 2.0, 21))).assign_attrs(energy_error=1e-18)
    assert titles(figure(closed))[-1] == "Force per bond\n[pN]"


def test_modes_and_stages_are_bands():
    plot = figure(with_events([0.55], ["debond"], "bonded", "mode (0: bonded, 1: debonded)"))
    (band,) = plot.axes[0].patches
    assert (band.get_x(), band.get_width()) == pytest.approx((0.55, 1.45))
    assert "bonded" not in "".join(map(str, labels(plot)))
    staged = with_events([0.55], ["end of press"], "stage", "mode (0: press, 1: after the last stage)")
    assert texts(figure(staged).axes[0]) == ["press", "after the last stage"]


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_files_are_the_same_every_time(kind):
    first, second = BytesIO(), BytesIO()
    for file in (first, second):
        save(figure(dataset(), ["phi"]), file, kind)
    assert first.getvalue() == second.getvalue()
    assert len(first.getvalue()) > 5_000


def test_an_error_that_is_not_known_is_told_so():
    title = figure(dataset().assign_attrs(error=np.nan)).axes[0].get_title(loc="left")
    assert "error unknown" in title


def test_notebooks_show_it_and_settings_stay_as_they_were():
    before = dict(matplotlib.rcParams)
    assert figure(dataset())._repr_png_().startswith(b"\x89PNG")
    assert dict(matplotlib.rcParams) == before


def test_files_are_read_and_those_of_others_refused(tmp_path):
    """Whatever else the dataset holds, such as the reasons of the events in words."""
    assert texts(figure(surfacechem.run("coulomb-stop").write(tmp_path / "stop.nc")).axes[0]) == ["stop"]
    xarray.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(tmp_path / "foreign.nc")
    with pytest.raises(InputError, match=r"foreign\.nc: has no variable 'time'"):
        figure(tmp_path / "foreign.nc")
    with pytest.raises(InputError, match=r"there is no file .*foreing\.nc\. Did you mean 'foreign\.nc'\?"):
        figure(tmp_path / "foreing.nc")


def test_runs_that_ended_at_once_and_values_that_are_not_finite():
    assert figure(dataset(np.zeros(1))).axes
    with pytest.raises(InputError, match="nothing to plot"):
        figure(dataset(np.zeros(0)))
    values = np.linspace(300.0, 400.0, 21)
    values[3] = np.nan  # leaves a gap
    save(figure(dataset(T_3=("K", values)), ["T_3"]), BytesIO(), "png")


def test_temperatures_in_degrees_celsius():
    kelvins, celsius = (figure(dataset(), celsius=wanted).axes[0] for wanted in (False, True))
    assert (kelvins.get_ylabel(), celsius.get_ylabel()) == ("Temperature [K]", "Temperature [°C]")
    curves = zip(kelvins.lines, celsius.lines, strict=True)
    assert all(np.allclose(one.get_ydata() - other.get_ydata(), 273.15, rtol=1e-12) for one, other in curves)


CONTACT = {
    "bodies": {"lower": {"temperature": "300 K"}, "upper": {"temperature": "300 K"}},
    "interface": {"potential": [{"penalty": {"E_n": "50 MPa/um"}}], "friction": [{"coulomb": {"mu": 0.3}}]},
    "loading": {"g_n": "-1 nm", "v": "1 mm/s"},
}


def test_a_variable_over_itself_is_no_figure():
    with pytest.raises(InputError, match="T_1 is the axis: name other variables, or leave `against` out"):
        figure(dataset(), ["T_1"], "T_1")


def test_tractions_are_drawn_over_what_the_states_differ_in():
    case = surfacechem.load(CONTACT)
    data = case.evaluate({"g_n": [2e-9, -4e-9, -2e-9]})
    plot = figure(data)
    assert titles(plot)[0] == "$t_{n}$ [kPa]"
    (line,) = plot.axes[0].get_lines()
    assert line.get_xdata() == pytest.approx([-4e-9, -2e-9, 2e-9])
    assert line.get_ydata() == pytest.approx([-200e3, -100e3, 0])
    assert "[nm]" in plot.axes[-1].get_xlabel()
    assert line.get_linestyle() == "None"  # in this order they are no path
    path, grid = {"g_n": [-4e-9, -2e-9, 2e-9]}, {"g_n": [-4e-9, -4e-9, -2e-9, -2e-9], "v": [0.1, 0.2, 0.1, 0.2]}
    looks = [figure(case.evaluate(points)).axes[0].get_lines()[0].get_linestyle() for points in (path, grid)]
    assert looks == ["-", "None"]
    (slope,) = figure(data, ["t_n_by_g_n"], "t_n").axes
    assert np.all(np.diff(slope.get_lines()[0].get_xdata()) >= 0)
    with pytest.raises(InputError, match="no variable 't' at the states"):
        figure(data, ["t"])
    with pytest.raises(InputError, match="needs states that differ"):
        figure(case.evaluate())


def test_states_at_which_a_law_does_not_hold_are_marks_and_no_data():
    bonded = CONTACT | {"interface": {"potential": [{"bond-stiffness": {"E_b": "2 MPa/um", "E_n": "50 MPa/um"}}]}}
    case = surfacechem.load(bonded | {"loading": {"g_n": "2 nm", "phi": 0.5}})
    plot = figure(case.evaluate({"phi": [0.2, 1.5, 0.8, 3.0]}))
    line, marks = plot.axes[0].get_lines()
    assert line.get_ydata() == pytest.approx([800, 3200, np.nan, np.nan], nan_ok=True)
    assert (marks.get_label(), marks.get_xdata().tolist()) == ("refused", [1.5, 3.0])
    assert any("2 refused" in text.get_text() for text in plot.findobj(matplotlib.text.Text))


def test_events_at_one_time_are_all_counted():
    plot = figure(surfacechem.run("bouncing-plate").dataset)
    said = [text.get_text() for text in plot.findobj(matplotlib.text.Text)]
    assert any("78 impact (dotted), rest" in text for text in said)


def test_a_jump_is_dotted_from_the_value_before_to_that_after():
    t = np.array([0.0, 1.0, np.nextafter(1.0, 2.0), 2.0])
    solid, dotted = figure(dataset(t, p=("Pa", np.array([1.0, 2.0, 5.0, 4.0]))), ["p"], "T_1").axes[0].get_lines()
    assert solid.get_ydata() == pytest.approx([1, 2, np.nan, 5, 4], nan_ok=True)
    assert dotted.get_ydata() == pytest.approx([np.nan, 2, 5, np.nan], nan_ok=True)
    assert dotted.get_linestyle() == ":"


def test_a_jump_between_outputs_is_dotted_from_the_one_to_the_next():
    """From an output at its very time; a kink is none, and where both sides are outputs it is between them."""
    t = np.array([0.0, 1.0, 2.0, 3.0, 4.0, np.nextafter(5.0, 0.0), 5.0, 6.0])
    run = dataset(t, p=("Pa", np.array([1.0, 2.0, 3.0, 4.0, 1.0, 2.0, 5.0, 4.0])))
    run["event_time"] = "event", [0.5, 3.0, 4.5, 5.0, 6.0]
    run["event_verdict"] = "event", np.array(["admissible", "admissible", "", "admissible", "admissible"], object)
    solid, dotted = figure(run, ["p"], "T_1").axes[0].get_lines()
    nothing = np.nan
    assert solid.get_ydata() == pytest.approx([1, nothing, 2, 3, 4, nothing, 1, 2, nothing, 5, 4], nan_ok=True)
    assert dotted.get_ydata() == pytest.approx([1, 2, nothing, 4, 1, 2, 5, nothing], nan_ok=True)


@pytest.mark.parametrize(
    ("error", "ends"), [(1e-2, [(297.0, 303.0)]), (np.inf, []), (np.nan, []), (3.0, []), (None, [])]
)
def test_an_axis_does_not_magnify_a_known_error_alone(error, ends):
    found = []
    style.limit_zoom(lambda *limits: found.append(limits), np.array([299.9, 300.1]), error)
    np.testing.assert_allclose(np.array(found), ends, atol=0.01)
