"""Reactions that are not lowered, and the phases beside a surface: Cantera gives their rates while a scene runs.

The heat of such a reaction follows from the potential like that of any other, since the thermo of surface species is
lowered. Neighbours, gases and solids, are held at a composition and at the temperature of the interface: what reactions
take from them, or give to them, leaves them as they are, and brings its enthalpy and its entropy with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from surfacechem.contracts.terms import RateLaw, option, parameter
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.mechanism.mixture import Formula, Species
from surfacechem.mechanism.rates import MechanismReaction
from surfacechem.quantities import MOLECULAR

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


def hold(surface: Any, given: Mapping[str, Neighbour], place: Place | None) -> tuple[str, ...]:
    """Bring the neighbours of a surface to their states, and say what they lack; InputError where a state is missing,
    unknown or odd.
    """
    for name, state in given.items():
        if name not in surface.adjacent:
            message = f"the surface {surface.name} has no neighbour '{name}'.{suggestion(name, surface.adjacent)}"
            raise InputError(message, state.place)
    for name, phase in surface.adjacent.items():
        state = given.get(name, Neighbour(place=place))
        if problem := _problem(phase, state):
            raise InputError(problem, state.place)
        if state.composition:
            phase.X = dict(state.composition)
        # At the temperature that it has: the engine brings it to that of the interface.
        if state.pressure is not None:
            phase.TP = phase.T, state.pressure
        phase.electric_potential = state.electric_potential
    return lacking(surface)


def _problem(phase: Any, state: Neighbour) -> str:
    """What is wrong with the state of a phase; nothing where it can be held so."""
    name, known, given = phase.name, phase.species_names, state.composition
    pressureless = phase.thermo_model in GASES and state.pressure is None
    if pressureless or (len(known) > 1 and not given):
        pressure = "pressure: 1 atm, " if phase.thermo_model in GASES else ""
        example = f"{{{pressure}composition: {{{known[0]}: 1}}}}"
        missing = "pressure" if pressureless else "composition"
        return f"the neighbour {name} has no `{missing}`: give `neighbours: {{{name}: {example}}}`."
    for species in given:
        if species not in known:
            return f"the neighbour {name} has no species '{species}'.{suggestion(species, known)}"
    total = sum(given.values())
    wrong = given and abs(total - 1) > SUM_TOLERANCE
    return f"the mole fractions of the neighbour {name} sum to {total:.9g}, not to 1." if wrong else ""


def lacking(surface: Any) -> tuple[str, ...]:
    """Species that a neighbour does not hold, though reactions give them to it."""
    back = np.array([reaction.reversible for reaction in surface.reactions()], dtype=bool)
    made = surface.product_stoich_coeffs.sum(axis=1) + surface.reactant_stoich_coeffs[:, back].sum(axis=1)
    there = (
        (name, part)
        for phase in surface.adjacent.values()
        for name, part in zip(phase.species_names, phase.X, strict=True)
    )
    found = [name for name, part in there if part == 0 and made[surface.kinetics_species_index(name)] > 0]
    names = ", ".join(found[:6]) + (f" and {len(found) - 6} more" if len(found) > 6 else "")
    text = (
        f"the neighbours hold no {names}, which reactions make: what they release is diluted without end, and its "
        "entropy is counted as at a mole fraction of 1e-300."
    )
    return (text,) if found else ()


class EvaluatedReaction(MechanismReaction):
    """A reaction whose net rate is a number that comes from outside at every call."""

    value: float = parameter("1/(m^2 s)", "net rate, evaluated by Cantera", varies=False)
    whole: Mapping[str, float] = option("products less reactants, those in neighbours included")
    reversible: bool = option("whether it runs both ways", default=True)

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]."""
        return Formula((), lambda _: self.value)

    @property
    def one_way(self) -> bool:
        """Whether the reaction runs one way only."""
        return not self.reversible

    def turnover(self) -> Mapping[str, int | float]:
        """Change of every species, in molecules."""
        return dict(self.whole)


class NeighbourReaction(EvaluatedReaction):
    """A reaction that takes something from phases beside the surface, or gives something to them."""

    enthalpy: float = parameter("J", "enthalpy taken from neighbours, evaluated by Cantera", varies=False)
    gibbs: float = parameter("J", "Gibbs energy taken from neighbours, evaluated by Cantera", varies=False)

    @property
    def taken(self) -> tuple[Formula, Formula]:
        """Enthalpy and Gibbs energy [J] that one reaction takes from the neighbours."""
        return Formula((), lambda _: self.enthalpy), Formula((), lambda _: self.gibbs)


class SurfaceEngine:
    """A Cantera surface as the source of the net rates of some of its reactions, and of what they take from neighbours.

    ``reactions`` are the laws of all its reactions, in its order.
    """

    def __init__(self, surface: Any, species: Sequence[Species], reactions: Sequence[RateLaw]) -> None:
        self.surface = surface
        self.positions = [i for i, law in enumerate(reactions) if isinstance(law, EvaluatedReaction)]
        open_ones = [i for i, law in enumerate(reactions) if isinstance(law, NeighbourReaction)]
        energies = [f"{reactions[i].path}.{name}" for name in ("enthalpy", "gibbs") for i in open_ones]
        self.gives = (*(f"{reactions[i].path}.value" for i in self.positions), *energies)
        first = species[0]
        self.reads = ("T_c", first.concentration, *(item.variable for item in species))
        self._sites = first.sites
        self._phases = list(surface.adjacent.values()) if open_ones else []
        self._pressures = [float(phase.P) for phase in self._phases]
        # Amount of each neighbour's species that a reaction takes, and the electric energy that comes with it.
        rows = [surface.kinetics_species_index(name) for phase in self._phases for name in phase.species_names]
        lost = surface.reactant_stoich_coeffs - surface.product_stoich_coeffs
        self._taken = np.asarray(lost)[np.ix_(rows, open_ones)].T
        self._charged = [FARADAY * phase.electric_potential * phase.charges for phase in self._phases]
        self._last: tuple[Sequence[float], Sequence[float]] = (), ()
        self._at, self._energies = math.nan, list[float]()

    def __call__(self, values: Sequence[float]) -> Sequence[float]:
        """Net rates [1/(m^2 s)] at a temperature, the amount of the first species at full coverage, and coverages.

        Then the enthalpy and the Gibbs energy [J] that each reaction with neighbours takes from them.
        """
        # The residual, its outputs and the ledger ask at the same state one after another.
        if values == self._last[0]:
            return self._last[1]
        T, amount, *coverages = values
        found = [math.nan] * len(self.gives)
        if T > 0 and amount > 0:
            if self._at != T:
                self._warm(T)
            # A stretched surface has fewer sites per area; coverages that a step tries need not sum to one.
            self.surface.site_density = amount * self._sites / MOLECULAR
            self.surface.set_unnormalized_coverages(coverages)
            found = (self.surface.net_rates_of_progress[self.positions] * MOLECULAR).tolist() + self._energies
        self._last = values, found
        return found

    def _warm(self, T: float) -> None:
        """Bring the surface and its neighbours, which are held, to a temperature [K]."""
        self._at, self.surface.TP = T, (T, None)
        for phase, pressure in zip(self._phases, self._pressures, strict=True):
            phase.TP = T, pressure
        self._energies = []
        for energy in ("partial_molar_enthalpies", "chemical_potentials") if self._phases else ():
            own = [getattr(x, energy) + charged for x, charged in zip(self._phases, self._charged, strict=True)]
            self._energies += (self._taken @ np.concatenate(own) / MOLECULAR).tolist()
