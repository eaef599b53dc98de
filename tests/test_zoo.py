"""What holds for every scene: both laws, derivatives, edges, approved values; and for the run of every shipped case."""

import json
import random
import re
from dataclasses import replace
from pathlib import Path

import equation_values
import golden_values
import mpmath
import numpy as np
import pint
import pytest
import symengine
import thermodynamics as laws
import xarray
from case_runs import at_even_times, load, solved
from sampling import every
from zoo import MEMBERS, each

import surfacechem
from surfacechem.compile.program import compile_function, compile_program
from surfacechem.expressions import derivative, magnitude
from surfacechem.format import names
from surfacechem.format.plans import Axis, Plan
from surfacechem.runs.keeping import EXTREMES, SINGLE_COLUMNS, at_end, extremes
from surfacechem.tolerances import ULPS

ROOT = Path(__file__).parents[1]
REGISTRY = pint.UnitRegistry()

every_case = pytest.mark.parametrize("name", names())
REFERENCED = [member.name for member in MEMBERS.values() if "exact" in member.tags]

# -- equations --------------------------------------------------------------------------------------------------------


@each(cases=6)
def test_both_laws_of_thermodynamics_hold_on_the_equations(member):
    """Where a gap is in equilibrium its rate follows from that: a point at which the index is one, or Newton fails.

    No law destroys entropy; the far field pulls forward, so that sliding backward is left before it gives back heat.
    """
    point = laws.consistent_point(member.system, 0, member.modes)
    assert laws.first_law_holds(member.system, point, member.digits)
    assert laws.second_law_holds(member.system, point, member.digits)
    if "scene" in member.tags and member.modes.get("slip", 0.0) >= 0:
        produced = laws.productions(member.system, point).items()
        assert all(value >= 0 for law, value in produced if "prescribed" not in law)


@each("scene")
def test_every_expression_keeps_its_approved_value(member):
    """After a change that is meant: `python tests/equation_values.py`, and look at the difference."""
    approved = json.loads(equation_values.TABLE.read_text())[member.name]
    assert equation_values.computed(member) == pytest.approx(approved, rel=1e-12, abs=1e-40)


@pytest.mark.parametrize("name", [name for name, member in MEMBERS.items() if "scene" in member.tags][::5])
def test_the_magnitude_of_an_expression_bounds_the_error_of_its_machine_code(name):
    system, point = equation_values.away(MEMBERS[name])
    inputs = np.array([float(point[symbol]) for symbol in system.inputs])
    point = {symbol: mpmath.mpf(value) for symbol, value in zip(system.inputs, inputs.tolist(), strict=True)}
    items = [system.expand(expression) for _, expression in equation_values.parts(system)]
    exact = [laws.number(item, point) for item in items]
    values, bounds = (compile_function(system.inputs, f)(inputs) for f in (items, [magnitude(item) for item in items]))
    errors = np.array([float(abs(mpmath.mpf(float(v)) - e)) for v, e in zip(values, exact, strict=True)])
    assert np.all(errors <= ULPS * bounds)
    assert np.all(bounds >= np.abs(values) * (1 - ULPS))


@each(cases=6)
def test_compiled_jacobians_are_those_of_their_equations(member):
    """By differences in 60 digits; for a case in modes drawn at random, and away from what the equations ask for."""
    system, draw = member.system, random.Random(member.name)
    if "scene" in member.tags:
        point = laws.consistent_point(system, draw.randrange(9), member.modes)
    else:
        modes = {mode.name: draw.choice([*mode.words]) for mode in system.modes}
        rates = {s.dot: mpmath.mpf(draw.uniform(-1, 1) * (abs(s.initial) or s.scale)) for s in system.states}
        point = laws.start_point(system, draw.randrange(9), modes) | rates
    states, rates = [s.symbol for s in system.states], [s.dot for s in system.states]
    rows, unknowns = system.residual(), [*states, *rates]
    program = compile_program(system.t, states, rates, [p.symbol for p in system.parameters], rows)
    found = np.concatenate(program.derivatives([float(point[x]) for x in system.inputs]), axis=1)
    for row, equation in enumerate(rows):
        # A derivative may be a difference of large terms: relative to what it does to its equation.
        size = max(abs(float(point[y]) * value) for y, value in zip(unknowns, found[row], strict=True))
        for column, x in enumerate(unknowns):
            known = x in equation.free_symbols
            exact = float(laws.slope(equation, x, point)) if known else 0.0
            rounding = 1e-12 * size / max(abs(float(point[x])), 1e-300) if known else 0.0
            assert found[row, column] == pytest.approx(exact, rel=1e-9, abs=rounding)


