"""Figures of sweeps: what they show is what the dataset holds; distributions and lifetimes are those of the law."""

import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem import plots
from surfacechem.errors import InputError
from surfacechem.quantities import BOLTZMANN
from surfacechem.results.netcdf import save_kept
from surfacechem.results.store import opened

pytestmark = pytest.mark.around

K_0, C_R = "interface.potential.bond-energy.K_0", "interface.bonding.linear-affinity.c_r"
STARTS = [290.0 + k for k in range(8)]
SAMPLE = {
    "of": {K_0: {"normal": {"mean": 200, "std": 20}}, C_R: {"lognormal": {"median": 6e15, "sigma": 0.2}}},
    "runs": 128,
}
BOND_ENERGY = "Temperature-independent part of the bond energy density (bond-energy)"


def stored(folder, **section):
    simulation = surfacechem.load("exothermic", {"sweep": {"checked": 0, **section}})
    simulation.stream(simulation.plan(), folder / "o.zarr").run()
    return folder / "o.zarr"


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    keep = {"last": ["T", "phi"], "series": ["phi"]}
    return stored(tmp_path_factory.mktemp("drawn"), sample=SAMPLE, keep=keep)


def test_a_map_over_two_parameters(tmp_path):
    over = {K_0: {"from": 1, "to": 300, "points": 9, "spacing": "logarithmic"}, "initial.T": STARTS}
    path = stored(tmp_path, over=over, keep={"last": ["T"]})
    ax = plots.figure(path).axes[0]
    assert np.array_equal(ax.collections[0].get_array(), opened(path)["T_last"].values.T)
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "linear")
    words = [" ".join(text.split()) for text in (ax.get_xlabel(), ax.get_ylabel())]
    assert words == [f"{BOND_ENERGY} [J m⁻²]", "Initial temperature of lower and upper and interface [K]"]


def test_a_store_shows_bonds_temperatures_and_times_before_all_else(tmp_path):
    plot = plots.figure(stored(tmp_path, over={K_0: [100.0, 200.0], "initial.T": STARTS}))
    bars = [ax for ax in plot.axes if not ax.get_xlabel() and "Initial" not in ax.get_ylabel()]
    assert [bar.get_ylabel() for bar in bars] == [r"$\phi_{\mathrm{last}}$ [1]", r"$T_{\mathrm{max}}$ [K]"]


def test_what_is_left_of_broken_bonds_is_no_map_and_a_bar_has_no_offset(tmp_path):
    data = opened(stored(tmp_path, over={K_0: [100.0, 200.0], "initial.T": STARTS}))
    rest = data["phi_last"].copy(data=1e-13 * data["phi_last"].values)
    warm = data["T_max"].copy(data=298.0 + 1e-3 * data["phi_last"].values)
    plot = plots.figure(data.assign(phi_last=rest, T_max=warm, T_last=warm))
    assert [ax.get_ylabel() for ax in plot.axes if "Initial" not in ax.get_ylabel()] == [r"$T_{\mathrm{max}}$ [K]"]
    plot.draw_without_rendering()
    assert plot.axes[1].yaxis.get_offset_text().get_text() == ""


@pytest.fixture(scope="module")
def grid():
    return surfacechem.load("exothermic").sweep({K_0: [200.0, 300.0], "initial.T": STARTS}).dataset


def test_a_map_of_whole_runs_shows_bonds_at_the_end_and_the_largest_temperatures(grid):
    """And neither steps nor errors, which differ from run to run as well."""
    maps = [ax.collections[0].get_array() for ax in plots.figure(grid).axes[:2]]
    bonds, largest = grid["phi"].values[..., -1], grid["T"].values.max(axis=-1)
    assert np.array_equal(maps[0], bonds.T)
    assert np.array_equal(maps[1], largest.T)


def test_curves_over_two_parameters_have_the_colours_of_the_first(grid):
    curves, bar = plots.figure(grid, ["phi"]).axes
    assert [len({line.get_color() for line in curves.lines[k : k + 8]}) for k in (0, 8)] == [1, 1]
    assert curves.lines[0].get_color() != curves.lines[8].get_color()
    assert curves.get_title("left").endswith("Initial temperature of lower and upper and interface")
    assert bar.get_ylabel() == f"{BOND_ENERGY} [J m⁻²]"


