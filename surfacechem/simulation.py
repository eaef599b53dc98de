"""A case ready to run: read, assembled and compiled once, run with any values of its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from surfacechem import case as cases
from surfacechem import choice, spatial
from surfacechem.achieved import accuracy, check_way
from surfacechem.case import Case
from surfacechem.document import from_plain
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.integrate import Model, Run, Trajectory
from surfacechem.overrides import parameter_path
from surfacechem.solution import Accuracy, Solution
from surfacechem.solvers import AUTO
from surfacechem.system import System
from surfacechem.units import parse

if TYPE_CHECKING:
    from surfacechem.sweep_dataset import SweepSolution
    from surfacechem.sweeps import Plan


def load(name: str | Path, overrides: Sequence[str] | Mapping[str, object] = ()) -> Simulation:
    """Read a case by file or by the name of a shipped one; ``overrides`` are "path=value" or {path: value}."""
    return Simulation(cases.load(name, overrides))


def run(name: str | Path, overrides: Sequence[str] | Mapping[str, object] = ()) -> Solution:
    """Read a case and run it."""
    return load(name, overrides).run()


def sweep(
    name: str | Path,
    over: Mapping[str, object] | None = None,
    until: Mapping[str, object] | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
) -> SweepSolution:
    """Read a case and run its sweep, or the one given."""
    return load(name, overrides).sweep(over, until)


class Simulation:
    """A case with its system and machine code, each made when first needed."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self._sweep_models: dict[str, Model] = {}
        self._finer: dict[int, Simulation] = {}
        self._tightened: dict[float | None, Simulation] = {}
        self._freed: dict[frozenset[str], Simulation] = {}

    def __repr__(self) -> str:
        """Title and states in a line."""
        return f"<Simulation {self.case.title!r}: {', '.join(state.name for state in self.system.states)}>"

    @cached_property
    def system(self) -> System:
        """The assembled equations."""
        return self.case.system()

    @cached_property
    def model(self) -> Model:
        """The compiled system."""
        return Model(self.system)

    def run(
        self, changes: Mapping[str, float | str] | None = None, run: Run | None = None, error: str = "auto"
    ) -> Solution:
        """Run with some parameters or initial values changed, by path; nothing is compiled again.

        ``error`` says where the error of the run is from: "auto", the exact solution of the case if there is one, else
        a second run at a tighter tolerance; "estimate", always a second run; "balances", no second run.
        """
        check_way(error)
        settings = run or self.case.run
        values = self._values(changes or {})
        if (freed := self._with_freed(values)) is not self:
            return freed.run(values, settings, error)
        values = {path: value for path, value in values.items() if path not in self.system.constants}
        chosen, trajectory, errors = self._as_accurate(settings)._resolved(settings, values)
        estimate: Accuracy | None = None
        if settings.solver == AUTO:
            trajectory, estimate = choice.verified(trajectory)
        case = chosen.case
        exact = (case.reference.name, case.reference.options) if case.reference else None
        found = (
            accuracy(trajectory, case.scene, exact, error, lambda: errors or chosen._cell_errors(trajectory), estimate)
            if len(trajectory.result.times)
            else None
        )
        return Solution(
            trajectory,
            title=case.title,
            source=case.source,
            case=case.text,
            mechanism=case.mechanism_text or "",
            accuracy=found,
            changes=values,
            case_run=case.run,
            error_from=error,
            notes=spatial.missed(case.scene, errors, found),
        )

    def _as_accurate(self, run: Run) -> Simulation:
        """The same with cells as accurate as the run is asked to be, where an accuracy chooses them."""
        scene = spatial.tightened(self.case.scene, run.accuracy)
        if scene is self.case.scene:
            return self
        if run.accuracy not in self._tightened:
            self._tightened[run.accuracy] = Simulation(replace(self.case, scene=scene))
        return self._tightened[run.accuracy]

    def _resolved(
        self, settings: Run, values: Mapping[str, float], before: float = math.inf
    ) -> tuple[Simulation, Trajectory, Mapping[str, float]]:
        """With the cells that its accuracy needs: the simulation, its run and, where it asks for an accuracy, the
        errors of the cells by variable.
        """
        trajectory = self._solved(settings, values)
        errors = self._cell_errors(trajectory) if spatial.wanted(self.case.scene) is not None else {}
        factor = spatial.finer(self.case.scene, errors)
        error = max(errors.values(), default=0.0)
        if factor > 1 and not error > spatial.HELPED * before:
            return self._with_more_cells(factor)._resolved(settings, values, error)
        return self, trajectory, errors

    def _solved(self, run: Run, values: Mapping[str, float]) -> Trajectory:
        try:
            return self.model.solve(run, values)
        except InputError as error:
            raise self.case.located(error) from None

    def _with_more_cells(self, factor: int) -> Simulation:
        if factor not in self._finer:
            finer = Simulation(replace(self.case, scene=spatial.multiplied(self.case.scene, factor)))
            self._finer[factor] = finer
        return self._finer[factor]

    @cached_property
    def _coarser(self) -> Simulation:
        """The same with half of the cells."""
        return Simulation(replace(self.case, scene=spatial.halved(self.case.scene)))

    def _cell_errors(self, trajectory: Trajectory) -> dict[str, float]:
        """Errors of the cells, by variable; nothing where no body has any."""
        if not spatial.divided(self.case.scene):
            return {}
        changes = {path: value for path, value in trajectory.values.items() if path in self._units}
        coarse = self._coarser._solved(trajectory.run, changes)
        return spatial.errors(trajectory, coarse)

    def sweep(
        self,
        over: Mapping[str, object] | None = None,
        until: Mapping[str, object] | None = None,
        changes: Mapping[str, float | str] | None = None,
        threads: int | None = None,
    ) -> SweepSolution:
        """Run over values of one or two parameters in one call of the compiled loop; nothing is compiled twice.

        ``over`` maps paths to lists of values or to ranges {from, to, points, spacing}, ``until`` a prescribed ramp to
        the value at which each run ends; what is not given is that of the section ``sweep`` of the case.
        """
        return self.sweep_plan(self._plan(over, until), changes, threads)

    def sweep_plan(
        self, plan: Plan, changes: Mapping[str, float | str] | None = None, threads: int | None = None
    ) -> SweepSolution:
        """Run a plan whose values are in SI."""
        from surfacechem import sweeping

        constants = self.system.constants
        values = self._values(changes or {})
        swept = {axis.path: axis.values for axis in plan.axes if axis.path in constants}
        others = {path: _besides(constants[path][1], xs) for path, xs in swept.items()}
        if (freed := self._with_freed({**values, **others})) is not self:
            return freed.sweep_plan(plan, values, threads)
        values = {path: value for path, value in values.items() if path not in constants}
        if spatial.wanted(self.case.scene) is not None:
            chosen = self._as_accurate(self.case.run)._resolved(self.case.run, values)[0]
            if chosen is not self:
                return chosen.sweep_plan(plan, values, threads)
        key = plan.until[0] if plan.until else ""
        try:
            if key not in self._sweep_models:
                self._sweep_models[key] = Model(sweeping.prepared(self.system, plan)) if key else self.model
            return sweeping.sweep(self.case, self._sweep_models[key], plan, values, threads)
        except InputError as error:
            raise self.case.located(error) from None

    def _plan(self, over: Mapping[str, object] | None, until: Mapping[str, object] | None) -> Plan:
        from surfacechem.case.sweep import read_sweep, read_until

        section = self.case.sweep
        given = {"over": {path: _listed(values) for path, values in (over or {}).items()}, "until": dict(until or {})}
        if over is not None:
            section = read_sweep(from_plain({"over": given["over"]}, Place(path="sweep")), section)
        if until is not None and section is not None:
            section = replace(section, until=read_until(from_plain(given["until"], Place(path="sweep.until"))))
        if section is None:
            raise InputError("a sweep needs `sweep: {over: ...}` in the case, or parameters to sweep over.")
        return section.plan(self._units)

    @cached_property
    def _units(self) -> dict[str, str]:
        """Units of all that a run may change, by path, parameters at their defaults among them."""
        system = self.system
        return {**{path: spec.unit for path, (spec, _) in system.constants.items()}, **system.changeable}

    def _with_freed(self, values: Mapping[str, float]) -> Simulation:
        """The simulation in whose equations stand symbols for the defaults that values depart from: the case with these
        values, assembled anew; itself where no default is departed from.
        """
        constants = self.system.constants
        departing = {path: x for path, x in values.items() if path in constants and x != constants[path][1]}
        if not departing:
            return self
        paths = frozenset(departing)
        if paths not in self._freed:
            case = self.case
            freed = cases.load_text(case.text, case.name, mechanism_text=case.mechanism_text, overrides=departing)
            self._freed[paths] = Simulation(replace(freed, run=case.run, file=case.file))
        return self._freed[paths]

    def _values(self, changes: Mapping[str, float | str]) -> dict[str, float]:
        units = self._units
        changes = {parameter_path(path, units): value for path, value in changes.items()}
        unknown = next((path for path in changes if path not in units), None)
        if unknown is not None:
            raise InputError(f"no parameter '{unknown}' to change.{suggestion(unknown, self.system.changeable)}")
        return {path: parse(value, units[path], name=path) for path, value in changes.items()}


def _besides(default: float, values: Sequence[float]) -> float:
    """The first value that is not the default, else the next number."""
    return next((value for value in values if value != default), math.nextafter(default, math.inf))


def _listed(values: object) -> object:
    """Arrays as lists."""
    return values.tolist() if isinstance(values, np.ndarray) else values
