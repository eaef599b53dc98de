"""Cells across bodies: their number, their widths, and the discretisation error.

Heat that begins to enter through a face has reached the depth sqrt(alpha t) a time t later. The error of a grid can be
estimated from another grid only if both resolve that layer: cells far wider than it agree that almost nothing has
happened. If an accuracy chooses the cells they are therefore graded towards the layer at the time from which it is to
hold, and their number follows from the error there, whatever the outputs are. If their number is given and too small
for the layer at the first output, they are compared with cells that resolve it.

The cells are of second order: half of them have four times the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import compile_function
from surfacechem.model.system import Conductor, System
from surfacechem.results.accuracy import CELLS_UNKNOWN, RTOL_PART, Accuracy, CellErrors
from surfacechem.results.audit import MISSED_BY
from surfacechem.results.error_estimates import EVENTS, state_differences
from surfacechem.scene import Body, Conduction, Scene, e_folds
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Run, Trajectory
from surfacechem.tolerances import RUN_EPS

FEW = 4

CELLS_PER_E_FOLD = 8
"""Initial number of cells per growth of the distance from a face by e: errors are some 0.4 % of a temperature rise."""

THINNEST_LAYER = 2.0**-30
"""Least thickness of a layer relative to the body: it is of atomic size, and the width of a cell at the far side still
has six digits.
"""

FLUX_MARGIN, MOST_GROWTH = 3.0, 16.0
"""Ratio of the accuracy to the error allowed for temperatures, as heat fluxes are differences of them and err by more;
and largest factor by which the number of cells grows at once."""

MOST_CHOSEN_CELLS = 1024
"""Largest number of cells across a body that an accuracy chooses: for two such bodies each of the several estimates of
the error takes a second of preparation."""

MOST_GRIDS = 6
"""Largest number of grids in the search for an accuracy; two or three are usual."""

UNRESOLVED_START = 200
"""Inverse of the fraction of a run after which cells resolve a layer from its start, if the case gives no time."""

TIME_RATIO = 2.0
"""Ratio of successive times after a sudden change at which the errors of cells are estimated."""

ORDER, LEAST_ORDER = 4.0, 2.0
"""Ratio of the error with half of the cells to that with all: for second order, and for first, the least that
converges.
"""


def is_divided(scene: Scene) -> bool:
    """True if a body has cells."""
    return any(True for _ in _laws(scene))


def asked_cell_accuracy(scene: Scene) -> float | None:
    """Return the accuracy that chooses the cells, the tighter of two; None if the scene gives their number."""
    return min((law.accuracy for _, law in _laws(scene) if law.accuracy is not None), default=None)


def _laws(scene: Scene) -> Iterable[tuple[str, Conduction]]:
    laws = ((body.name, body.conduction) for body in scene.bodies)
    return ((name, law) for name, law in laws if law is not None and law.cells)


def _changed(scene: Scene, change: Callable[[str, Conduction], Conduction]) -> Scene:
    def changed(body: Body) -> Body:
        law = body.conduction
        return body._replace(conduction=change(body.name, law)) if law is not None and law.cells else body

    first, second = scene.bodies
    return replace(scene, bodies=(changed(first), changed(second)))


def tightened(scene: Scene, accuracy: float | None) -> Scene:
    """Return the scene with the accuracy of the run for cells that an accuracy chooses, unless their own is tighter."""
    least = asked_cell_accuracy(scene)
    if accuracy is None or least is None or least <= accuracy:
        return scene
    return _changed(scene, lambda _, law: law if law.accuracy is None else replace(law, accuracy=accuracy))


def with_given_cells(scene: Scene) -> list[str]:
    """Return the names of the bodies whose number of cells is given."""
    return [name for name, law in _laws(scene) if law.accuracy is None]


def few(scene: Scene) -> Scene:
    """Return the scene with a few cells; its equations have the same form for any number of them."""
    return _changed(scene, lambda _, law: replace(law, cells=min(law.cells, FEW)))


def coarsened(scene: Scene, divisor: int, given: bool = True) -> Scene:
    """Return the scene with a half or a quarter of its cells; without ``given`` only of those chosen by an accuracy."""
    return _changed(
        scene, lambda _, law: replace(law, cells=law.cells // divisor) if given or law.accuracy is not None else law
    )


def grid(scene: Scene) -> tuple[object, ...]:
    """Return the settings that identify the cells of a scene."""
    return tuple((law.cells, law.layer, law.accuracy) for _, law in _laws(scene))


def resolved_after(system: System, end: float) -> float:
    """Return the time [s] after a sudden change from which on cells resolve it, in a run of this length [s]."""
    return min([p.after for p in system.profiles if p.after is not None], default=end / UNRESOLVED_START)


def layer_starts(system: System, end: float) -> Array:
    """Return the times [s] at which a thermal layer may begin: the start, and the breakpoints of loads."""
    return np.array(sorted({0.0, *(t for t in system.breakpoints if 0 < t < end)}))


def unresolved(system: System, end: float, t: Array) -> NDArray[np.bool_]:
    """Return the mask of times at which a layer has just begun that cells do not resolve; all False without cells."""
    if not system.profiles:
        return np.zeros(len(t), bool)
    starts = layer_starts(system, end)
    since = t - starts[np.searchsorted(starts, t, side="right") - 1]
    # The margin is the rounding of times and their differences.
    return np.asarray(since < resolved_after(system, end) - RUN_EPS * t)


def with_check_times(system: System, run: Run) -> Run:
    """Return the run with the times at which errors of cells are estimated, whatever the outputs of the case are."""
    end = run.times[-1]
    after = resolved_after(system, end)
    times = [end * (i / UNRESOLVED_START) for i in range(UNRESOLVED_START)]
    for start in layer_starts(system, end).tolist():
        doublings = range(max(math.ceil(math.log2(end / (UNRESOLVED_START * after))), 0))
        times += [start + after * TIME_RATIO**k for k in doublings]
    seen = np.unique([t for t in times if 0 < t < end])
    return replace(run, times=(0.0, *seen[~unresolved(system, end, seen)].tolist(), end), picture=None)


def shortest(system: System, run: Run, values: Mapping[str, float], events: Iterable[float] = ()) -> float:
    """Return the shortest time [s] from the start of a layer, a load or an event, to an output or an event.

    Events within the tolerance of the start are at the same instant.
    """
    events = list(events)
    starts = np.unique([*layer_starts(system, run.times[-1]), *events])
    seen = np.unique([*run.times[1:], *(t for t in events if t > 0)])
    since = seen - starts[np.searchsorted(starts, seen) - 1]
    since = since[since > run.rtol * seen]
    swinging = [1 / (2 * math.pi * values[path]) for path in system.cycles if values[path] > 0]
    return min([*since.tolist(), *swinging], default=run.times[-1])


def layers(system: System, points: Sequence[Mapping[str, float]], times: Sequence[float]) -> dict[str, float]:
    """Return by body the thinnest layer that heat has reached, as a fraction of the body rounded to a power of two.

    ``points`` are values of runs by path, each with one of the ``times``. Properties are those at the start.
    """
    paths = {p.symbol: p.path for p in system.parameters} | {s.symbol: s.path for s in system.states}
    found = {}
    for conductor in system.notes_of(Conductor):
        slow = system.expand(conductor.resistance * conductor.capacity).subs({system.t: 0.0})
        symbols = [symbol for symbol in slow.free_symbols if symbol in paths]
        table = np.array([[point[paths[symbol]] for symbol in symbols] for point in points]).reshape(len(points), -1)
        diffusion = compile_function(symbols, [slow])(table)[:, 0]  # time in which heat crosses the body [s]
        part = math.sqrt(float(np.min(np.asarray(times) / diffusion)))
        found[conductor.body] = 2.0 ** math.floor(math.log2(min(max(part, THINNEST_LAYER), 1.0)))
    return found


def with_resolved_layers(scene: Scene, parts: Mapping[str, float], given: bool = False) -> Scene:
    """Return the scene with cells that resolve layers of the relative thickness ``parts``, for bodies whose cells an
    accuracy chooses, or whose number is ``given``.

    Together with an accuracy, ``grading`` is a lower bound.
    """

    def change(name: str, law: Conduction) -> Conduction:
        if (law.accuracy is None) is not given:
            return law
        layer = min(parts[name], 1 / (law.grading - 1) if law.grading > 2 else 1.0)
        return replace(law, layer=layer, cells=_cells(CELLS_PER_E_FOLD * e_folds(layer, law.far is not None)))

    return _changed(scene, change)


def _cells(number: float) -> int:
    """Return a number of cells that can be halved twice."""
    return min(4 * max(math.ceil(number / 4), 2), MOST_CHOSEN_CELLS)


def refined(scene: Scene, found: CellErrors, parts: Mapping[str, float]) -> Scene | None:
    """Return the scene with the cells that an accuracy needs according to these errors; None if nothing is to be done.

    The grid is graded for layers that events have begun. If there is no convergence, a layer is thinner than assumed.
    """
    accuracy, laws = asked_cell_accuracy(scene), {name: law for name, law in _laws(scene) if law.accuracy is not None}
    if accuracy is None:
        return None
    factor, thinner = 1.0, 1.0
    if not found.converged:
        factor, thinner = 2.0, 0.25
    elif found.largest > accuracy / FLUX_MARGIN and not found.in_noise:
        # With a margin of 10 %, lest the next estimate be just above the aim.
        factor = min(math.sqrt(1.1 * FLUX_MARGIN * found.largest / accuracy), MOST_GROWTH)
    now = {name: max(min(parts[name], law.layer * thinner), THINNEST_LAYER) for name, law in laws.items()}
    if factor == 1.0 and all(now[name] == law.layer for name, law in laws.items()):
        return None

    def change(name: str, law: Conduction) -> Conduction:
        if name not in laws:
            return law
        both = law.far is not None
        more = factor * law.cells * e_folds(now[name], both) / e_folds(law.layer, both)
        return replace(law, layer=now[name], cells=_cells(more))

    changed = _changed(scene, change)
    return None if grid(changed) == grid(scene) else changed


def resolves(scene: Scene, parts: Mapping[str, float]) -> bool:
    """True if half of the cells resolve layers of the relative thickness ``parts``, with at least two in a quarter."""

    def fine(law: Conduction, layer: float) -> bool:
        at = replace(law, cells=law.cells // 2).points
        return all(b - a <= layer + (min(a, 1 - b) if law.far is not None else a) for a, b in pairwise(at))

    return all(law.cells >= 8 and fine(law, parts[name]) for name, law in _laws(scene))


def cell_errors(near: Mapping[str, float], far: Mapping[str, float], rtol: float) -> CellErrors:
    """Return errors from the differences of a run to one with half of its cells, and of that to one with a quarter.

    >>> cell_errors({"T": 3e-6}, {"T": 1.2e-5}, 1e-11).variables["T"]
    1e-06
    >>> cell_errors({"T": 1e-5}, {"T": 5e-6}, 1e-11).converged
    False
    """
    first, second = (max(each.values(), default=0.0) for each in (near, far))
    in_noise = first <= rtol / RTOL_PART  # errors of runs are below this
    if in_noise:
        return CellErrors(near, in_noise=True)
    # Events that one pair of runs alone disagrees on are infinitely wrong in that pair, and no error in the other.
    known = {name: far.get(name, 0.0) / d if 0 < d < math.inf else ORDER for name, d in near.items()}
    factors = {name: min(max(ratio, LEAST_ORDER), ORDER) for name, ratio in known.items()}
    errors = {name: d / (factors[name] - 1) for name, d in near.items()}
    return CellErrors(errors, converged=math.isfinite(second) and second >= LEAST_ORDER * first)


def worst_errors(errors: Sequence[CellErrors]) -> CellErrors:
    """Return the errors of the run whose largest error is the largest, or unknown."""
    return max(errors, key=lambda found: found.largest if found.converged else math.inf, default=CellErrors())


def differences(better: Trajectory, worse: Trajectory) -> dict[str, float]:
    """Return differences of states, profiles and times of events of two runs with different cells, by name and relative
    to the better one; infinite for events that only one of them has.

    Initial values are left out, as they are given and not due to the cells.
    """
    errors, note = state_differences(worse, better, first=1)
    return {**errors, EVENTS: math.inf} if note or better.status != worse.status else errors


def unmet_accuracy(scene: Scene, errors: CellErrors, found: Accuracy | None = None) -> tuple[str, ...]:
    """Describe errors that are unknown, an accuracy that the most cells do not reach, or one that a given number of
    cells misses.
    """
    if not errors.converged:
        return (f"{CELLS_UNKNOWN}. Let outputs begin later after what is sudden, or say `after`, or give more of them",)
    accuracy, names = asked_cell_accuracy(scene), with_given_cells(scene)
    if accuracy is not None and not errors.largest <= accuracy:
        most = max(law.cells for _, law in _laws(scene) if law.accuracy is not None)
        problem = f"the accuracy {accuracy:g} of the cells is not reached with {most} of them"
        remedy = "Ask for less, or for it to hold `after` a longer time, or give the other body more."
        return (f"{problem}: the error is about {errors.largest:.2g}. {remedy}",)
    if not names or found is None or found.asked is None or found.error <= MISSED_BY * found.asked:
        return ()
    problem = f"a tolerance does not reduce the error of cells, whose number is given for {' and '.join(names)}"
    return (f"{problem}: let `cells: {{accuracy: {found.asked:g}}}` choose it, or give more",)