@each(cases=6)
def test_equations_are_linear_in_the_rates(member):
    for row in member.system.residual():
        rates = [s.dot for s in member.system.states if s.dot in row.free_symbols]
        assert all(derivative(derivative(row, a), b) == 0 for a in rates for b in rates)


@each()
def test_guards_read_modes_only_where_their_limit_depends_on_them(member):
    """A guard is in play in some modes; only a fold and a strength depend on them."""
    modes = {mode.symbol for mode in member.system.modes}
    reading = {e.name for e in member.system.edges if symengine.sympify(e.guard).free_symbols & modes}
    assert reading <= {"snap", "debond"}


def test_the_page_on_events_names_every_edge():
    """Those of all members, and those that the assembly spells out."""
    sources = "".join(path.read_text() for path in (ROOT / "surfacechem" / "model").rglob("*.py"))
    spelt = set(re.findall(r'Edge\(\s*"([^"]+)"', sources))
    assert {"soften", "tear", "rejoin", "open"} <= spelt
    happen = {edge.name for member in MEMBERS.values() for edge in member.system.edges}
    assert {"loosen", "debond", "snap", "touch", "stop"} <= happen
    page = (ROOT / "docs" / "events.md").read_text(encoding="utf-8")
    told = set(re.findall(r"`([^`]+)`", " ".join(re.findall(r"^\| (`.*?) \|", page, re.MULTILINE))))
    assert {name for name in spelt | happen if not name.startswith("end of ")} <= told


# -- the run of every shipped case ------------------------------------------------------------------------------------

STOPPED = {
    "cooling-to-zero": "the temperature T reached zero",
    "adhesion-cluster": "the bonds ruptured",
    "shared-load-rupture": "the bonds ruptured",
}
"""Cases that end early, and why."""

FLAGGED = ("debonding-cooling",)
"""Cases that are shown because they violate the second law."""

ASKING = ("diamond-growth", "lithium-charging", "lithium-polarisation", "temperature-programmed-desorption")
"""Cases of which Cantera gives the rates."""

CELLS = {"sudden-contact": 1e-4, "epoxy-cure-thick": 6e-5}
"""Cases whose bodies are divided into cells, and the accuracy that these have; the second asks for 1e-4 itself."""

FOLDS = {"sticky-sphere": 1e-9 / (2 * 1e-6**0.5), "cohesive-cycles": 1e-9 / (2 * 1e-6**0.5)}
"""Cases whose tractions are known to 1e-9, integrated over surfaces or along a run at 1e-10: up to a millionth of the
run before a fold that falls like the root of the time that is left."""


@every_case
def test_a_case_runs_to_a_true_status_with_closed_balances(name):
    solution = solved(name)
    assert solution.status == ("stopped" if name in STOPPED else "finished")
    assert STOPPED.get(name, "reached the end") in solution.reason
    assert solution.audit.energy_error < 1e-9
    assert solution.audit.violations == ()
    assert ("destroys entropy" in solution.attributes["warnings"]) is (name in FLAGGED)
    assert all(np.isfinite(column.values).all() for column in solution.columns if column.values.dtype == float)


@every_case
def test_a_case_meets_its_exact_solution(name):
    case, accuracy = load(name).case, solved(name).accuracy
    if case.reference:
        assert accuracy.source == f"exact solution {case.reference.name}"
        assert accuracy.error < (CELLS | FOLDS).get(name, 1e-8)
    else:
        assert accuracy.source.startswith("estimate")
        assert accuracy.error < CELLS.get(name, 1e-7)


FOLLOWING = {"adhesion-cluster": 500, "van-der-waals-sphere": 300}
FOLLOWING |= {"stick-slip": 1000, "stick-slip-debonding": 1000, "stick-slip-rebonding": 1000}
"""Errors over tolerances: close to a fold, with tractions that are integrated, and of velocities within brief slips."""