def test_distributions_and_effects_of_a_sample(drawn):
    rows = np.array(plots.figure(drawn).axes).reshape(2, 3)
    assert [sum(bar.get_width() for bar in row[0].patches) for row in rows] == [128, 128]
    assert rows[1, 0].lines[1].get_ydata()[0] == np.median(opened(drawn)["T_last"].values)
    names = {" ".join(ax.get_xlabel().split()) for ax in rows[1, 1:]}
    assert names == {f"{BOND_ENERGY} [J m⁻²]", "Rate constant per bond (linear-affinity) [J⁻¹ s⁻¹]"}
    (effect,) = (ax for ax in rows[1] if ax.get_xlabel().startswith("Temperature"))
    assert np.all(np.diff(effect.lines[0].get_ydata()) > 0)


def test_curves_of_a_sample_are_a_fair_part_that_is_said(drawn):
    (ax,) = plots.figure(drawn, ["phi"]).axes
    assert (len(ax.lines), ax.get_title("left")) == (100, "128 finished   100 of 128 runs")
    assert np.array_equal(ax.lines[-1].get_ydata(), opened(drawn)["phi"].values[-1])


def test_each_run_of_a_sweep_over_a_variable_or_time():
    sweep = surfacechem.load("exothermic").sweep({K_0: [200.0, 300.0]}).dataset
    (ax,) = plots.figure(sweep, ["T"], "phi").axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\phi$ [1]", "$T$ [K]")
    assert np.array_equal(ax.lines[1].get_data(), [sweep["phi"].values[1], sweep["T"].values[1]])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [f"$K_{{0}}$ = {K} J m⁻²" for K in (200, 300)]
    assert plots.figure(sweep, against="time").axes[-1].get_xlabel() == "Time [s]"
    with pytest.raises(InputError, match="no variable 'T_lst' along the runs"):
        plots.figure(sweep, ["T_lst"], "phi")


def test_a_number_of_each_run_is_no_curve_of_it(drawn, grid):
    for data, names, against, single in ((drawn, ["T_last"], "K_0", "T_last"), (grid, ["T"], "K_0", "K_0")):
        with pytest.raises(InputError, match=f"{single} does not go along the runs. Leave `against` out"):
            plots.figure(data, names, against)


@pytest.mark.parametrize("written", [False, True])
def test_parameters_that_change_together_are_drawn_as_the_first_of_them(written, tmp_path):
    """In its order, with the others beside it: the same from memory and from a file of kept series."""
    section = {"combine": "zip", "over": {K_0: [300.0, 100.0, 200.0], "initial.T": [310.0, 290.0, 300.0]}}
    case = surfacechem.load("exothermic", {"sweep": {"checked": 0, "keep": {"series": ["T", "phi"]}, **section}})
    if written:
        data = save_kept(case.stream(case.plan(), tmp_path / "o.zarr").run().dataset, tmp_path / "o.nc")
    else:
        data = case.sweep().dataset
    for ax in (ends := plots.figure(data)).axes:
        assert ax.lines[0].get_xdata().tolist() == [100, 200, 300]
        assert np.all(np.diff(ax.lines[0].get_ydata()) > 0)
    assert [ax.get_ylabel().split()[1] for ax in ends.axes] == ["$T$", r"$\phi$"]
    assert ends.axes[0].get_title("left").startswith("along with initial T = 290 to 310 K   3 finished")
    (series,) = plots.figure(data, ["T"], "time").axes
    assert words(series)[1] == "$K_{0}$ = 200 J m⁻², initial T = 300 K"
    assert len({line.get_color() for line in series.lines}) == 3


