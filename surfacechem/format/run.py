"""How a case is run, and the exact solution that it names."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from surfacechem import references
from surfacechem import solve as solvers
from surfacechem.contracts.terms import Spec
from surfacechem.documents.document import Tree
from surfacechem.errors import Place
from surfacechem.format.fields import check, choice, items, mapping, number, whole
from surfacechem.results.accuracy import first_tolerance
from surfacechem.solve import AUTO
from surfacechem.solve import run as integrate

KEYS = ("until", "outputs", "spacing", "first", "times", "accuracy", "rtol", "atol", "solver", "max-steps")
RUN_KEYS = (*KEYS, "max-seconds")
SPACINGS = ("linear", "logarithmic")
MOST_OUTPUTS = 1_000_000

TIME = Spec("s", "time", above=0)


@dataclass(frozen=True)
class Run(integrate.Run):
    """How a case is run: output times [s], tolerances, solver, budgets."""

    @property
    def t_end(self) -> float:
        """End of the run [s]."""
        return self.times[-1]


@dataclass(frozen=True)
class Reference:
    """An exact solution by name, with those of its parameters that the case gives itself."""

    name: str
    options: Mapping[str, float] = field(default_factory=dict)
    place: Place | None = None

    @property
    def fixed(self) -> str:
        """Why it belongs to no other scene than that of the case, in words; empty where it follows changes."""
        if not self.options:
            return ""
        own = f"it is given with {', '.join(self.options)}, and the scene was changed"
        return f"the exact solution {self.name} is not of this scene: {own}"


def read_run(tree: Tree) -> Run:
    """The section ``run``."""
    fields = mapping(tree, RUN_KEYS)
    rtol, accuracy = _tolerance(fields)
    defaults = Run(times=(0.0, 1.0))
    seconds = fields.get("max-seconds")
    return Run(
        times=_times(tree, fields),
        rtol=defaults.rtol if rtol is None else rtol,
        atol=number(fields["atol"], "1", "atol", Spec("1", "", above=0, at_most=1)) if "atol" in fields else None,
        solver=_solver(fields, AUTO if accuracy is not None else defaults.solver),
        max_steps=whole(fields["max-steps"], "max-steps", 1) if "max-steps" in fields else defaults.max_steps,
        max_seconds=number(seconds, "s", "max-seconds", TIME) if seconds is not None else None,
        accuracy=accuracy,
    )


def _tolerance(fields: Mapping[str, Tree]) -> tuple[float | None, float | None]:
    """Relative tolerance and accuracy."""
    if "accuracy" in fields and "rtol" in fields:
        raise fields["accuracy"].error("the tolerance has two roles: give `accuracy` or `rtol`.")
    if "rtol" in fields:
        return number(fields["rtol"], "1", "rtol", Spec("1", "", above=0, at_most=0.1)), None
    if "accuracy" not in fields:
        return None, None
    accuracy = number(fields["accuracy"], "1", "accuracy", Spec("1", "", above=0, at_most=1))
    return first_tolerance(accuracy), accuracy


def _solver(fields: Mapping[str, Tree], default: str) -> str:
    if "solver" not in fields:
        return default
    name = choice(fields["solver"], "solver", (AUTO, *solvers.names))
    if name == AUTO and "rtol" in fields:
        raise fields["rtol"].error("the tolerance has two roles: with `solver: auto` it follows from `accuracy`.")
    return name


def _times(tree: Tree, fields: Mapping[str, Tree]) -> tuple[float, ...]:
    if "times" in fields:
        times, source = _listed(fields), fields["times"]
    elif "until" in fields:
        times, source = _spaced(fields), fields["until"]
    else:
        raise tree.error("the run needs an end. Add `until: 1 s`, or a list of `times`.")
    if any(b <= a for a, b in pairwise(times)):
        raise source.error("output times must increase from each to the next.")
    return times


def _listed(fields: Mapping[str, Tree]) -> tuple[float, ...]:
    for name in ("until", "outputs", "spacing", "first"):
        if name in fields:
            raise fields[name].error(f"the output times have two roles: give `times` or `{name}`.")
    spec = Spec("s", "time", at_least=0)
    times = tuple(number(item, "s", "a time", spec) for item in items(fields["times"]))
    times = times if times[:1] == (0.0,) else (0.0, *times)
    if len(times) < 2:
        raise fields["times"].error("at least one time after 0 is needed.")
    return times


def _spaced(fields: Mapping[str, Tree]) -> tuple[float, ...]:
    end = number(fields["until"], "s", "until", TIME)
    count = whole(fields["outputs"], "outputs", 2, MOST_OUTPUTS) if "outputs" in fields else 201
    spacing = choice(fields["spacing"], "spacing", SPACINGS) if "spacing" in fields else "linear"
    if spacing == "linear":
        if "first" in fields:
            raise fields["first"].error("`first` belongs to `spacing: logarithmic`.")
        return (*(end * (i / (count - 1)) for i in range(count - 1)), end)
    if "first" not in fields:
        raise fields["spacing"].error("logarithmic spacing needs `first`: the first output time after 0.")
    first = number(fields["first"], "s", "first", TIME)
    check(fields["first"], Spec("s", "", at_most=end), "first", first)
    steps = max(count - 2, 1)
    ratio = math.log(end) - math.log(first)
    return (0.0, *(first * math.exp(ratio * i / steps) for i in range(count - 2)), end)


def read_reference(tree: Tree) -> Reference | None:
    """The exact solution, by name or as ``{name: ..., parameter: value}``; none where it is left empty."""
    if tree.value is None or tree.value == "":
        return None
    fields = mapping(tree) if isinstance(tree.value, dict) else {"name": tree}
    if "name" not in fields:
        raise tree.error("the exact solution needs a `name`.")
    name = choice(fields["name"], "exact solution", references.names())
    if len(fields) == 1:
        return Reference(name, place=tree.place)
    parameters = {item.name: item.metadata["spec"] for item in dataclasses.fields(references.get(name))}  # type: ignore[arg-type]
    mapping(tree, ["name", *parameters])
    options = {
        key: number(child, parameters[key].unit, key, parameters[key]) for key, child in fields.items() if key != "name"
    }
    return Reference(name, options, tree.place)
