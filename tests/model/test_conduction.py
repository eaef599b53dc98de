"""Bodies divided into cells: second order in space, exact solutions, both laws, cells by accuracy, Biot numbers."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erfc, erfcx

import surfacechem
from surfacechem import plots
from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.laws.factors import Linear
from surfacechem.references.base import SceneView
from surfacechem.results import spatial
from surfacechem.results.error_estimates import against_tighter, with_cells
from surfacechem.results.matching import match
from surfacechem.results.spatial import cell_errors
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import graded

TWO = """
title: two slabs
bodies:
  lower: {{temperature: {first}, capacity: {capacity}, C: 4 kJ/m^2/K, conduction: {{{lower}}}}}
  upper: {{temperature: {second}, capacity: {capacity}, C: 9 kJ/m^2/K, conduction: {{{upper}}}}}
heat: [{heat}]
T_0: 300 K
initial: {{{initial}}}
run: {{times: [1, 3, 10, 30], rtol: 1e-11}}
"""
LOWER = "thickness: 2 mm, conductivity: 0.2 W/m/K"
FAR = {
    "insulated": "",
    "held": ", far: {temperature: 330 K}",
    "convective": ", far: {temperature: 330 K, h: 50 W/m^2/K}",
}


def two(cells, far="insulated", grading=1.0, perfect=False, h="400", capacity="constant", exact=True) -> Simulation:
    """Two slabs in contact, perfect or through a resistance."""
    more = f", cells: {cells}, grading: {grading}"
    text = TWO.format(
        **{"first": "T", "second": "T"} if perfect else {"first": "T_1", "second": "T_2"},
        capacity=capacity,
        lower=LOWER + more,
        upper="thickness: 5 mm, conductivity: 0.7 W/m/K" + more + FAR[far],
        heat="" if perfect else f"conductance: {{between: [lower, upper], h: {h}}}",
        initial="profile_1: 400 K, profile_2: 300 K" if perfect else "T_1: 400 K, T_2: 300 K",
    )
    return Simulation(load_text(text + "reference: conducting-slabs\n" * exact))


def errors(simulation: Simulation) -> np.ndarray:
    """Largest error [K] at each output time after the start."""
    run = simulation.run()
    assert run.accuracy.source == "exact solution conducting-slabs"
    dataset = run.dataset
    parts = [abs(dataset[f"profile_{k}"] - dataset[f"profile_{k}_exact"]).max(f"x_{k}").values[1:] for k in (1, 2)]
    return np.max(parts, axis=0)


@pytest.mark.parametrize(("far", "grading", "perfect"), [("convective", 10, False), ("insulated", 1, True)])
def test_second_order_in_space(far, grading, perfect):
    """Of a held far side the table of the documentation says so, below."""
    coarse, fine = (errors(two(cells, far, grading, perfect)) for cells in (20, 40))
    assert np.all(np.log2(coarse / fine) > 1.9)
    assert np.all(fine < 4 * 0.03)


def test_the_table_of_the_documentation():
    """Cells, error at 1 s, order, at 10 s, order, at 30 s, order."""
    page = (Path(__file__).parents[2] / "docs" / "heat-paths.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in re.findall(r"^\| \d+ \|.*\|.*e-.*$", page, re.M)]
    table = np.array([errors(two(int(row[0]), "held"))[[0, 2, 3]] for row in rows])
    np.testing.assert_allclose([[float(cell) for cell in row[1::2]] for row in rows], table, rtol=5e-3)
    shown = [[float(cell) for cell in row[2::2]] for row in rows[1:]]
    np.testing.assert_allclose(shown, np.log2(table[:-1] / table[1:]), atol=6e-3)
    assert len(rows) == 3


def test_chains_are_solved_as_the_whole_matrix_is():
    simulation = two(20, "convective", grading=5)
    ours = simulation.run(error="balances").trajectory.result
    other = simulation.model.solve(replace(simulation.case.run, solver="ida", rtol=1e-9)).result
    np.testing.assert_allclose(other.outputs, ours.outputs, rtol=2e-7)


def test_conductivity_that_varies_with_temperature(monkeypatch: pytest.MonkeyPatch):
    """The steady flux through a slab is the mean conductivity times the gradient, for any cells."""
    monkeypatch.setattr(Linear, "ranges", {"x": (200.0, 380.0)})
    varying = "{value: 0.2 W/m/K, times: [linear: {of: T_1, about: 300 K, slope: 0.004}]}"
    text = f"""
bodies:
  lower:
    temperature: 400 K
    C: 4 kJ/m^2/K
    conduction: {{thickness: 2 mm, conductivity: {varying}, cells: 6, far: {{temperature: 300 K}}}}
  upper: {{temperature: 400 K}}
