"""What every shipped case gives and what its equations are worth at a fixed point, for the golden files of both.

    python tests/golden_values.py [case ...]

writes golden/ anew, or the files of some cases. A difference to the one before is a change of what a run gives:
exact solutions and the estimated errors say whether it is right.

Kept are states, named quantities, accounts of works, heats and entropies at some times, the events with the states
beside them, and how the run ended. Where the outputs of a case follow its run, the run is made once more with outputs
at the times that are kept: no step depends on them. A variable is held to RELATIVE of its size, the largest value it
takes. Not every one is known to that: a machine that rounds otherwise may take other steps, and then the result differs
by what the tolerance leaves; a flux that is a difference of large terms has no digits at all. How far this goes is
measured: the case is run at tolerances a little apart, and where these runs differ by more, their difference is kept
as the variable's ``spread`` and counts instead.
"""

import json
import random
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import thermodynamics as laws
from case_runs import load

from surfacechem.format import names
from surfacechem.model.assemble import assemble
from surfacechem.results import spatial
from surfacechem.results.solution import Solution
from surfacechem.solve import AUTO

FOLDER = Path(__file__).parent / "golden"

RELATIVE = 1e-10
"""Difference that counts, relative to the size of a variable."""

APART = (1 + 1e-13, 1 - 1e-13, 1 + 1e-10, 1 - 1e-6, 0.99, 1.01, 0.9, 1.1)
"""Tolerances of the runs that tell the spread, relative to that of the case: the first change nothing but the
rounding of each step, the last let the run take other steps."""

BEYOND = 4
"""So many times the spread of these few runs another run may be away."""

EQUATIONS = 1e-12
"""Relative difference of an equation's value that counts: its numbers are doubles, the rest is exact."""

TIMES = 12
"""At most so many times are kept, the first and the last among them."""

WORDS = ("status", "regime", "reaction")
"""Attributes that are kept as they stand; of the reason, numbers have the nine digits that it prints."""

UNKEPT = ("energy_residual", "entropy_residual", "site_residual", "least_sigma_", "_exact", "coverage", "species")
"""What is rounding, what belongs to the steps rather than to the solution, exact solutions, and coverages once more."""

OVER = ("surface_time", "u")
"""First dimensions of what is not kept: what surfaces carry, at times that follow the outputs."""

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def path(name: str) -> Path:
    return FOLDER / f"{name}.json"


def columns(solution: Solution) -> dict[str, tuple[str, np.ndarray]]:
    """First dimension and values of the variables that are compared."""
    return {
        c.name: (c.dimensions[0], np.asarray(c.values))
        for c in solution.columns
        if c.dimensions and c.dimensions[0] not in OVER and not any(part in c.name for part in UNKEPT)
    }


def words(solution: Solution) -> dict[str, str]:
    """How a run ended and what kind of scene it was."""
    attributes = {name: str(solution.attributes[name]) for name in WORDS if name in solution.attributes}
    return {"reason": solution.reason, **attributes}


def equations(name: str) -> dict[str, float]:
    """Every row, named quantity, account and limit of a case in its modes at the start, away from equilibrium."""
    system = assemble(spatial.few(load(name).case.scene))
    point = laws.start_point(system, 0)
    laws.put_away(system, point, random.Random)
    parts = {f"row {row}": expression for row, expression in system.rows.items()}
    parts |= {f"output {item.name}": item.expression for item in system.outputs}
    parts |= {f"account {account.quantity.name}": account.rate for account in system.ledger}
    parts |= {f"limit {margin.name}": margin.masked for margin in system.margins}
    return {part: float(laws.number(system.expand(value), point)) for part, value in parts.items()}


def sampled(name: str, times: Sequence[float] = ()) -> Solution:
    """The run of a case, with outputs at these times where the case leaves them to the run."""
    case = load(name)
    settings = case.case.run
    if times and settings.picture is not None:
        settings = replace(settings, times=tuple(dict.fromkeys((0.0, *times, settings.times[-1]))))
    # An accuracy is verified by a second run in any case.
    way = "estimate" if settings.solver == AUTO else "balances"
    return case.run(run=replace(settings, picture=None), error=way)


def computed(name: str) -> dict[str, Any]:
    """What is kept of a case."""
    case, solution = load(name), sampled(name)
    settings, own = solution.trajectory.run, columns(solution)
    others = [columns(case.run(run=replace(settings, rtol=settings.rtol * f), error="balances")) for f in APART]
    shared = {dimension: min(_alike(own, other, dimension) for other in others) for dimension in ("time", "event")}
    picked = np.unique(np.linspace(0, shared["time"] - 1, TIMES).round().astype(int))
    return {
        **words(solution),
        "equations": equations(name),
        "times": own["time"][1][picked].tolist(),
        "variables": {
            variable: _entry(solution, variable, dimension, values, others, shared, picked)
            for variable, (dimension, values) in own.items()
        },
    }


