"""Errors of the cells across bodies, from a second run with half of them, and the cells that an accuracy needs.

The cells are of second order, so that the difference between the two runs is three times the error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfacechem.accuracy import FLOOR, relative_error
from surfacechem.integrate import Trajectory
from surfacechem.profiles import profile_values
from surfacechem.scene import MOST_CELLS, Body, Conduction, Scene
from surfacechem.solution import WITHIN, Accuracy

Array = NDArray[np.float64]

HELPED = 0.7
"""Part of the error that more cells must leave at most, lest others than these be the cause."""

FEW = 4

RICHARDSON = 3.0
"""Difference of the two runs over the error of the finer one, at second order."""

FASTEST, SAFETY = 8, 1.2
"""Most by which cells are multiplied at once, and the part by which errors are thought too small."""


def divided(scene: Scene) -> bool:
    """Whether a body has cells."""
    return any(body.conduction is not None and body.conduction.cells for body in scene.bodies)


def wanted(scene: Scene) -> float | None:
    """The accuracy that cells are chosen by, the tighter of two; None where the scene gives their number."""
    given = [body.conduction.accuracy for body in scene.bodies if body.conduction is not None]
    return min((accuracy for accuracy in given if accuracy is not None), default=None)


def tightened(scene: Scene, accuracy: float | None) -> Scene:
    """The scene with cells as accurate as the run is asked to be, where an accuracy chooses them; itself where they
    are.
    """
    least = wanted(scene)
    if accuracy is None or least is None or least <= accuracy:
        return scene

    def changed(body: Body) -> Body:
        law = body.conduction
        if law is None or law.accuracy is None:
            return body
        return replace(body, conduction=replace(law, accuracy=accuracy))

    first, second = scene.bodies
    return replace(scene, bodies=(changed(first), changed(second)))


def fixed(scene: Scene) -> list[str]:
    """Names of the bodies whose number of cells is given."""
    laws = ((body.name, body.conduction) for body in scene.bodies)
    return [name for name, law in laws if law is not None and law.cells and law.accuracy is None]


def halved(scene: Scene) -> Scene:
    """The scene with half of the cells."""
    return _with_cells(scene, lambda law: law.cells // 2)


def multiplied(scene: Scene, factor: int) -> Scene:
    """The scene with more cells where an accuracy chooses them."""
    return _with_cells(scene, lambda law: law.cells if law.accuracy is None else factor * law.cells)


def few(scene: Scene) -> Scene:
    """The scene with a few cells, as its equations are alike for any number of them."""
    return _with_cells(scene, lambda law: min(law.cells, FEW))


def _with_cells(scene: Scene, cells: Callable[[Conduction], int]) -> Scene:
    def changed(body: Body) -> Body:
        law = body.conduction
        return body if law is None else replace(body, conduction=replace(law, cells=cells(law)))

    first, second = scene.bodies
    return replace(scene, bodies=(changed(first), changed(second)))


def finer(scene: Scene, errors: Mapping[str, float]) -> int:
    """By how much to multiply the cells for the accuracy wanted: a power of two, 1 where it is reached or out of reach.

    >>> from surfacechem.scene import Interface
    >>> law = Conduction(thickness=1.0, conductivity=1.0, cells=16, accuracy=1e-4)
    >>> bodies = (Body("lower", "T_1", conduction=law), Body("upper", "T_2"))
    >>> [finer(Scene(bodies, Interface()), {"T_1": error}) for error in (5e-5, 2e-4, 1e-2)]
    [1, 2, 8]
    """
    accuracy, error = wanted(scene), _largest(errors)
    if accuracy is None or error <= accuracy:
        return 1
    needed = math.sqrt(SAFETY * error / accuracy) if math.isfinite(error) else 2.0
    most = _most(scene)
    factor: int = min(2 ** math.ceil(math.log2(needed)), FASTEST)
    while factor > 1 and factor * most > MOST_CELLS:
        factor //= 2
    return factor


def _largest(errors: Mapping[str, float]) -> float:
    values = list(errors.values())
    return math.nan if any(math.isnan(value) for value in values) else max(values, default=0.0)


def _most(scene: Scene) -> int:
    laws = [body.conduction for body in scene.bodies if body.conduction is not None]
    cells: list[int] = [law.cells for law in laws if law.accuracy is not None]
    return max(cells, default=0)


def missed(scene: Scene, errors: Mapping[str, float], found: Accuracy | None = None) -> tuple[str, ...]:
    """Words for an accuracy that the most cells do not reach, or that a given number of cells does not."""
    accuracy, error = wanted(scene), _largest(errors)
    if accuracy is not None and not error <= accuracy:
        text = (
            f"the accuracy {accuracy:g} of the cells is not reached with {_most(scene)} of them: the error is about "
            f"{error:.2g}. Ask for less, let outputs begin later, narrow the cells at the contact by `grading`, or "
            "give the other body more."
        )
        return (text,)
    names = fixed(scene)
    if not names or found is None or found.asked is None or found.error <= WITHIN * found.asked:
        return ()
    text = (
        f"a tolerance does not reduce the error of cells, whose number is given for {' and '.join(names)}: let "
        f"`cells: {{accuracy: {found.asked:g}}}` choose it, or give more"
    )
    return (text,)


def errors(fine: Trajectory, coarse: Trajectory) -> dict[str, float]:
    """Relative errors of states and profiles of the finer run, by name; not a number where the other ended earlier."""
    ours, theirs = _curves(fine, 2), _curves(coarse, 1)
    count = len(fine.result.times)
    if len(coarse.result.times) < count:
        return dict.fromkeys(ours, math.nan)
    return {name: relative_error(theirs[name][:count], ours[name], FLOOR) / RICHARDSON for name in ours}


def _curves(run: Trajectory, every: int) -> dict[str, Array]:
    system = run.model.system
    found = {s.name: run.result.outputs[:, j] for j, s in enumerate(system.states) if s.name not in system.inside}
    return found | {profile.name: profile_values(run, profile)[:, ::every] for profile in system.profiles}
