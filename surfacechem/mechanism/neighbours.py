"""Phases beside a surface, gases and solids, that are held at a composition: what a case says of them.

They are at the temperature of the interface. What reactions take from them, or give to them, leaves them as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, Place, suggestion

GASES = frozenset(("ideal-gas", "Redlich-Kwong", "Peng-Robinson", "plasma"))
"""Cantera's models of phases whose pressure matters."""

FARADAY = 9.648533212331001e7
"""Charge of a kmol of elementary charges [C/kmol]."""

SUM_TOLERANCE = 1e-6
"""How far mole fractions may miss one."""


@dataclass(frozen=True)
class Neighbour:
    """The state in which a phase beside the surface is held."""

    pressure: float | None = None
    """[Pa]; None where it is not given."""
    composition: Mapping[str, float] = field(default_factory=dict)
    """Mole fractions."""
    electric_potential: float = 0.0
    """Against the surface [V]."""
    place: Place | None = None


class Held:
    """Phases beside a surface at their given states, and what reactions take from them."""

    def __init__(self, surface: Any, reactions: Sequence[int]) -> None:
        self.phases = list(surface.adjacent.values())
        self._pressures = [float(phase.P) for phase in self.phases]
        rows = [surface.kinetics_species_index(name) for phase in self.phases for name in phase.species_names]
        lost = surface.reactant_stoich_coeffs - surface.product_stoich_coeffs
        self._taken = np.asarray(lost)[np.ix_(rows, list(reactions))].T if rows else np.zeros((len(reactions), 0))
        self._charged = [FARADAY * phase.electric_potential * phase.charges for phase in self.phases]

    def warm(self, T: float) -> None:
        """Bring the phases to a temperature [K]."""
        for phase, pressure in zip(self.phases, self._pressures, strict=True):
            phase.TP = T, pressure

    def enthalpies(self) -> NDArray[np.float64]:
        """What each reaction takes, electric energy included [J/kmol]."""
        own = [phase.partial_molar_enthalpies + charged for phase, charged in self._each()]
        return np.asarray(self._taken @ np.concatenate(own))

    def gibbs_energies(self) -> NDArray[np.float64]:
        """What each reaction takes, electric energy included [J/kmol]."""
        own = [phase.chemical_potentials + charged for phase, charged in self._each()]
        return np.asarray(self._taken @ np.concatenate(own))

    def _each(self) -> Any:
        return zip(self.phases, self._charged, strict=True)


def hold(surface: Any, given: Mapping[str, Neighbour], place: Place | None) -> None:
    """Bring the neighbours of a surface to their states; InputError where one is missing, unknown or odd."""
    phases = surface.adjacent
    for name, state in given.items():
        if name not in phases:
            message = f"the surface {surface.name} has no neighbour '{name}'.{suggestion(name, phases)}"
            raise InputError(message, state.place)
    for name, phase in phases.items():
        _hold(phase, given.get(name, Neighbour(place=place)))


def _hold(phase: Any, state: Neighbour) -> None:
    gas = phase.thermo_model in GASES
    missing = "composition" if phase.n_species > 1 and not state.composition else ""
    if gas and state.pressure is None:
        missing = "pressure"
    if missing:
        example = f"{{{'pressure: 1 atm, ' if gas else ''}composition: {{{phase.species_names[0]}: 1}}}}"
        message = f"the neighbour {phase.name} has no `{missing}`: give `neighbours: {{{phase.name}: {example}}}`."
        raise InputError(message, state.place)
    for name in state.composition:
        if name not in phase.species_names:
            message = f"the neighbour {phase.name} has no species '{name}'.{suggestion(name, phase.species_names)}"
            raise InputError(message, state.place)
    total = sum(state.composition.values())
    if state.composition and abs(total - 1) > SUM_TOLERANCE:
        message = f"the mole fractions of the neighbour {phase.name} sum to {total:.9g}, not to 1."
        raise InputError(message, state.place)
    if state.composition:
        phase.X = dict(state.composition)
    if state.pressure is not None:
        phase.TP = phase.T, state.pressure
    phase.electric_potential = state.electric_potential


def remarks(surface: Any) -> tuple[str, ...]:
    """Species that a neighbour does not hold, though reactions give them to it."""
    back = np.array([reaction.reversible for reaction in surface.reactions()], dtype=bool)
    made = surface.product_stoich_coeffs.sum(axis=1) + surface.reactant_stoich_coeffs[:, back].sum(axis=1)
    found = []
    for phase in surface.adjacent.values():
        for name, part in zip(phase.species_names, phase.X, strict=True):
            if part == 0 and made[surface.kinetics_species_index(name)] > 0:
                found.append(name)
    if not found:
        return ()
    names = ", ".join(found[:6]) + (f" and {len(found) - 6} more" if len(found) > 6 else "")
    text = (
        f"the neighbours hold no {names}, which reactions make: what they release is diluted without end, and its "
        "entropy is counted as at a mole fraction of 1e-300."
    )
    return (text,)