@pytest.mark.parametrize("name", [name for name in REFERENCED if name not in CELLS])
def test_the_error_of_a_case_follows_its_tolerance_in_few_steps(name):
    simulation = load(name)
    for rtol in (1e-3, 1e-6, 1e-9, 1e-13):
        solution = simulation.run(run=replace(simulation.case.run, rtol=rtol, accuracy=None))
        assert solution.status == ("stopped" if name in STOPPED else "finished")
        assert solution.accuracy.error < FOLLOWING.get(name, 100) * rtol
        assert solution.audit.violations == ()
        assert solution.trajectory.result.counters.steps < 400


@every_case
def test_exact_curves_lie_on_those_of_a_case_also_beside_events(name):
    columns = {column.name: column.values for column in solved(name).columns}
    # Bonds that rupture have no slope at the end, where the last digits of the time are seen.
    told = slice(int(np.searchsorted(columns["time"], (1 - 1e-9) * columns["time"][-1])) if name in STOPPED else None)
    for exact in (own for own in columns if own.endswith("_exact")):
        apart = np.abs(columns[exact] - columns[exact.removesuffix("_exact")])[told].max()
        assert apart <= 1e-3 * np.ptp(columns[exact]) + 1e-12 * np.abs(columns[exact]).max()


@pytest.mark.parametrize("name", every(3, [name for name in names() if name not in {*CELLS, *ASKING}]))
def test_explicit_steps_serve_a_case_as_well(name):
    """Held against the exact solution, else against implicit steps."""
    simulation = load(name)
    solution = simulation.run(run=replace(simulation.case.run, solver="dop853", accuracy=None))
    assert solution.status == ("stopped" if name in STOPPED else "finished")
    # A force that grows without end shows a millionth of the run before it what its time errs by, 1e-13, as 1e-7.
    known = simulation.case.reference and name not in STOPPED
    assert solution.accuracy.error < FOLDS.get(name, 1e-8 if known else 1e-7)
    assert solution.audit.energy_error < 1e-9
    assert solution.audit.violations == ()


TIME = 1024
"""Another unit of time in seconds, a power of two, so that nothing is rounded."""

OTHERWISE = {"anisotropic-slide", "bouncing-plate", "coulomb-stop", "stick-slip", "stick-slip-debonding"} | {
    *("stick-slip-rebonding", "compliant-debonding", "sticky-sphere", "van-der-waals-sphere"),
    *("rate-and-state-slip-law", "rate-and-state-velocity-steps"),
}
"""Cases with a velocity, the least size of which is one, with the logarithm of a time, or with a table of loads."""


@pytest.mark.around
@pytest.mark.parametrize("name", every(3, [name for name in REFERENCED if name not in OTHERWISE]))
def test_a_case_is_the_same_in_another_unit_of_time(name):
    """To the last bit: no number of the code has the dimension of a time. Masses change so that energies do not."""
    one, run, given = load(name).model, replace(load(name).case.run, picture=None), {}
    for path, value in one.values().items():
        unit = one.system.changeable.get(path, "1")
        powers = {} if unit == "1" else REGISTRY.parse_expression(unit).dimensionality
        if value and (power := powers.get("[time]", 0) + 2 * powers.get("[mass]", 0)):
            given[path] = f"{value * TIME**power!r} {unit}"
    slow = replace(run, times=tuple(TIME * t for t in run.times))
    other = surfacechem.load(name, given).model.solve(slow)
    assert np.array_equal(one.solve(run).result.outputs, other.result.outputs)


@pytest.mark.parametrize("name", ["stick-slip", "sudden-contact", "temperature-programmed-desorption"])
def test_a_repeated_run_has_the_same_bytes(name):
    """With events, with cells, with rates from outside; each other case is computed twice as a sweep of one."""
    first = {column.name: column.values for column in solved(name).columns}
    for column in load(name).run(error="balances").columns:
        assert column.values.tobytes() == first[column.name].tobytes(), column.name


def golden(name):
    return json.loads(golden_values.path(name).read_text(encoding="utf-8"))