T_0: 300 K
initial: {{profile_1: 350 K}}
run: {{until: 1 hour}}
"""
    run = Simulation(load_text(text)).run(error="balances")
    assert run.dataset.Q_T_far_1[-1] == pytest.approx(-0.2 * 1.2 * 100 / 2e-3, rel=1e-9)
    assert run.audit.violations == ()
    assert "linear is an extrapolation: T_1 ran from 400 to 400, its range is 200 to 380" in run.warnings
    with pytest.raises(InputError, match=r"conductivity left its range \(> 0\) as it varies"):
        Simulation(load_text(text.replace("0.004", "-0.012"))).run()


def test_a_search_that_ends_early_states_the_error_of_its_last_cells(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(spatial, "MOST_GRIDS", 1)
    simulation = Simulation(load_text(two("{accuracy: 1e-3}").case.text.replace("times: [1, 3, 10, 30]", "until: 30")))
    chosen, (trajectory,), errors = simulation._resolved(simulation.case.run, {})
    assert spatial.grid(chosen.case.scene) != spatial.grid(simulation.case.scene)
    assert errors == [chosen._halved(trajectory, given=False)]


def test_a_sweep_takes_the_cells_that_its_runs_need_and_states_what_they_leave():
    conductivities = np.array([20.0, 0.02])
    stated = {}
    for cells in ("{accuracy: 1e-4}", "24"):
        simulation = one(cells, "until: 0.2 s, outputs: 11", h=2e3, hot=400.0)
        swept = simulation.sweep({"bodies.a.conduction.conductivity": conductivities})
        exact = [touched(0.0, swept.dataset.time[1:] * k / 50.0, 10.0 / k)[:, 0] for k in conductivities]
        true = np.max(abs(swept.dataset.T_1[:, 1:] / (300 + 100 * np.array(exact)) - 1), axis=1).values
        stated[cells] = swept.accuracy.errors
        assert np.all((stated[cells] > 0.8 * true) & (stated[cells] < 4 * true + 1e-10)), (stated[cells], true)
    assert np.all(stated["{accuracy: 1e-4}"] < 1e-4)
    assert max(stated["24"]) > 1e-3


def test_an_accuracy_out_of_reach_is_said(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(spatial, "MOST_CHOSEN_CELLS", 16)
    warnings = two("{accuracy: 1e-9}", perfect=True, exact=False).run().warnings
    assert any("the accuracy 1e-09 of the cells is not reached" in warning for warning in warnings)


def test_profiles_have_their_places_in_the_file(tmp_path):
    import xarray

    run = two(10, "held", grading=4).run(error="balances")
    with xarray.open_dataset(run.write(tmp_path / "run.nc")) as file:
        assert file.profile_2.dims == ("time", "x_2")
        np.testing.assert_allclose(file.x_2, 5e-3 * np.array(graded(10, 4)), rtol=1e-14)
        assert file.profile_2[-1, -1] == 330
        assert np.array_equal(file.profile_1[:, 0], file.T_1)
        assert not any(name.startswith("T_1_x") for name in file)


def test_profiles_are_drawn_over_places():
    dataset = two(10).run(error="balances").dataset
    (axes,) = plots.figure(dataset, ["profile_1", "profile_2"]).axes
    assert len(axes.get_lines()) == 2 * dataset.sizes["time"]
    assert "Distance from the contact" in axes.get_xlabel()
    with pytest.raises(InputError, match="T_1 goes over time"):
        plots.figure(dataset, ["profile_1", "T_1"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cells: 8", "cells: 7", "cells must be even"),
        ("cells: 8", "cells: many", "no choice of cells 'many'"),
        ("cells: 8, ", "", "conduction needs `cells`"),
        ("cells: 8", "cells: lump", "has no far side"),
        ("thickness: 2 mm", "thickness: 0 mm", "outside its range"),
        ("far: {temperature: 330 K}", "far: warm", "the far side is `insulated`"),
        ("far: {temperature: 330 K}", "far: {h: 3}", "the far side needs `temperature`"),
        ("C: 4 kJ/m^2/K, ", "", "conducts heat but stores none"),
        ("T_1: 400 K", "T_1: 400 K, profile_3: 300 K", "'profile_3'. Did you mean 'profile_1'?"),
        ("T_1: 400 K", "T_1: 400 K, profile_1: -1 K", "profile_1"),
        ("[lower, upper]", "[lower, surroundings]", "would end at its contact"),
        ("0.2 W/m/K", "{value: 0.2, times: [linear: {of: T_2, slope: 1}]}", "varies with its own temperature only"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(old, new, message):
    text = """