def test_runs_that_no_single_parameter_tells_apart_have_the_names_of_all():
    over = {K_0: [100.0, 100.0, 200.0], "initial.T": [290.0, 300.0, 300.0]}
    case = surfacechem.load("exothermic", {"sweep": {"combine": "zip", "over": over}})
    data = case.sweep().dataset
    assert words(plots.figure(data, ["T"], "time").axes[0])[1] == "$K_{0}$ = 100 J m⁻², initial T = 300 K"
    assert len(plots.figure(data, ["phi_last"]).axes) == 3  # a distribution, and an effect of each


def test_a_swept_temperature_is_an_axis_and_no_result(tmp_path):
    over = {"interface.temperature": [320.0, 280.0, 300.0]}
    case = surfacechem.load("catch-bond", {"sweep": {"checked": 0, "over": over}})
    for data in (case.sweep(over).dataset, case.stream(case.plan(), tmp_path / "o.zarr").run().dataset):
        (ax,) = plots.figure(data).axes
        assert "phi" in ax.get_ylabel()
        assert ax.lines[0].get_xdata().tolist() == [280, 300, 320]


def test_what_is_briefer_than_the_outputs_of_a_sweep_is_told():
    case = surfacechem.load("stick-slip", ["run.outputs=201"])
    swept = case.sweep({"mechanics.tangential.k": ["60 MPa/m", "90 MPa/m"]})
    facts = [ax.get_title(loc="left") for ax in swept.plot(variables=["v", "u_t"], against="time").axes]
    assert "between outputs, $v$ reaches" in facts[0]
    assert "u_{t}" not in facts[0]
    still = swept.dataset.assign({name: 0 * swept.dataset[name] for name in ("v", "v_max", "v_min")})
    assert "between outputs" not in plots.figure(still, ["v"], "time").axes[0].get_title(loc="left")


@pytest.mark.parametrize(("until", "names"), [(1.2, ["phi_last", "T_last"]), ("steady", ["T_last", "time_reached"])])
def test_a_store_over_one_parameter_shows_what_depends_on_it(until, names, tmp_path):
    """Not only the time that its runs have reached."""
    settings = {"run.until": until, "sweep": {"keep": {"last": ["T", "phi"]}, "over": {K_0: [100.0, 200.0, 300.0]}}}
    simulation = surfacechem.load("exothermic", settings)
    with simulation.stream(simulation.plan(), tmp_path / "o.zarr").run().dataset as data:
        # All bonds are there at rest, after different times.
        for ax, name in zip(plots.figure(data).axes, names, strict=True):
            x, y = ax.lines[0].get_data()
            assert x.tolist() == [100, 200, 300]
            np.testing.assert_allclose(y, data[name])
            assert not ax.get_ylabel().startswith("Final")
            assert ax.get_legend() is None


def test_what_is_stored_of_the_runs_that_are_checked_alone_is_in_no_curve(tmp_path):
    """More runs than the hundred hardest, whose numbers have a dimension of their own."""
    over = {"initial.T": {"from": 280, "to": 310, "points": 101}}
    simulation = surfacechem.load("exothermic", {"sweep": {"checked": 3, "keep": {"last": ["T"]}, "over": over}})
    stream = simulation.stream(simulation.plan(), tmp_path / "o.zarr")
    stream.run()
    stream.check()
    with stream.store.dataset as data:
        assert data.sizes["hardest"] == 100
        assert [ax.get_ylabel() for ax in plots.figure(data).axes] == ["$T_{\\mathrm{last}}$ [K]"]
        with pytest.raises(InputError, match="no variable 'hardest_error' in the sweep"):
            plots.figure(data, ["hardest_error"])


def test_effects_of_three_parameters_of_a_grid(tmp_path):
    over = {K_0: [100.0, 200.0, 300.0], "initial.T": [290.0, 310.0], C_R: [5e15, 7e15]}
    path = stored(tmp_path, over=over, keep={"last": ["T"]})
    effect = next(ax for ax in plots.figure(path, ["T_last"]).axes if ax.get_xlabel().startswith("Temperature"))
    middle = np.median(opened(path)["T_last"].values, axis=(1, 2))
    assert np.array_equal(effect.lines[0].get_data(), [[100, 200, 300], middle])


