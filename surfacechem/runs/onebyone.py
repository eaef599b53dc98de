"""Runs that were made one by one, as the compiled loop hands back many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from surfacechem.solve.contract import Result
from surfacechem.solve.radau.solver import Batch


def batch(results: Sequence[Result]) -> Batch:
    """The runs as a batch; outputs that a run did not reach are zero."""
    counts = np.array([len(result.times) for result in results])
    most = max(len(result.problem.times) for result in results)
    filled = [
        np.array([np.pad(rows, ((0, most - len(rows)), (0, 0))) for rows in columns])
        for columns in ([r.outputs for r in results], [r.ledger_outputs for r in results])
    ]
    return Batch(
        status=np.array([int(result.status) for result in results]),
        t=np.array([result.t for result in results]),
        y=np.array([result.y for result in results]),
        ydot=np.array([result.ydot for result in results]),
        ledger=np.array([result.ledger for result in results]),
        margins=np.array([r.margins if len(r.margins) else np.zeros(r.problem.program.n_margins) for r in results]),
        outputs=filled[0],
        ledger_outputs=filled[1],
        counts=counts,
        steps=np.array([result.counters.steps for result in results]),
        events=[result.events for result in results],
    )
