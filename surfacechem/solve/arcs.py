"""Stretches of a run between events, and how they join to one result."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.system import State
from surfacechem.solve.contract import Counters, Events, Points, Problem, Result, Status
from surfacechem.solve.equilibria import ATOM, Point

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """A stretch as it was solved, in its own time and with its own ledger."""

    result: Result
    start: Point
    end: float
    """Time reached [s]."""
    status: Status
    times: Array
    """Output times reached [s]."""
    booked: Array
    """Ledger at its start."""


def changed(problem: Problem, **changes: object) -> Problem:
    """The problem over a stretch; what was checked of the whole run is not checked again."""
    other = copy.copy(problem)
    for name, value in changes.items():
        object.__setattr__(other, name, value)
    return other


def across_kink(states: Sequence[State], point: Point) -> Point | None:
    """The point on the other side of a gap of zero, where stiffness may jump and Newton's method stalls."""
    gaps = np.array([state.quantity.unit == "m" for state in states])
    closing = gaps & (np.abs(point.y) < ATOM) & (point.y * point.ydot < 0)
    return replace(point, y=np.where(closing, -point.y, point.y)) if closing.any() else None


def joined(blocks: Sequence[Array], width: int) -> Array:
    """Blocks of rows after each other; no rows of that width where there are no blocks."""
    if blocks:
        return np.concatenate(blocks)
    return np.empty((0, width)) if width else np.empty(0)


def all_events(parts: Sequence[Part], n: int, q: int) -> Events:
    """The events of all stretches, in the time and with the ledger of the run."""
    found = [(part, part.result.events) for part in parts if len(part.result.events.t)]
    return Events(
        joined([part.start.t + events.t for part, events in found], 0),
        joined([events.y for _, events in found], n),
        joined([events.ydot for _, events in found], n),
        joined([part.booked + events.ledger for part, events in found], q),
        index=np.concatenate([events.index for _, events in found]) if found else np.empty(0, np.int64),
    )


def all_steps(parts: Sequence[Part]) -> Points:
    """All steps. The start of a stretch, and what time cannot tell from it, is the event that is there already."""
    found = [(k, part, part.result.steps) for k, part in enumerate(parts) if part.result.steps is not None]
    kept = [(part.start.t + steps.t > part.start.t) if k else np.ones(len(steps.t), bool) for k, part, steps in found]
    pieces = list(zip(found, kept, strict=True))
    return Points(
        np.concatenate([part.start.t + steps.t[keep] for (_, part, steps), keep in pieces]),
        np.concatenate([steps.y[keep] for (_, _, steps), keep in pieces]),
        np.concatenate([steps.ydot[keep] for (_, _, steps), keep in pieces]),
        np.concatenate([part.booked + steps.ledger[keep] for (_, part, steps), keep in pieces]),
        segment=np.concatenate([np.full(int(keep.sum()), k) for (k, _, _), keep in pieces]),
    )


def all_counters(parts: Sequence[Part]) -> Counters:
    """What all stretches cost together."""
    if not parts:
        return Counters()
    return Counters(*(int(sum(counts)) for counts in zip(*(part.result.counters for part in parts), strict=True)))


def merged(problem: Problem, parts: Sequence[Part], status: Status, end: float, ledger: Array) -> Result:
    """The stretches as one result, which ends at this time with this ledger."""
    last = parts[-1].result if parts else None
    whole = changed(
        problem,
        segments=np.array([*(part.start.t for part in parts), problem.segments[-1]]) if parts else problem.segments,
        parameters=np.array([part.start.parameters for part in parts]) if parts else problem.parameters,
    )
    n, q = problem.program.n, problem.program.n_ledger
    return Result(
        problem=whole,
        status=status,
        t=end,
        y=last.y if last else problem.y0,
        ydot=last.ydot if last else np.zeros(n),
        ledger=ledger,
        margins=last.margins if last else np.zeros(0),
        times=joined([part.times for part in parts], 0),
        outputs=joined([part.result.outputs for part in parts], n),
        ledger_outputs=joined([part.result.ledger_outputs + part.booked for part in parts], q),
        events=all_events(parts, n, q),
        counters=all_counters(parts),
        steps=all_steps(parts) if problem.record_steps and parts else None,
        stepping=sum(part.result.stepping for part in parts),
        segment=np.repeat(np.arange(len(parts)), [len(part.times) for part in parts]) if parts else None,
    )