def test_effects_in_a_store_are_in_the_order_of_the_plan_each_with_its_own_scale(tmp_path):
    over = {K_0: {"from": 1, "to": 300, "points": 3, "spacing": "logarithmic"}, "initial.phi": [0.0, 0.1, 0.2]}
    simulation = surfacechem.load("exothermic", {"sweep": {"keep": {"last": ["T"]}}})
    plan = simulation.plan({**over, "initial.T": [290.0, 300.0]})
    with simulation.stream(plan, tmp_path / "o.zarr").run().dataset as data:
        effects = plots.figure(data, ["T_last"]).axes[1:]
    assert [ax.get_xscale() for ax in effects] == ["log", "linear", "linear"]
    assert ["bonding" in ax.get_xlabel() for ax in effects] == [False, True, False]


def test_effects_of_a_sample_in_memory_and_in_its_file(tmp_path):
    """Its parameters are no dimensions, but coordinates all the same; those drawn by ratios lie over decades."""
    ratios = {"uniform": {"from": 1, "to": 300, "spacing": "logarithmic"}}
    drawn = {"runs": 16, "of": {K_0: ratios, "initial.T": {"uniform": {"from": 290, "to": 310}}}}
    swept = surfacechem.load("exothermic", {"sweep": {"sample": drawn}}).sweep()
    file = swept.write(tmp_path / "sample.nc")
    for dataset in (swept.dataset, xarray.open_dataset(file), file):
        effects = plots.figure(dataset, ["T_max"]).axes[1:]
        assert [ax.get_xscale() for ax in effects] == ["log", "linear"]
        assert effects[1].get_xlabel().startswith("Initial")
    counted = plots.figure(swept.dataset.drop_vars("time"), ["T"], "time")  # a dimension has at least its numbers
    assert counted.axes[0].lines[0].get_xdata().tolist() == list(range(swept.dataset.sizes["time"]))
    swept.dataset["T"] += 1000.0  # what a user changes is drawn
    assert min(line.get_ydata()[0] for line in swept.plot(["T"], "time").axes[0].lines) > 1200.0
    assert set(xarray.open_dataset(file).coords) == set(swept.dataset.coords) == {"K_0", "initial_T", "time"}


def test_what_cannot_be_drawn_is_refused(drawn, tmp_path):
    with pytest.raises(InputError, match=r"no variable 'T_lst' in the sweep. Did you mean 'T_last'"):
        plots.figure(drawn, ["T_lst"])
    with pytest.raises(InputError, match="is no readable store"):
        plots.figure(tmp_path / "missing.zarr")


def test_the_words_of_a_parameter_stay_inside_the_figure():
    plot = plots.figure(surfacechem.load("exothermic").sweep({K_0: [200.0, 300.0]}).dataset)
    plot.draw_without_rendering()
    words = plot.axes[-1].xaxis.label
    assert words.get_text().startswith("Temperature-independent part")
    assert plot.bbox.x0 <= words.get_window_extent().x0 < words.get_window_extent().x1 <= plot.bbox.x1
    assert [ax.get_ylabel() for ax in plot.axes] == ["Final $T$ [K]", "Final $\\phi$ [1]"]


@pytest.mark.parametrize("whole", [False, True])
def test_runs_that_failed_or_were_refused_are_told_and_in_no_line(whole, tmp_path):
    over = {"initial.T": [100.0, 300.0, 1000.0]}
    simulation = surfacechem.load("cooling-to-zero", {"run.max-steps": 50, "sweep": {"checked": 0, "over": over}})
    stream = simulation.stream(simulation.plan(), tmp_path / "o.zarr")
    data = simulation.sweep().dataset if whole else stream.run().dataset
    with data:
        ax = plots.figure(data).axes[0]
    assert "2 failed" in ax.get_title("left")
    ends, failed = ax.lines
    assert np.isnan(ends.get_ydata()).tolist() == [True, True, False]
    assert (failed.get_xdata().tolist(), failed.get_label()) == ([100, 300], "failed")


