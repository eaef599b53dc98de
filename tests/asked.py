"""Every exact solution run at an accuracy that is asked for, and the error that is achieved."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from zoo import MEMBERS

import surfacechem
from surfacechem.results import error_estimates
from surfacechem.results.accuracy import first_tolerance, largest_errors
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.studies.regimes import Exact, regimes
from surfacechem.studies.stability import answer_floor, condition, read
from surfacechem.tolerances import EPS

ACCURACIES = tuple(10.0**-k for k in range(3, 12))


@dataclass(frozen=True)
class Achieved:
    """The largest relative error of a run, what the last bits of times and data change, and what the run cost."""

    error: float
    rounding: float
    steps: int
    rtol: float
    source: str

    def ratio(self, accuracy: float) -> float:
        """Error over the accuracy asked for, or over what rounding leaves, if that is more."""
        return self.error / max(accuracy, self.rounding)


def achieved(trajectory: Trajectory, error: float, source: str, rounding: float = 0.0) -> Achieved:
    result = trajectory.result
    size = np.maximum(np.abs(result.outputs), error_estimates.state_floors(trajectory))
    of_times = float(np.max(EPS * np.abs(trajectory.rates) * result.times[:, None] / size))
    return Achieved(error, max(of_times, rounding), result.counters.steps, trajectory.run.rtol, source)


LEAST = {"case sudden-contact": 1e-5, "film 1e-12": 1e-10, "film 1e-14": 1.0, "runaway 200": 1.0}
"""The least accuracy that is quick where bodies are divided into cells, and that rounding of times and data leaves."""


@cache
def simulation(name: str) -> Simulation:
    return surfacechem.load(name)


def of_case(name: str, accuracy: float) -> Achieved:
    run = replace(simulation(name).case.run, solver="auto", rtol=first_tolerance(accuracy), accuracy=accuracy)
    solution = simulation(name).run(run=run)
    assert solution.accuracy.source.startswith("exact solution")
    return achieved(solution.trajectory, solution.accuracy.error, solution.accuracy.source)


@cache
def model(name: str, value: float) -> tuple[Model, float]:
    """A regime at a value, and what the last bits of its data change."""
    made = Model(read(trial := regimes()[name].problem(value)).system())
    return made, EPS * condition(trial, [state.name for state in made.system.states])


def of_regime(name: str, value: float, accuracy: float) -> Achieved:
    trial, (compiled, rounding) = regimes()[name].problem(value), model(name, value)
    run = Run(times=(0.0, *trial.times), solver="auto", rtol=first_tolerance(accuracy), accuracy=accuracy)
    trajectory, estimate = error_estimates.verified(compiled.solve(run))
    assert trajectory.status == "finished", trajectory.reason
    known = trial.expected.values(trajectory.result.times)
    exact = {each: np.asarray(known[each]) for each in known if each in compiled.system.state_columns}
    floors = {each: answer_floor(values) for each, values in exact.items()}
    errors = largest_errors(error_estimates.computed(trajectory), exact, floors)
    return achieved(trajectory, max(errors.values()), estimate.source, rounding)


EXACT: dict[str, Callable[[float], Achieved]] = {
    **{name: partial(of_case, member.name) for name, member in MEMBERS.items() if "exact" in member.tags},
    **{
        f"{name} {value:g}": partial(of_regime, name, value)
        for name, regime in regimes().items()
        for value in regime.values
        if isinstance(regime.problem(value).expected, Exact)
    },
}
"""Every exact solution by name: what an accuracy that is asked for gives."""


def exact(accuracy: float) -> list[str]:
    """Names of those that are asked for an accuracy."""
    return [name for name in EXACT if accuracy >= LEAST.get(name, 0.0)]