bodies:
  lower:
    {temperature: T_1, C: 4 kJ/m^2/K, conduction: {thickness: 2 mm,
     conductivity: 0.2 W/m/K, cells: 8, far: {temperature: 330 K}}}
  upper: {temperature: T_2, C: 9 kJ/m^2/K}
surroundings: {temperature: 300 K}
heat: [conductance: {between: [lower, upper], h: 400 W/m^2/K}]
T_0: 300 K
initial: {T_1: 400 K, T_2: 300 K}
run: {until: 1 s}
"""
    assert text.count(old) == 1
    with pytest.raises(InputError, match=re.escape(message)):
        Simulation(load_text(text.replace(old, new))).run()


def test_a_run_changes_what_the_format_has_and_refuses_what_it_refuses():
    runs = two(6, "convective").sweep({"bodies.upper.conduction.far.h": [50.0, 150.0]})
    assert np.diff(runs["T_2"][..., -1].values.ravel()) > 2.0
    with pytest.raises(InputError, match=r"initial.profile_1 = 0 is outside its range: > 0"):
        two(6, perfect=True).run({"initial.profile_1": 0.0})


def test_an_exact_solution_of_another_scene_is_not_used():
    law = "{potential: [constant-interface-capacity: {C_c: 1}], temperature: T}"
    varying = "{value: 1, times: [linear: {of: T_2, slope: 1e-3}]}"
    cases = {
        "the interface has laws of its own": [f"interface={law}", "initial.T=310 K"],
        "the heat capacity of glass varies": ["bodies.glass.capacity=quadratic"],
        "the conductivity of glass varies": [f"bodies.glass.conduction.conductivity={varying}"],
    }
    cells = [f"bodies.{name}.conduction.cells=4" for name in ("epoxy", "glass")]
    for reason, change in cases.items():
        simulation = surfacechem.load("sudden-contact", [*cells, *change, "run.until=1 s"])
        run = simulation.run(error="balances").trajectory
        with pytest.raises(InputError, match=reason):
            match("conducting-slabs", {}, SceneView(simulation.case.scene, run))
    source = simulation.run().accuracy.source
    assert reason in source
    assert "one with cells that suit" in source


# -- temperatures of slabs in closed form: Carslaw & Jaeger (1959), sections 2.7, 2.9, 3.4 and 3.11; lengths in units of
# the thickness, times in those of L^2 / alpha

EARLY = 5e-3
"""Time up to which the far side feels less than 1e-15, and from which forty eigenfunctions are enough."""


def ierfc(z):
    """Integral of the complementary error function."""
    return np.exp(-(z**2)) / np.sqrt(np.pi) - z * erfc(z)


def heated(x, t):
    """Rise by a unit flux into the face of a slab that is insulated behind, shape (times, places)."""
    x, t = np.atleast_1d(x)[None, :], np.atleast_1d(t)[:, None]
    early = 2 * np.sqrt(t) * ierfc(x / (2 * np.sqrt(t)))
    n = np.arange(1, 41)[:, None, None]
    modes = (-1.0) ** n * np.exp(-((n * np.pi) ** 2) * t) * np.cos(n * np.pi * (1 - x)) / (n * np.pi) ** 2
    late = t + (3 * (1 - x) ** 2 - 1) / 6 - 2 * modes.sum(axis=0)
    return np.where(t < EARLY, early, late)


def touched(x, t, biot):
    """Rise from 0 of a slab insulated behind towards 1 that acts on its face through a conductance."""
    x, t = np.atleast_1d(x)[None, :], np.atleast_1d(t)[:, None]
    z = x / (2 * np.sqrt(t))
    early = erfc(z) - np.exp(-(z**2)) * erfcx(z + biot * np.sqrt(t))
    late = np.ones_like(early)
    for n in range(40):
        low, high = n * np.pi, (n + 0.5) * np.pi
        root = brentq(lambda r: r * np.sin(r) - biot * np.cos(r), low, high, xtol=1e-15, rtol=1e-14)
        weight = 4 * np.sin(root) / (2 * root + np.sin(2 * root)) if root else 1.0
        late = late - weight * np.exp(-(root**2) * t) * np.cos(root * (1 - x))
    return np.where(t < EARLY, early, late)


# -- layers thinner than a cell ---------------------------------------------------------------------------------------

ONE = """
T_0: 300 K
bodies:
  a:
    {{temperature: T_1, capacity: constant, C: 1e4, conduction: {{thickness: 5 mm, conductivity: 0.2, cells: {cells}}}}}
  b: {{temperature: {hot} K}}