def test_a_figure_of_a_store_tells_the_error_of_its_checked_runs(tmp_path):
    """What differs by less than that is no result."""
    sweep = {"over": {"initial.T": [300.0, 310.0]}, "keep": {"last": ["T"]}}
    simulation = surfacechem.load("exothermic", {"run.rtol": 1e-5, "sweep": sweep})
    stream = simulation.stream(simulation.plan(), tmp_path / "o.zarr")
    with stream.run().dataset as data:
        assert "error unknown" in plots.figure(data).axes[0].get_title("left")
    checked = stream.check()
    with stream.store.dataset as data:
        assert f"error {checked.error:.1e} of the checked runs" in plots.figure(data).axes[0].get_title("left")
        for change, span in ((0.1 * checked.error, 600 * checked.error), (1e-15, 30.0)):
            close = data.assign(T_last=data["T_last"].copy(data=[300.0, 300.0 * (1 + change)]))
            assert np.ptp(plots.figure(close, ["T_last"]).axes[0].get_ylim()) == pytest.approx(span)
        close = data.assign(T_last=data["T_last"].copy(data=[300.0, 300.1]), v_max=data["T_last"])
        close["checked_error"] += 1e-2
        assert np.ptp(plots.figure(close, ["T_last"]).axes[0].get_ylim()) < 0.2


def test_ends_are_those_of_the_runs_also_where_they_stop_between_outputs(tmp_path):
    over = {"loading.Q_1": [-100.0, -50.0, -20.0]}
    case = surfacechem.load("cooling-to-zero", {"run.outputs": 5, "sweep": {"over": over, "keep": {"series": ["T"]}}})
    swept = case.sweep().dataset
    assert swept["T_last"].values[:2] == pytest.approx(0.0, abs=1e-3)
    assert swept["T_last"].values[2] == swept["T"].values[2, -1]
    ax = plots.figure(swept).axes[0]
    ends, stopped = ax.lines
    assert ends.get_ydata().tolist() == swept["T_last"].values.tolist()
    assert (stopped.get_xdata().tolist(), stopped.get_label()) == ([-100, -50], "stopped")
    assert ax.get_ylabel() == "Final $T$ [K]"
    # A store of series alone does not know its ends.
    with case.stream(case.plan(), tmp_path / "o.zarr").run().dataset as data:
        ax = plots.figure(data).axes[0]
        assert (ax.get_ylabel(), ax.lines[0].get_ydata()[0]) == ("Last output $T$ [K]", data["T"].values[0, 1])


def test_an_axis_reaches_as_far_as_a_sweep_whose_runs_are_refused(tmp_path):
    over = {"interface.potential.bond-energy.K_2": [300.0, 500.0, 700.0]}
    simulation = surfacechem.load("endothermic", {"reference": None, "sweep": {"checked": 0, "over": over}})
    with simulation.stream(simulation.plan(), tmp_path / "o.zarr").run().dataset as data:
        ax = plots.figure(data).axes[0]
    assert ax.get_title("left") == "2 finished, 1 refused"
    assert ax.get_xlim()[1] > 700


def test_points_are_marked_where_they_are_few_and_modes_are_points_without_a_line(tmp_path):
    def lines(points):
        over = {"loading.w_n.ramp.rate": {"from": 1e-7, "to": 5e-6, "points": points}}
        section = {"checked": 0, "over": over, "keep": {"last": ["T", "bonded"]}}
        simulation = surfacechem.load("debonding", {"reference": None, "sweep": section})
        with simulation.stream(simulation.plan(), tmp_path / f"{points}.zarr").run().dataset as data:
            return [ax.lines[0] for ax in plots.figure(data, ["T_last", "bonded_last"]).axes]

    looks = [[(line.get_linestyle(), line.get_marker()) for line in lines(points)] for points in (9, 200)]
    assert looks == [[("-", "o"), ("None", "o")], [("-", ""), ("None", "o")]]


