"""Every exact solution run at an accuracy that is asked for, and the error that is achieved."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import pytest
import tables
import tables_bonds
import tables_mechanics as mechanics
from tables import errors
from tables_mechanics import columns, expected, parameters, rows

import surfacechem
from surfacechem.documents import shipped
from surfacechem.laws.free_energy import Constant, Quadratic
from surfacechem.model.assemble import assemble
from surfacechem.results import error_estimates
from surfacechem.results.accuracy import first_tolerance
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import EPS

ACCURACIES = tuple(10.0**-k for k in range(3, 12))


@dataclass(frozen=True)
class Achieved:
    """The largest relative error of a run, what a last bit of the time changes, and what the run cost."""

    error: float
    rounding: float
    steps: int
    rtol: float
    source: str

    def ratio(self, accuracy: float) -> float:
        """Error over the accuracy asked for, or over what rounding of the time leaves, if that is more."""
        return self.error / max(accuracy, self.rounding)


def settings(times, accuracy: float) -> Run:
    times = [float(t) for t in times]
    times = times if times[0] == 0 else [0.0, *times]
    return Run(times=times, solver="auto", rtol=first_tolerance(accuracy), accuracy=accuracy)


def achieved(trajectory: Trajectory, error: float, source: str) -> Achieved:
    steps = trajectory.result.counters.steps
    result = trajectory.result
    size = np.maximum(np.abs(result.outputs), error_estimates.state_floors(trajectory))
    rounding = float(np.max(EPS * np.abs(trajectory.rates) * result.times[:, None] / size))
    return Achieved(error, rounding, steps, trajectory.run.rtol, source)


# -- tables of one trajectory ---------------------------------------------------------------------------------------

TABLES = tables.makers() | tables_bonds.makers()


@cache
def table(name: str) -> tuple[tables.Table, Model]:
    made = TABLES[name]()
    return made, Model(assemble(made.scene))


def of_table(name: str, accuracy: float) -> Achieved:
    exact, model = table(name)
    trajectory, estimate = error_estimates.verified(model.solve(settings(exact.times, accuracy)))
    assert trajectory.status == "finished", trajectory.reason
    return achieved(trajectory, max(errors(exact, trajectory).values()), estimate.source)


# -- shipped cases --------------------------------------------------------------------------------------------------


CELLS = {"case sudden-contact": 1e-5}
"""Cases whose bodies are divided into cells, and the least accuracy for which that is quick."""


@cache
def simulation(name: str) -> Simulation:
    return surfacechem.load(name)


def of_case(name: str, accuracy: float) -> Achieved:
    run = replace(simulation(name).case.run, solver="auto", rtol=first_tolerance(accuracy), accuracy=accuracy)
    solution = simulation(name).run(run=run)
    assert solution.accuracy.source.startswith("exact solution")
    return achieved(solution.trajectory, solution.accuracy.error, solution.accuracy.source)


# -- tables of mechanics: events and motion -------------------------------------------------------------------------


def relative(found, exact) -> float:
    """Each to its own size."""
    found, exact = np.asarray(found, float), np.asarray(exact, float)
    return float(np.max(np.abs(found - exact) / np.abs(exact)))


def of_largest(found, exact) -> float:
    found, exact = np.asarray(found, float), np.asarray(exact, float)
    return float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))


def coulomb_stop() -> tuple[mechanics.Solved, float]:
    solved, exact = mechanics.coulomb_stop(), columns("g_coulomb_stop")
    parts = [of_largest(solved[name], exact[column]) for name, column in {"v": "v", "u_t": "x", "T": "T"}.items()]
    stop = expected("g_coulomb_stop")["t_stop"]
    assert np.all(solved["v"][exact["t"] > stop * (1 + 1e-3)] == 0.0)
    return solved, max(*parts, relative(solved.jumps[0].t, stop))


def stick_slip(row: dict) -> tuple[mechanics.Solved, float]:
    p = parameters("g_stickslip_period_vs_V")
    onset = p["mu_s"] * p["p"] / (p["k"] * row["V"])
    times = (0.0, onset + 3.5 * row["period"])
    solved = mechanics.solve(mechanics.slider(), times, {"loading.w_t.rate": row["V"]})
    stick, slip = solved.jumps[2].since, solved.jumps[1].since
    heat = solved.account("heat_coulomb", 3) - solved.account("heat_coulomb", 1)
    found = [solved.jumps[0].t, slip, stick + slip, heat]
    return solved, relative(found, [onset, row["slip_time"], row["period"], row["heat_per_cycle"]])


def rebonding() -> tuple[mechanics.Solved, float]:
    solved = mechanics.solve(mechanics.rebonding_slider(), (0.0, 170.0))
    slips, stops = solved.of("slip"), solved.of("stop")
    worst = 0.0
    for n, row in enumerate(rows("g_stickslip_rebonding_transient")):
        strength = 1e5 * (0.4 + 0.3 * solved.state(slips[n], "phi", "before"))
        distance = solved.state(stops[n], "u_t") - solved.state(slips[n], "u_t")
        heat = solved.account("heat_bonded_coulomb", 2 * n + 1) - solved.account("heat_bonded_coulomb", 2 * n)
        found = [slips[n].since, strength, stops[n].since, distance, heat]
        exact = [row[name] for name in ("stick_time", "ts_star", "slip_time", "slip_distance", "heat")]
        worst = max(worst, relative(found, exact))
    return solved, worst


def dynamic() -> tuple[mechanics.Solved, float]:
    solved, exact = mechanics.dynamic(), columns("h_pulloff_dynamic")
    pairs = {"g_n": "g", "v_n": "gdot", "t_n": "t_n", "heat_bulk_damper_n": "heat", "T": "T"}
    return solved, max(of_largest(solved[name][1:], exact[column]) for name, column in pairs.items())


def heating(energy, column: str) -> tuple[mechanics.Solved, float]:
    solved = mechanics.heating(energy)
    found = [solved.state(jump, "T") for jump in solved.of("snap")]
    return solved, relative([*found[:2], *found[3::2]], columns("h_pulloff_heating")[column])


def pull_off(row: dict) -> tuple[mechanics.Solved, float]:
    solved, w = mechanics.pull_off(row)
    off, on = solved.of("snap")
    found = [w[0], off.released, solved.state(off, "g_n"), w[1], on.released, solved.state(on, "g_n")]
    exact = [row[name] for name in ("w_off", "release_off", "g_after", "w_on", "release_on", "g_after_on")]
    assert off.heat_out == pytest.approx(off.released)
    return solved, relative(found, exact)


def isentropic() -> tuple[mechanics.Solved, float]:
    solved, exact = mechanics.isentropic(), columns("h_isentropic_cohesive_cooling")
    pairs = {"T": "T", "t_n": "t_n", "W_g_n": "work"}
    return solved, max(of_largest(solved[name], exact[column]) for name, column in pairs.items())


def penalty(row: dict) -> tuple[mechanics.Solved, float]:
    solved = mechanics.solve(mechanics.penalty(), (0.0, 1.0), {"interface.potential.normal-stiffness.E_n": row["E_n"]})
    return solved, relative([solved["g_n"][-1], solved["t_n"][-1]], [row["g"], row["t_n"]])


def debonded(row: dict) -> tuple[mechanics.Solved, float]:
    solved = mechanics.debonded(row)
    (jump,) = solved.jumps
    found = [solved.state(jump, "T"), jump.released, jump.entropy]
    return solved, relative(found, [row["T_f"], row["Ediss"], row["dS"]])


MOTION: dict[str, Callable[[], tuple[mechanics.Solved, float]]] = {
    "g_coulomb_stop": coulomb_stop,
    "g_stickslip_rebonding_transient": rebonding,
    "h_pulloff_dynamic": dynamic,
    "h_pulloff_heating-T_quadratic": partial(heating, Quadratic, "T_quadratic"),
    "h_pulloff_heating-T_constC": partial(heating, Constant, "T_constC"),
    "h_isentropic-loaded": isentropic,
    **{f"g_stickslip_V-{row['V']}": partial(stick_slip, row) for row in rows("g_stickslip_period_vs_V")},
    **{f"h_pulloff_k-{row['k_g0_over_tmax']}": partial(pull_off, row) for row in rows("h_pulloff_vs_stiffness")},
    **{f"x09_penalty-{row['E_n']}": partial(penalty, row) for row in rows("x09_penalty_limit")},
    **{f"S63_debonding-{k}": partial(debonded, row) for k, row in enumerate(rows("S63_debonding"))},
}


def of_motion(name: str, accuracy: float) -> Achieved:
    sources: list[str] = []

    def solve(model, times, changes=None):
        trajectory, estimate = error_estimates.verified(model.solve(settings(times, accuracy), changes))
        sources.append(estimate.source)
        return mechanics.Solved(trajectory)

    usual, mechanics.solve = mechanics.solve, solve
    try:
        solved, error = MOTION[name]()
    finally:
        mechanics.solve = usual
    return achieved(solved.trajectory, error, sources[-1])


EXACT: dict[str, Callable[[float], Achieved]] = {
    **{name: partial(of_table, name) for name in TABLES},
    **{
        f"case {path.stem}": partial(of_case, path.stem)
        for path in sorted(shipped.cases().glob("*.yaml"))
        if "\nreference:" in path.read_text()
    },
    **{name: partial(of_motion, name) for name in MOTION},
}
"""Every exact solution by name: what an accuracy that is asked for gives."""


def exact(accuracy: float) -> list[str]:
    """Names of those that are asked for an accuracy."""
    return [name for name in EXACT if accuracy >= CELLS.get(name, 0.0)]