heat: [conductance: {{between: [a, b], h: {h!r}}}]
loading: {{Q_1: {flux}}}
initial: {{T_1: 300 K}}
run: {{{run}}}
"""


def one(cells: object, run: str, h: float = 1e-9, flux: object = 0.0, hot: float = 500.0) -> Simulation:
    """A bad conductor that something acts on for a moment."""
    return Simulation(load_text(ONE.format(cells=cells, run=run, h=h, flux=flux, hot=hot)))


def test_cells_follow_from_the_case_and_never_from_the_outputs():
    asked = ("until: 0.2 s", "times: [1 us, 0.2]")
    runs = [one("{accuracy: 1e-2}", run, h=2e3, hot=400.0).run(error="balances") for run in asked]
    assert len({run.attributes["cells_1"] for run in runs}) == 1
    assert len({run.dataset.T_1.values[-1] for run in runs}) == 1
    sooner = one("{accuracy: 1e-2, after: 0.1 ms}", asked[0], h=2e3, hot=400.0).run(error="balances")
    assert sooner.attributes["cells_1"] > runs[0].attributes["cells_1"]


def test_an_error_that_does_not_converge_is_unknown():
    found = cell_errors({"T_1": 1e-4}, {"T_1": 5e-5}, rtol=1e-11)
    assert not found.converged
    assert np.isnan(found.largest)
    one_pair_differs = cell_errors({"T_1": 1e-4, "event times": np.inf}, {"T_1": 4e-4}, rtol=1e-11)
    assert not one_pair_differs.converged
    assert np.isnan(one_pair_differs.largest)
    run = two(4).run()
    estimate = with_cells(against_tighter(run.trajectory), found)
    assert np.isnan(estimate.error)
    assert estimate.source.startswith("unknown: the error of the cells")


def random_slab(random: np.random.Generator) -> tuple[Simulation, float, object]:
    """A slab of any properties that is heated or touched, between 1e-6 and 100 times of its diffusion time: its
    simulation, the accuracy asked for, and its temperatures by places and times.
    """
    C, L, k = (float(10 ** random.uniform(*span)) for span in ((2, 5), (-4, -1), (-1.5, 2.5)))
    time, length = C * L / k, float(10 ** random.uniform(-6, 2))
    asked = float(random.choice([1e-3, 1e-4, np.inf]))
    outputs, end = int(random.integers(3, 60)), length * time
    first = float(end * 10 ** random.uniform(-4, -0.5))
    spacing = f", spacing: logarithmic, first: {first!r}" if random.random() < 0.5 else ""
    after = f", after: {first!r}" if spacing else ""
    rise, biot = float(random.uniform(10, 300)), float(10 ** random.uniform(-3, 3))
    flux = float(rise / heated(0.0, length)[0, 0] * k / L)
    heats = bool(random.random() < 0.5)
    text = f"""
T_0: 300 K
bodies:
  a:
    temperature: T_1
    capacity: constant
    C: {C!r}
    conduction:
      thickness: {L!r}
      conductivity: {k!r}
      cells: {f"{{accuracy: {asked}{after}}}" if np.isfinite(asked) else 2 * random.integers(1, 40)}
  b: {{temperature: {300 + rise!r}}}
heat: [conductance: {{between: [a, b], h: {0.0 if heats else biot * k / L!r}}}]
loading: {{Q_1: {flux if heats else 0.0!r}}}
initial: {{T_1: 300 K}}
run: {{until: {end!r}, outputs: {outputs}{spacing}}}
"""

    def exact(x, t):
        x, t = x / L, t / time
        return 300 + (flux * L / k * heated(x, t) if heats else rise * touched(x, t, biot))

    return Simulation(load_text(text)), asked, exact


@pytest.mark.parametrize(
    ("seed", "scenes"), [(1, 3), *(pytest.param(seed, 60, marks=pytest.mark.slow) for seed in range(2, 8))]
)
def test_random_slabs_are_as_accurate_as_they_say(seed, scenes):
    random = np.random.default_rng(seed)
    for i in range(scenes):
        simulation, asked, exact = random_slab(random)
        run = simulation.run()
        values = exact(run.dataset.x_1.values, run.dataset.time.values[1:])
        true, stated = np.max(abs(run.dataset.profile_1.values[1:] / values - 1)), run.accuracy.error
        assert true <= asked, (seed, i, true)
        assert true < 1.4 * stated, (seed, i, true, stated)
        assert stated < 20 * true + 1e-9, (seed, i, true, stated)