def test_a_large_number_has_its_power_in_the_words_of_its_axis():
    over = {K_0: [100.0, 300.0], "initial.T": [290.0, 310.0], C_R: [1e15, 1e16]}
    plot = surfacechem.load("exothermic").sweep(over).plot()
    plot.canvas.draw()
    assert {ax.xaxis.get_offset_text().get_text() for ax in plot.axes} == {""}
    assert plot.axes[-1].get_xlabel().endswith("[10¹⁶ J⁻¹ s⁻¹]")
    assert plot.axes[-1].get_xticklabels()[-1].get_text().startswith(("1", "0.8"))
    assert plot.axes[0].get_title("left").startswith("8 finished")


@pytest.fixture(scope="module")
def spectrum():
    rates = {"loading.f.ramp.rate": [1e-12, 1e-10, 1e-9]}
    return surfacechem.load("force-spectroscopy").sweep(rates, {"f": "150 pN"}).dataset


def words(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_lifetimes_are_those_under_a_constant_force_at_every_rate(spectrum):
    exact = np.exp(-spectrum["f"].values * 0.4e-9 / (BOLTZMANN * 300)) / 0.1
    found, known = spectrum["lifetime"].values, np.isfinite(spectrum["lifetime"].values)
    assert np.all(known.sum(axis=1) > 30)
    assert np.allclose(found[known], np.broadcast_to(exact, found.shape)[known], rtol=1e-9)


def test_the_figure_has_spectrum_distributions_and_lifetimes(spectrum):
    forces, density, lifetime = plots.figure(spectrum).axes
    assert (forces.get_xlabel(), forces.get_xscale()) == ("Loading rate of $f$ [pN s⁻¹]", "log")
    assert words(forces) == ["most probable", "median", "mean", "exact"]
    assert forces.get_ylabel() == "$f$ at rupture [pN]"
    # Exact values are known at the swept rates only: black dots on the points of the runs, no line between them.
    assert {line.get_linestyle() for line in forces.get_lines()} == {"None"}
    dots = [line for line in forces.get_lines() if line.get_color() == "black"]
    assert forces.get_legend().get_lines()[-1].get_color() == "black"
    for line, which in zip(dots, ("mode", "median", "mean"), strict=True):
        assert line.get_ydata() == pytest.approx(spectrum[f"f_{which}_exact"].values / 1e-12)
    assert words(density) == [f"rate = {rate} pN s⁻¹" for rate in (1, 100, 1000)]
    assert (density.get_yscale(), lifetime.get_yscale()) == ("linear", "log")
    (common,) = lifetime.get_lines()  # as the curves of all rates coincide
    assert np.isfinite(common.get_ydata()).sum() == np.isfinite(spectrum["lifetime"].values).any(axis=0).sum()
    assert lifetime.get_title("right") == "the curves of all runs coincide"
    for line in density.get_lines():
        x, y = (values[np.isfinite(line.get_ydata())] for values in line.get_data())
        assert np.trapezoid(y, x / 1e-12) == pytest.approx(1, abs=2e-3)  # [1/pN] over [pN]
        assert y.min() >= 0


def test_each_distribution_is_seen_where_peaks_differ_much_or_bonds_break_at_once(spectrum):
    """As those of a catch bond, most of which break before there is a force."""
    over = {"loading.f.ramp.rate": [1e-12, 1e-11, 1e-9]}
    case = surfacechem.load("catch-bond", {"loading.f": {"ramp": {"rate": "1 pN/s"}}})
    density = plots.figure(case.sweep(over, {"f": "150 pN"}).dataset).axes[1]
    assert (len(density.get_lines()), density.get_yscale()) == (3, "log")
    peaks = [np.nanmax(line.get_ydata()) for line in density.get_lines()]
    low, high = density.get_ylim()
    assert 0 < low < min(peaks) < max(peaks) < high
    over["loading.f.ramp.rate"] = np.geomspace(1e-14, 1e-9, 20)  # of many rates those with a peak
    many = surfacechem.load("force-spectroscopy").sweep(over, {"f": "150 pN"}).dataset
    density = plots.figure(many).axes[1]
    assert density.get_title("right") == "7 of 20 runs"
    assert all(np.nanargmax(line.get_ydata()) > 0 for line in density.get_lines())


def test_ruptures_of_a_sample_are_distributions_and_their_survival_is_over_the_load():
    of = {"interface.bonding.bell.k_off": {"lognormal": {"median": 0.1, "sigma": 0.5}}}
    case = surfacechem.load("force-spectroscopy", {"sweep": {"sample": {"of": of, "runs": 16}, "until": {"f": 2e-10}}})
    data = case.sweep().dataset
    plot = plots.figure(data)
    assert [ax.get_ylabel().split("{")[2][:4] for ax in plot.axes[::2]] == ["mode", "medi", "mean"]
    assert plot.axes[0].lines[1].get_ydata()[0] == np.median(data["f_mode"])
    assert plots.figure(data, ["survival"]).axes[0].get_xlabel() == "$f$ [pN]"


def test_a_second_parameter_has_colours_and_statistics_have_markers():
    over = {"loading.f.ramp.rate": [1e-11, 1e-10, 1e-9], "interface.bonding.bell.k_off": [0.1, 1.0]}
    forces, *_ = plots.figure(surfacechem.sweep("force-spectroscopy", over, {"f": "150 pN"}).dataset).axes
    rates = [rf"$k_{{\mathrm{{off}}}}$ = {rate} s⁻¹" for rate in (0.1, 1)]
    assert words(forces) == [*rates, "most probable", "median", "mean", "exact"]
    drawn = [line for line in forces.get_lines() if len(line.get_xdata())]
    assert len({line.get_color() for line in drawn} - {"black"}) == 2
    assert {line.get_marker() for line in drawn if line.get_color() != "black"} == {"o", "s", "D"}


def test_lifetimes_under_constant_forces_have_a_figure():
    data = surfacechem.sweep("bond-lifetimes", {"loading.f": [0, 1e-11, 4e-11]}).dataset
    above, below = plots.figure(data).axes
    points, exact = (line for line in above.get_lines() if len(line.get_xdata()))
    assert points.get_xdata().tolist() == [0, 1e-11, 4e-11]
    assert points.get_ydata() == pytest.approx(exact.get_ydata(), rel=1e-11)
    assert (above.get_xlabel(), above.get_yscale()) == ("Force per bond $f$ [pN]", "log")
    assert (len(below.get_lines()), below.get_xscale()) == (3, "log")
    assert words(below) == ["$f$ = 0 pN", "$f$ = 10 pN", "$f$ = 40 pN"]


def test_survival_is_followed_and_drawn_over_decades():
    """That of each run to a thousandth, whose lifetimes are decades apart, though no times are asked for."""
    case = surfacechem.load("bond-lifetimes", ["run={until: 1 h}"])
    data = case.sweep({"loading.f": [0.0, 4e-11, 8e-11]}).dataset
    _, below = plots.figure(data).axes
    assert below.get_xscale() == "log"
    for line, lifetime in zip(below.get_lines(), data["lifetime"].values, strict=True):
        t = np.geomspace(lifetime / 100, 5 * lifetime, 50)
        assert np.interp(t, *line.get_data()) == pytest.approx(np.exp(-t / lifetime), abs=1e-3)


def test_variables_are_drawn_over_the_load_or_over_the_rate(spectrum):
    over_load = plots.figure(spectrum, ["density_f", "survival"]).axes
    assert {ax.get_xlabel() for ax in over_load} == {"Force per bond, tension positive $f$ [pN]"}
    (each,) = plots.figure(spectrum, ["phi"], "f").axes
    assert [len(line.get_xdata()) for line in each.get_lines()] == 3 * [spectrum.sizes["f"]]
    (alone,) = plots.figure(spectrum, ["lifetime"]).axes  # beside its headings there is no room
    assert (alone.get_title("right"), alone.get_title("left")[-17:]) == ("", "all runs coincide")
    (over_rate,) = plots.figure(spectrum, ["f_mean"]).axes
    assert over_rate.get_lines()[0].get_xdata().tolist() == [1e-12, 1e-10, 1e-9]
