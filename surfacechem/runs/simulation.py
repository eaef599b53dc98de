"""A case ready to run: read, assembled and compiled once, run with any values of its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from surfacechem import format as cases
from surfacechem.contracts.units import parse
from surfacechem.documents.document import OVERRIDE, assignments, from_plain, overridden, parameter_path
from surfacechem.documents.document import parse as parse_document
from surfacechem.errors import PATHS, InputError, Place, concise, expect, suggestion
from surfacechem.format import Case, Overrides, Source
from surfacechem.model.assemble import perturbed
from surfacechem.model.system import System
from surfacechem.results import spatial
from surfacechem.results.accuracy import Accuracy, CellErrors
from surfacechem.results.error_estimates import accuracy, check_source, inexact, law_errors, verified
from surfacechem.results.event_table import event_times
from surfacechem.results.solution import Judgement, Solution
from surfacechem.scene import Scene
from surfacechem.solve import AUTO
from surfacechem.solve.run import Model, Run, Trajectory, values_of

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

    from surfacechem.format.plans import Plan
    from surfacechem.runs.points import Evaluator, PointResults, Points
    from surfacechem.runs.streaming import Stream
    from surfacechem.runs.sweeps import SweepSolution


@concise
def load(source: Source, overrides: Overrides = ()) -> Simulation:
    """Read and check a case; it is assembled and compiled when first needed.

    Parameters
    ----------
    source
        The path of a case file or the name of a shipped case; a text of several lines, a mapping of the keys of a case,
        or an open file. Files that a text or a mapping names are searched for in the working directory.
    overrides
        Changes of the case before it is read: a text "path=value", a list of them, or a mapping from path to value, as
        numbers in SI or as texts with units.

    Returns
    -------
    Simulation
        Object that runs, sweeps and evaluates the case.

    Raises
    ------
    InputError
        One line with file, line, what is wrong and what is allowed.

    Examples
    --------
    >>> load("exothermic", ["run.until=1 s"])
    <Simulation 'Exothermic bonding, kappa = 0.5': phi, T>
    """
    return Simulation(cases.load(source, overrides))


@concise
def run(source: Source, overrides: Overrides = ()) -> Solution:
    """Read a case and run it.

    Parameters
    ----------
    source, overrides
        As for :func:`load`.

    Returns
    -------
    Solution
        How it ended, its dataset, error and balances.

    Raises
    ------
    InputError
        If the case cannot be run; how a run ends is its status, never an exception.
    """
    return load(source, overrides).run()


@concise
def sweep(
    source: Source,
    over: Mapping[str, object] | None = None,
    until: Mapping[str, object] | str | None = None,
    overrides: Overrides = (),
) -> SweepSolution:
    """Read a case and run its sweep, or the given one.

    Parameters
    ----------
    source, overrides
        As for :func:`load`.
    over, until
        As for :meth:`Simulation.sweep`.

    Returns
    -------
    SweepSolution
        All runs and their dataset.

    Raises
    ------
    InputError
        If the case has no sweep and none is given, or a path or value of it is wrong.
    """
    return load(source, overrides).sweep(over, until)


class Simulation:
    """A case with its system and machine code, each made when first needed."""

    def __init__(self, case: Case, grids: dict[tuple[object, ...], Simulation] | None = None) -> None:
        self.case = case
        self._sweep_models: dict[str, Model] = {}
        self._freed: dict[frozenset[str], Simulation] = {}
        self._grids = {} if grids is None else grids
        """Simulations of the same case, by the cells of their bodies."""
        self._grids.setdefault(spatial.grid(case.scene), self)
        self.integrals_seconds = 0.0
        """Time that integrals over surfaces took [s]."""

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: title, unknowns, and the summary of ``check``."""
        from html import escape

        from surfacechem.runs.check import warnings
        from surfacechem.runs.summaries import check_summary

        case, system = self.case, self.system
        told = check_summary(case.title, system, case.scene, case.own_run, [], warnings(system))
        return f"<pre>{escape(str(told))}</pre>"

    def __repr__(self) -> str:
        """Return title and states in a line."""
        states = ", ".join(state.name for state in self.system.states) or "nothing to solve"
        return f"<Simulation {self.case.title!r}: {states}>"

    @classmethod
    def of(cls, scene: Scene, run: Run | None = None, title: str = "a scene in Python") -> Simulation:
        """Make the simulation of a scene built in Python, which does all that the simulation of a case does.

        Parameters
        ----------
        scene
            Two bodies, the interface, heat paths, loading and initial values, in SI.
        run
            Output times and tolerances; needed to run the scene, not to evaluate it.
        title
            Name in figures and datasets. These hold no case, so that they cannot be run again from themselves.

        Returns
        -------
        Simulation
            Assembled and compiled when first needed; an InputError of the scene is raised then.
        """
        expect(scene, Scene, "a simulation is one of a Scene")
        expect(run, (Run, type(None)), "run is a Run")
        return cls(Case("scene", title, "", "", scene, run, None, None, "", None, {"": Place(title)}, ""))

    @cached_property
    def system(self) -> System:
        """The assembled equations."""
        if self.case.scene.surface is None:
            return self.case.system()
        from surfacechem.surfaces.potential import INTEGRATION_TIME

        before = INTEGRATION_TIME.seconds
        system = self.case.system()
        self.integrals_seconds = INTEGRATION_TIME.seconds - before
        return system

    @cached_property
    def model(self) -> Model:
        """The compiled system."""
        if self.system.is_static:
            self.case.refuse_nothing()
        with self.case.locating():
            return Model(self.system)

    @cached_property
    def evaluator(self) -> Evaluator:
        """The scene compiled for evaluation at given states."""
        from surfacechem.runs.points import Evaluator

        with self.case.locating():
            return Evaluator(self.case.scene)

    @concise
    def evaluate(self, points: Points | None = None) -> xarray.Dataset:
        """Quantities of the scene at given states, and their exact derivatives, without a run.

        Parameters
        ----------
        points
            Values by name, each a number, a list of them, or a text with a unit: prescribed variables, states, or
            parameters by path. In SI; the default is the value of the case at its start. States without capacity or
            inertia are solved for unless they are given.

        Returns
        -------
        xarray.Dataset
            Along ``point``: given values, tractions, fluxes, rates, energies, entropies, heat capacities, and the
            derivative of each by the given ones, ``t_n_by_g_n`` for instance, with unit and long name. ``admissible``
            is zero where a law is not valid, and ``reason`` says why.

        Raises
        ------
        InputError
            If the scene has no quantity of a name, or a value is not finite or outside its range.
        """
        return self.evaluated(points).dataset

    def evaluated(self, points: Points | None = None) -> PointResults:
        """Evaluate quantities of the scene at given states, as results that can be written."""
        from surfacechem.runs.points import evaluation

        return evaluation(self.evaluator, {} if points is None else points, **self._origin({}))

    @concise
    def run(self, changes: Overrides | None = None, run: Run | None = None, error: str = "auto") -> Solution:
        """Run with some parameters or initial values changed; nothing is compiled again.

        Parameters
        ----------
        changes
            Values by path, numbers in SI or texts with a unit; or texts "path=value".
        run
            Other output times, solver and tolerances than the case's.
        error
            Source of the error of the run, once it is asked for: "auto", the exact solution of the case if there is
            one, else a second run at a tighter tolerance; "estimate", always a second run; "balances", no second run,
            which is refused if a requested accuracy has to be verified.

        Returns
        -------
        Solution
            How it ended, its dataset, error and balances.

        Raises
        ------
        InputError
            Where there is no parameter of a path, or a value is outside its range.
        """
        settings = self._settings(run)
        check_source(error, settings)  # before anything is computed
        if self.case.scene.surface is not None:
            self.case.refuse_nothing()
        freed, values = self._ready(changes or {})
        if freed is not self:
            return freed.run(values, settings, error)
        chosen, (trajectory,), errors = self._resolved(settings, values)
        estimate: Accuracy | None = None
        if settings.solver == AUTO:
            trajectory, estimate = verified(trajectory)
        case = chosen.case
        return Solution(
            trajectory,
            judge=partial(chosen._judged, trajectory, self._unused(values), error, estimate, errors),
            case_run=case.run,
            asked=settings,
            surface=case.scene.surface,
            error_from=error,
            **chosen._origin(values),
        )

    def _settings(self, run: Run | None) -> Run:
        """Return the settings of a run from Python, by default those of the case."""
        if run is None:
            return self.case.run
        expect(run, Run, "run is a Run, such as `dataclasses.replace(simulation.case.run, rtol=1e-8)`")
        return run

    def _judged(
        self, trajectory: Trajectory, unused: str, option: str, estimate: Accuracy | None, errors: list[CellErrors]
    ) -> Judgement:
        """Return the error of a run by one of the ways, from an existing second run or from a new one; ``unused`` is
        the reason why the exact solution does not apply, ``errors`` are those of the cells if they are known.
        """
        case = self.case
        exact = (case.reference.name, case.reference.options) if case.reference and not unused else None

        def added() -> CellErrors:
            if not errors:
                errors.append(self._cell_errors(trajectory))
            return errors[0].combined(self._law_errors(trajectory))

        found = accuracy(trajectory, case.scene, exact, option, added, estimate)
        if unused and option == "auto":
            found = replace(found, source=f"{found.source}; {unused}")
        notes = spatial.unmet_accuracy(case.scene, (errors or [CellErrors()])[0], found)
        return Judgement(found, notes)

    def _origin(self, changes: Mapping[str, float]) -> dict[str, Any]:
        """Return the origin of results: texts of the case, changes, and time spent before the run."""
        case = self.case
        texts = {"title": case.title, "source": case.source, "case": case.text, "mechanism": case.mechanism_text or ""}
        spent = max(simulation.integrals_seconds for simulation in self._grids.values())
        return {**texts, "changes": changes, "before_seconds": spent}

    def _unused(self, values: Mapping[str, float]) -> str:
        """Return the reason why the exact solution of the case does not apply to these values; empty if it does."""
        if self.case.reference is None or not values:
            return self.case.unused
        own = self.model.values()
        departs = any(own[path] != value for path, value in values.items())
        return self.case.reference.fixed if departs else self.case.unused

    def _with(self, scene: Scene) -> Simulation:
        """Return the simulation with the cells of another scene, assembled and compiled once per choice of cells."""
        key = spatial.grid(scene)
        # Shared by all simulations of the case, so that a search for an accuracy compiles each grid once.
        if key not in self._grids:
            self._grids[key] = Simulation(replace(self.case, scene=scene), self._grids)
        return self._grids[key]

    def _resolved(
        self, settings: Run, values: Mapping[str, float], plan: Plan | None = None, threads: int | None = None
    ) -> tuple[Simulation, Sequence[Trajectory], list[CellErrors]]:
        """Return the simulation with the cells that the accuracy needs, its run or its runs over a plan, and the errors
        of the cells of each run if an accuracy determines all cells.
        """
        if spatial.asked_cell_accuracy(self.case.scene) is None:
            return self, self._solved(settings, values, plan, threads), []
        chosen = self._with(spatial.tightened(self.case.scene, settings.accuracy))
        scene, system = chosen.case.scene, chosen.system
        from surfacechem.runs import sweeps

        points = [values_of(system, {**values, **point}) for point in (plan.points if plan else [{}])]
        check = spatial.with_check_times(system, settings)
        runs = sweeps.settings(system, plan, check, points) if plan else [check]
        # All runs of a sweep share the cells of the run that needs the most.
        times = [spatial.shortest(system, *pair) for pair in zip(runs, points, strict=True)]
        cells: Scene | None = spatial.with_resolved_layers(scene, spatial.layers(system, points, times))
        for _ in range(1 + spatial.MOST_GRIDS):
            if cells is None:
                break
            chosen = self._with(cells)
            done = chosen._solved(check, values, plan, threads)
            errors = [chosen._halved(run, given=False) for run in done]
            cells = spatial.refined(cells, spatial.worst_errors(errors), chosen._layers(*done))
        if settings.times != check.times or settings.picture is not None:
            done = chosen._solved(settings, values, plan, threads)
        # Errors at given output times are estimated at these times.
        known = not spatial.with_given_cells(scene) and (settings.picture is not None or settings.times == check.times)
        return chosen, done, errors if known else []

    def _solved(
        self, settings: Run, values: Mapping[str, float], plan: Plan | None = None, threads: int | None = None
    ) -> Sequence[Trajectory]:
        """Solve the run with these values, or the runs over a plan: a run is a batch of one."""
        with self.case.locating(plan):
            if plan is None:
                if settings.steady:
                    from surfacechem.runs.at_rest import to_steady_state

                    settings = to_steady_state(self.model, settings, self.model.values(values))
                return [self.model.solve(settings, values)]
            from surfacechem.runs import sweeps

            # Statistics of rupture are compiled with the equations.
            key = plan.until[0] if plan.until else ""
            if key not in self._sweep_models:
                self._sweep_models[key] = Model(sweeps.prepared(self.system, plan)) if key else self.model
            return sweeps.solve(self._sweep_models[key], plan, settings, values, threads)

    def _layers(self, *runs: Trajectory) -> dict[str, float]:
        """Return by body the thinnest layer that heat has reached when outputs or events of runs first show it."""
        events = [np.concatenate([*event_times(run).values(), []]) for run in runs]
        pairs = zip(runs, events, strict=True)
        times = [spatial.shortest(self.system, run.run, run.values, at) for run, at in pairs]
        return spatial.layers(self.system, [run.values for run in runs], times)

    def _cell_errors(self, trajectory: Trajectory) -> CellErrors:
        """Return the errors of the cells by variable; none if no body is divided."""
        scene = self.case.scene
        if not spatial.is_divided(scene):
            return CellErrors()
        parts = self._layers(trajectory)
        if not spatial.with_given_cells(scene):
            return self._halved(trajectory)
        if spatial.resolves(scene, parts) and (found := self._halved(trajectory)).converged:
            return found
        # Grids coarser than the layer agree that almost nothing has happened; only one resolving it shows the error.
        other = self._with(spatial.with_resolved_layers(scene, parts, given=True))
        held_against = other._as_before(trajectory)
        own = other._halved(held_against)
        found = CellErrors(spatial.differences(held_against, trajectory), source="and one with cells that suit")
        return own.added_to(found)

    def _law_errors(self, trajectory: Trajectory) -> CellErrors:
        """Return the errors of a run due to errors of numbers that laws compute themselves; none if no law has any."""
        if not inexact(self.case.scene):
            return CellErrors()
        return law_errors(trajectory, self._perturbed._as_before(trajectory), self.case.scene)

    @cached_property
    def _perturbed(self) -> Simulation:
        """Simulation whose laws are perturbed by the errors of the numbers that they compute themselves."""
        return Simulation(replace(self.case, scene=perturbed(self.case.scene)))

    def _halved(self, trajectory: Trajectory, given: bool = True) -> CellErrors:
        """Estimate the errors of the cells from runs with a half and a quarter of them; without ``given`` only of cells
        that an accuracy determines.
        """
        coarser = [self._with(spatial.coarsened(self.case.scene, divisor, given)) for divisor in (2, 4)]
        runs = [trajectory, *(simulation._as_before(trajectory) for simulation in coarser)]
        near, far = (spatial.differences(*pair) for pair in pairwise(runs))
        return spatial.cell_errors(near, far, trajectory.run.rtol)

    def _as_before(self, trajectory: Trajectory) -> Trajectory:
        """Repeat a run of another grid with these cells, with the same values except those of the cells."""
        values = {path: value for path, value in trajectory.values.items() if path in self.units}
        return self._solved(trajectory.run, values)[0]

    @concise
    def sweep(
        self,
        over: Mapping[str, object] | None = None,
        until: Mapping[str, object] | str | None = None,
        changes: Overrides | None = None,
        threads: int | None = None,
        sample: Mapping[str, object] | None = None,
        combine: str | None = None,
    ) -> SweepSolution:
        """Run over values of parameters in one call of the compiled loop; nothing is compiled twice.

        Arguments that are not given are those of the section ``sweep`` of the case. Its ``keep`` is ignored: all of
        every run is kept; :meth:`stream` keeps what the section says.

        Parameters
        ----------
        over
            Lists of values, or ranges {from, to, points, spacing}, by path: numbers in SI or texts with a unit.
        until
            A prescribed ramp, and the value of it at which each run ends: ``{"f": "200 pN"}`` or ``"f=200 pN"``.
        changes
            Values that differ from the case, by path, in SI or with a unit, the same for all runs.
        threads
            Number of runs solved at a time; by default the number of processors.
        sample
            {of: distributions by path, runs, method, seed}.
        combine
            "grid", every value with every other, or "zip", the first values of all, then the second ones.

        Returns
        -------
        SweepSolution
            All runs and their dataset, along a dimension for each parameter.

        Raises
        ------
        InputError
            Where there is no parameter of a path, or a value is outside its range.
        """
        return self.sweep_plan(self.plan(over, until, sample, combine), changes, threads)

    def sweep_plan(
        self, plan: Plan, changes: Overrides | None = None, threads: int | None = None, run: Run | None = None
    ) -> SweepSolution:
        """Run a plan with values in SI, with all runs in memory; ``run`` replaces the settings of the case."""
        from surfacechem.format.sections import MOST_RUNS
        from surfacechem.runs import sweeps

        if plan.size > MOST_RUNS:
            message = (
                f"a sweep of {plan.size} runs is too large; {MOST_RUNS} at most. A store, -o NAME.zarr, takes more."
            )
            raise InputError(message, path="sweep")
        freed, values = self._ready(changes or {}, plan)
        if freed is not self:
            return freed.sweep_plan(plan, values, threads, run)
        settings = self._settings(run)
        chosen, done, errors = self._resolved(settings, values, plan, threads)
        model = done[0].model
        taken = model.chosen(settings, done[0].values)

        @cache
        def added() -> list[CellErrors]:
            of_cells = errors or [chosen._cell_errors(run) for run in done]
            return [found.combined(chosen._law_errors(run)) for found, run in zip(of_cells, done, strict=True)]

        unchecked = self.case.sweep is not None and self.case.sweep.checked == 0
        judge = None if unchecked else partial(sweeps.accuracy, chosen.case, threads=threads, cells=added)
        return sweeps.SweepSolution(model, plan, taken, done, judge, **chosen._origin(values))

    @concise
    def stream(
        self,
        plan: Plan,
        path: str | Path,
        changes: Overrides | None = None,
        *,
        resume: bool = False,
        part: tuple[int, int] = (1, 1),
    ) -> Stream:
        """Prepare a sweep of any size into a store; ``run`` of the result computes the missing runs.

        Parameters
        ----------
        plan
            The plan of the sweep, from :meth:`plan`.
        path
            The store, a folder whose name ends with .zarr.
        changes
            Values that differ from the case, by path, in SI or with a unit, the same for all runs.
        resume
            True to continue an unfinished store of the same plan.
        part
            Number of the part to compute, and number of parts.

        Returns
        -------
        Stream
            ``run()`` computes it and returns the store, whose ``dataset`` is the xarray Dataset.

        Raises
        ------
        InputError
            If the store exists already, belongs to another plan, or cannot hold what is asked for.
        """
        from surfacechem.format.plans import Plan
        from surfacechem.runs import streaming

        expect(plan, Plan, "a store needs a plan, as `plan` of the simulation returns it")
        freed, values = self._ready(changes or {}, plan)
        if freed is not self:
            return freed.stream(plan, path, values, resume=resume, part=part)
        if spatial.asked_cell_accuracy(self.case.scene) is not None:
            message = "cells that follow from an accuracy need all runs at once; give a number of cells for a store."
            raise InputError(message, path="bodies")
        if plan.until and not plan.load:
            raise InputError("a store keeps no lifetimes. Write the sweep to a file, -o NAME.nc.", path="sweep.until")
        with self.case.locating(plan):
            return streaming.stream(self, plan, path, changes=values, resume=resume, part=part)

    @concise
    def plan(
        self,
        over: Mapping[str, object] | None = None,
        until: Mapping[str, object] | str | None = None,
        sample: Mapping[str, object] | None = None,
        combine: str | None = None,
    ) -> Plan:
        """Return the plan of a sweep in SI: a function from the number of a run to its values.

        Parameters
        ----------
        over, until, sample, combine
            As for :meth:`sweep`.

        Returns
        -------
        Plan
            Its size, axes and values, for :meth:`stream`.

        Raises
        ------
        InputError
            Where there is no parameter of a path, or nothing to sweep.
        """
        from surfacechem.format.plans import plan_of, read_sweep, read_until, split_arrays
        from surfacechem.laws.loading import Table

        section = self.case.sweep
        lists, arrays = split_arrays(over or {})
        given = {"over": None if over is None else lists, "combine": combine, "sample": sample}
        if said := {name: value for name, value in given.items() if value is not None}:
            section = read_sweep(from_plain(said, Place(OVERRIDE, path="sweep")), section)
        if section is None:
            message = "a sweep needs `sweep: {over: ...}` in the case, or parameters to sweep over."
            raise InputError(message, path="sweep")
        place = Place(OVERRIDE, path="sweep.until")
        ends = read_until(from_plain(assignments(until), place)) if until is not None else None
        tables = [f"loading.{name}" for name, load in self.case.scene.loading.items() if isinstance(load, Table)]
        return plan_of(section, self.units, ends, arrays, tables)

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of all values that a run may change, by path, including parameters at their defaults."""
        system = self.system
        return {**{path: spec.unit for path, (spec, _) in system.constants.items()}, **system.changeable}

    def _ready(self, changes: Overrides, plan: Plan | None = None) -> tuple[Simulation, dict[str, float]]:
        """Return the simulation in which defaults that are swept or changed are parameters, and the changes for it.

        It is the case assembled anew with symbols for these defaults; without any it is this simulation.
        """
        constants, values = self.system.constants, self._values(changes)
        departing = {path: x for path, x in values.items() if path in constants and x != constants[path][1]}
        for path, ends in plan.at(np.array([0, plan.size - 1])).items() if plan else ():
            if path in constants:  # any value but the default makes it a symbol
                usual = constants[path][1]
                departing[path] = next((x for x in ends.tolist() if x != usual), math.nextafter(usual, math.inf))
        if not departing:
            return self, {path: value for path, value in values.items() if path not in constants}
        if not self.case.text:
            path = next(iter(departing))
            raise InputError(f"{path} is at its default; a scene in Python gives another value to its law itself.")
        paths = frozenset(departing)
        if paths not in self._freed:
            case = self.case
            freed = cases.load_text(case.text, case.name, mechanism_text=case.mechanism_text, overrides=departing)
            self._freed[paths] = Simulation(replace(freed, own_run=case.own_run, file=case.file))
        return self._freed[paths], values

    def _values(self, changes: Overrides) -> dict[str, float]:
        units = self.units
        given = changes if isinstance(changes, Mapping) else assignments(changes)
        changes = {parameter_path(path, units): value for path, value in given.items()}
        if len(changes) < len(given):
            raise InputError(f"a parameter is given twice, with and without the key of its value: {', '.join(given)}.")
        unknown = next((path for path in changes if path not in units), None)
        if unknown is not None and self._is_key(unknown, changes[unknown]):
            remedy = "give it to `load`, or to `surfacechem.run`, beside the case"
            raise InputError(f"'{unknown}' is a key of the case, and no parameter that its runs may change: {remedy}.")
        if unknown is not None:
            raise InputError(f"no parameter '{unknown}' to change.{suggestion(unknown, self.system.changeable, PATHS)}")
        return {path: parse(value, units[path], name=path) for path, value in changes.items()}

    def _is_key(self, path: str, value: object) -> bool:
        """True if a path is a key of the case, even if its value is wrong; initial values are parameters."""
        case = self.case
        if not case.text or path.startswith("initial."):
            return False
        try:
            overridden(parse_document(case.text), {path: value})
        except InputError:
            return False  # there is no such section
        try:
            cases.load_text(case.text, case.name, mechanism_text=case.mechanism_text, overrides={path: value})
        except InputError as error:
            return error.place is not None and error.place.path == path
        return True