@every_case
def test_a_case_gives_what_it_gave(name):
    """After a change that is meant: `python tests/golden_values.py`, and look at the difference."""
    kept = golden(name)
    assert list(golden_values.differences(name, kept, golden_values.sampled(name, kept["times"]))) == []


@every_case
def test_the_equations_of_a_case_keep_their_values(name):
    """Those that the golden file of its run holds: without the run, a changed sign shows at once.

    What is read from a table, as of curved surfaces, has the rounding of its largest number.
    """
    kept = golden(name)
    sizes = {f"output {variable}": values.get("size", 0) for variable, values in kept["variables"].items()}
    now = golden_values.equations(name)
    assert now == {
        part: pytest.approx(value, rel=golden_values.EQUATIONS, abs=1e-14 * sizes.get(part, 0) + 1e-40)
        for part, value in kept["equations"].items()
    }


def test_every_golden_file_is_that_of_a_case():
    assert {file.stem for file in golden_values.FOLDER.glob("*.json")} == set(names())


def test_a_difference_names_case_variable_time_and_both_values():
    kept = golden("stick-slip")
    kept["variables"]["E_total"]["values"][3] *= 1 + 1e-6
    value = kept["variables"]["E_total"]["values"][3]
    (told,) = golden_values.differences("stick-slip", kept, golden_values.sampled("stick-slip", kept["times"]))
    assert told.startswith("stick-slip: E_total at t = ")
    assert f"kept is {value!r}" in told


@pytest.mark.parametrize("name", every(3, names()))
def test_a_file_is_the_dataset_in_memory_and_tells_units_and_meanings(name, tmp_path):
    solution = solved(name)
    with xarray.open_dataset(solution.write(tmp_path / "case.nc")) as opened:
        xarray.testing.assert_identical(opened, solution.dataset)
        assert all(variable.attrs["long_name"] for variable in opened.variables.values())
        # Texts have no unit.
        assert all(bool(each.attrs.get("units")) == (each.dtype.kind not in "OU") for each in opened.variables.values())
        assert all(isinstance(value, str | float | int | np.number) for value in opened.attrs.values())


@pytest.mark.parametrize("name", every(3, [name for name in names() if name != "diamond-growth"]))
def test_a_case_is_the_same_as_a_sweep_of_one(name):
    """Status, events, balances, error and every other variable that a sweep has."""
    simulation, solution = load(name), at_even_times(name)
    values = solution.trajectory.values
    # A run by itself is made again where it is further off than its tolerance, and looked at more often. Of one with an
    # accuracy to be verified, the second run has accounts too, which may shorten its steps.
    settings = simulation.model.chosen(replace(simulation.case.run, picture=None, looks=0.0), values)
    if solution.trajectory.run != settings or solution.accuracy.asked:
        solution = simulation.run(run=settings)
    path = next(path for path in simulation.system.changeable if path in values)
    swept = simulation.sweep_plan(Plan([Axis(path, (values[path],))]), run=replace(simulation.case.run, picture=None))
    (axis,) = swept.axes
    one = {c.name: c.values[0] for c in swept.columns if c.dimensions[0] == axis != c.name}
    alone = solution.attributes | {c.name: c.values for c in solution.columns}
    alone |= {"steps": alone["count_steps"], "destroys_entropy": alone["entropy_violations"] != "none"}
    ends = at_end(solution.trajectory)
    for state in simulation.system.rows.keys() - simulation.system.interior:
        alone |= {f"{state}_{which}": extremes(solution.trajectory)[which][state] for which in EXTREMES}
        alone[f"{state}_last"] = ends[state]
    single = tuple(f"_{which}" for which in SINGLE_COLUMNS)
    left = {"entropy_destroyed", *(name for name in one.keys() - alone.keys() if name.endswith(single))}
    if simulation.case.reference and simulation.case.reference.options:
        left |= {"error"}  # an exact solution with values of its own is of the case alone
    told = {"status", "reason", "energy_error", "site_error", "error", *simulation.system.rows}
    assert told <= one.keys() | set(simulation.system.interior)
    for variable in one.keys() - left:
        expected = np.asarray(alone[variable])
        ours = np.asarray(one[variable])[tuple(slice(size) for size in expected.shape)]
        np.testing.assert_array_equal(ours, expected, err_msg=variable)
