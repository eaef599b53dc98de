"""Exact solutions of bodies without cells: which scenes they belong to, and their values there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from surfacechem.contracts.terms import Load, Varying
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Reference
from surfacechem.scene import Body, Scene
from surfacechem.solve.run import Trajectory


def across(reference: Reference, exact: Mapping[str, Array], scene: Scene, run: Trajectory) -> dict[str, Array]:
    """Exact values by the names of the scene, profiles among them; InputError if it is another scene's.

    The equations of cells are met by no exact solution, so that the scene itself is looked at.
    """
    for reason in _strange(scene):
        raise InputError(f"it knows conduction between two bodies alone, and {reason}.")
    system, times = run.model.system, run.result.times
    names = [state.name for state in system.states] + [item.name for item in system.outputs]
    result = {name: np.array(values) for name, values in exact.items() if name in names}
    shared = scene.bodies[0].temperature
    if "T" in exact and shared == scene.bodies[1].temperature and isinstance(shared, str):
        result[shared] = np.array(exact["T"])
    profile: Any = getattr(reference, "profile")  # noqa: B009 - not every reference has one
    for item in system.profiles:
        places = np.array(item.points) * run.values[item.thickness]
        result[item.name] = profile(item.number, places, times)
        _at_start(result, item.surface, item.name, run)
    return result


def _at_start(result: dict[str, Array], surface: str, profile: str, run: Trajectory) -> None:
    """Two bodies have no temperature where they touch at the instant when they do: ours is taken."""
    names = [state.name for state in run.model.system.states]
    if surface in names:
        ours = run.result.outputs[0, names.index(surface)]
        result[profile][0, 0] = ours
        if surface in result:
            result[surface][0] = ours


def _strange(scene: Scene) -> Iterator[str]:
    """What the scene has beside conduction, in words."""
    interface = scene.interface
    if interface.potentials or interface.frictions or interface.reactions or interface.limits or interface.variables:
        yield "the interface has laws of its own"
    if scene.normal or scene.tangential or scene.programme or scene.loading:
        yield "something is loaded or moves"
    nodes = [body.temperature for body in scene.bodies]
    if interface.temperature is not None and interface.temperature not in nodes:
        yield "the interface has a temperature of its own"
    for path in scene.heat:
        names = {body.name for body in scene.bodies}
        if path.name() != "conductance" or set(path.between) != names or any(_varies(path, n) for n, _ in path.specs()):
            yield f"the heat path {path.name()} is no constant one between the bodies"
    for body in scene.bodies:
        yield from _strange_body(body)


def _strange_body(body: Body) -> Iterator[str]:
    if body.energy is not None and (body.energy.name() != "constant" or _varies(body.energy, "C")):
        yield f"the heat capacity of {body.name} varies"
    if body.conduction is not None and _varies(body.conduction, "conductivity"):
        yield f"the conductivity of {body.name} varies"
    loads = [body.temperature, body.conduction.far if body.conduction else None]
    if any(isinstance(load, Load) and load.name() != "hold" for load in loads):
        yield f"a temperature of {body.name} varies"


def _varies(law: Any, name: str) -> bool:
    return isinstance(getattr(law, name), Varying)
