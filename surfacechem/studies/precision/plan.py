"""What is compared, and a case measured by it."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from surfacechem.errors import InputError
from surfacechem.studies.precision.measure import Point, measure
from surfacechem.studies.precision.subject import Subject
from surfacechem.studies.precision.truth import Truth, establish

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Plan:
    """What is compared: solvers, tolerances from loose to tight, variables (none: the states), repetitions."""

    solvers: tuple[str, ...]
    tolerances: tuple[float, ...]
    variables: tuple[str, ...] = ()
    repeat: int = 5
    overrides: tuple[str, ...] = ()

    def command(self, cases: Sequence[str]) -> str:
        """The command line that makes the study."""
        words = ["surfacechem", "precision", *cases, "--solvers", ",".join(self.solvers)]
        words += ["--tolerances", ",".join(f"{rtol:g}" for rtol in self.tolerances), "--repeat", str(self.repeat)]
        words += ["--variables", ",".join(self.variables)] if self.variables else []
        return shlex.join([*words, *(word for text in self.overrides for word in ("--set", text))])


@dataclass(frozen=True)
class Measured:
    """One case: what it was held against, or why there is nothing, and its points."""

    subject: Subject
    variables: tuple[str, ...]
    truth: Truth | None
    untrue: str
    points: tuple[Point, ...]

    def point(self, solver: str, rtol: float) -> Point:
        """The point of a solver at a tolerance."""
        return next(point for point in self.points if (point.solver, point.rtol) == (solver, rtol))

    @property
    def reference(self) -> str:
        """What the case was held against, in words."""
        return self.truth.source if self.truth else self.untrue


def measured(subject: Subject, plan: Plan) -> Measured:
    """A case measured by the plan."""
    variables = _variables(subject, plan.variables)
    truth, untrue = None, ""
    log.info("%s: its reference", subject.name)
    try:
        truth = establish(subject, variables)
    except InputError as error:
        untrue = error.message
    log.info("%s: %d solvers at %d tolerances", subject.name, len(plan.solvers), len(plan.tolerances))
    points = measure(subject, truth, plan.solvers, plan.tolerances, plan.repeat)
    return Measured(subject, variables, truth, untrue, tuple(points))


def _variables(subject: Subject, wanted: Sequence[str]) -> tuple[str, ...]:
    """Those of the wanted variables that the case has; its states where none are named."""
    return tuple(name for name in wanted if name in subject.names) or tuple(subject.states)