def _alike(own: dict[str, Any], other: dict[str, Any], dimension: str) -> int:
    """So many output times, or events of the same names, two runs have in common."""
    _, a = own.get("event_name" if dimension == "event" else "time", ("", np.zeros(0)))
    _, b = other.get("event_name" if dimension == "event" else "time", ("", np.zeros(0)))
    count = min(len(a), len(b))
    different = np.flatnonzero(a[:count] != b[:count]) if dimension == "event" else []
    return int(different[0]) if len(different) else count


def _entry(solution, variable, dimension, values, others, shared, picked) -> dict[str, Any]:
    """Size, spread where it counts, and values of a variable."""
    count = shared.get(dimension, len(values))
    values = values[:count]
    chosen = values[picked] if dimension == "time" else values
    if values.dtype == object:
        return {"values": chosen.tolist()}
    size = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    # The last bit of a state may tell where the runs do not, as in a quantity that is zero in all of them.
    spread = solution.trajectory.roundings.get(variable, 0.0)
    for other in others:
        apart = np.abs(other[variable][1][:count] - values)
        spread = max(spread, float(np.max(apart, initial=0.0, where=np.isfinite(apart))))
    counts = BEYOND * spread > RELATIVE * size
    return {"size": size, **({"spread": spread} if counts else {}), "values": chosen.tolist()}


def differences(name: str, golden: dict[str, Any], solution: Solution) -> Iterator[str]:
    """Where a run is not what is kept of it: case, variable, time, and both values."""
    now = words(solution)
    for key in now.keys() | (golden.keys() - {"equations", "times", "variables"}):
        if not _same_words(golden.get(key, ""), now.get(key, "")):
            yield f"{name}: {key}: {now.get(key)!r}, kept is {golden.get(key)!r}"
    present, kept = columns(solution), golden["variables"]
    if present.keys() != kept.keys():
        yield f"{name}: without {sorted(kept.keys() - present.keys())}, new {sorted(present.keys() - kept.keys())}"
    times = {"time": present["time"][1], "event": present.get("event_time", ("", []))[1]}
    picked = np.searchsorted(times["time"], golden["times"]).tolist()
    for variable in present.keys() & kept.keys():
        dimension, values = present[variable]
        yield from _apart(name, variable, kept[variable], dimension, values, times.get(dimension), picked)


def _apart(name, variable, kept, dimension, values, times, picked) -> Iterator[str]:
    """Where a variable differs by more than counts."""
    indices = picked if dimension == "time" else list(range(len(kept["values"])))
    if indices and indices[-1] >= len(values):
        yield f"{name}: {variable}: only {len(values)} values, kept are {indices[-1] + 1}"
        return
    bound = max(RELATIVE * kept.get("size", 0.0), BEYOND * kept.get("spread", 0.0))
    for i, was in zip(indices, kept["values"], strict=True):
        if not _close(values[i], was, bound):
            at = f" at t = {times[i]!r} s" if times is not None else ""
            yield f"{name}: {variable}{at}: {values[i]!r}, kept is {was!r}; {bound:.1e} counts"


def _close(value: Any, was: Any, bound: float) -> bool:
    if isinstance(was, str):
        return _same_words(was, value)
    return bool(np.allclose(value, was, rtol=0, atol=bound, equal_nan=True))


def _same_words(was: str, now: str) -> bool:
    """Whether texts are the same but for the last of the nine digits that they print of a number."""
    if NUMBER.sub("#", was) != NUMBER.sub("#", now):
        return False
    return np.allclose([float(x) for x in NUMBER.findall(was)], [float(x) for x in NUMBER.findall(now)], 2e-9, 0)


def text(golden: dict[str, Any]) -> str:
    """The file of a case: a variable a line."""
    parts = [f" {json.dumps(key)}: {json.dumps(golden[key])}" for key in golden if key != "variables"]
    lines = [f"  {json.dumps(key)}: {json.dumps(entry)}" for key, entry in golden["variables"].items()]
    return "{\n" + ",\n".join([*parts, ' "variables": {\n' + ",\n".join(lines) + "\n }"]) + "\n}\n"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name in sys.argv[1:] or names():
        path(name).write_text(text(computed(name)), encoding="utf-8")
