"""A slider that moves in the plane, and what its tests share."""

import math

import numpy as np
from tables_mechanics import Solved, solve

from surfacechem.contracts.terms import Load
from surfacechem.laws.bulk import Quadratic
from surfacechem.laws.loading import Hold
from surfacechem.model.assemble import assemble
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model

BODIES = Body("lower", "T", Quadratic(C=50.0)), Body("upper", "T", Quadratic(C=50.0))
FREE, SPRING = Mounting(m=5.0), Mounting(k=1e8, m=10.0)


def scene(frictions, mount=FREE, initial=None, transverse=None, potentials=(), programme=(), **loading) -> Scene:
    """A slider on one plate; numbers under ``loading`` are held."""
    histories = {x: load if isinstance(load, Load) else Hold(level=float(load)) for x, load in loading.items()}
    interface = Interface("T", potentials, frictions)
    start = {"T": 300.0} | (initial or {})
    mounts = {"tangential": mount, "transverse": transverse}
    return Scene(BODIES, interface, (), histories, None, 300.0, start, programme=programme, **mounts)


def run(scene: Scene, times, **changes) -> Solved:
    solved = solve(Model(assemble(scene)), times, changes or None)
    assert solved.status == "finished", solved.reason
    assert solved.energy_error < 1e-9
    return solved


def events(solved: Solved) -> list[str]:
    return [jump.edge.name for jump in solved.jumps]


def moments(solved: Solved) -> list[float]:
    """Times of the events, those that follow each other at once as one."""
    times = [jump.t for jump in solved.jumps]
    return [t for before, t in zip([-1.0, *times], times, strict=False) if t > before * (1 + 1e-7)]


def close(found, exact, tolerance=1e-10):
    assert np.max(np.abs(found - exact)) <= tolerance * np.max(np.abs(exact))


def circling(t):
    a = 2 * math.pi
    return (
        np.array([2e-3 * math.sin(a * t), 1.5e-3 * math.sin(a * t + 1.0)]),
        np.array([2e-3 * a * math.cos(a * t), 1.5e-3 * a * math.cos(a * t + 1.0)]),
    )
