"""Reactions that are not lowered, and the phases beside a surface: Cantera gives their rates while a scene runs.

The heat of such a reaction follows from the potential like that of any other, since the thermo of surface species is
lowered. Neighbours, gases and solids, are held at a composition and at the temperature of the interface: what reactions
take from them, or give to them, leaves them as they are, and brings its enthalpy and its entropy with it.
"""

from __future__ import annotations

import copy
import math
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.contracts.si_units import ELECTRON_VOLT
from surfacechem.contracts.terms import Load, RateLaw, option, parameter
from surfacechem.errors import InputError, Place, refuse_unknown, suggestion
from surfacechem.expressions import Expression, absolute
from surfacechem.mechanism.mixture import Formula, Species, identifiers, word
from surfacechem.mechanism.rates import MechanismReaction
from surfacechem.quantities import MOLECULAR, Quantity
from surfacechem.scene import Electrode
from surfacechem.tolerances import TINY

Array = NDArray[np.float64]

ASKING = threading.Lock()
"""Held while Cantera is asked: a surface has one state, which engines and threads share."""

GASES = frozenset(("ideal-gas", "Redlich-Kwong", "Peng-Robinson", "plasma"))
"""Cantera's models of phases whose pressure matters."""

ELEMENTARY_CHARGE = float(ELECTRON_VOLT)
"""Elementary charge [C]: what an electron volt is in joules."""

FARADAY = ELEMENTARY_CHARGE * MOLECULAR
"""Charge of a kmol of elementary charges [C/kmol]."""

SUM_TOLERANCE = 1e-6
"""Tolerance of the sum of mole fractions, which is one."""


@dataclass(frozen=True)
class Neighbour:
    """The state in which a phase beside the surface is held: histories, a constant being one."""

    pressure: Load | None = None
    """Pressure [Pa]; None where it is not given."""
    composition: Mapping[str, Load] = field(default_factory=dict)
    """Mole fractions."""
    rest: str = ""
    """The species whose mole fraction is one less those of the others; none where these sum to one."""
    electric_potential: Load | None = None
    """Electric potential against the surface [V]; None where it is zero."""
    capacitance: float | None = None
    """Capacitance [F/m^2], if any: the potential then follows from charge, and is a number at the start."""
    current: Load | None = None
    """Electric current into the phase from outside [A/m^2]."""
    place: Place | None = None

    @property
    def potential_at_start(self) -> float:
        """Electric potential at the start [V]."""
        return self.electric_potential.at_start() if self.electric_potential else 0.0


def hold(surface: Any, given: Mapping[str, Neighbour] | None, place: Place | None) -> tuple[str, ...]:
    """Bring the neighbours of a surface to the states in which they start, and say what they lack; InputError where a
    state is missing, unknown or odd. None leaves them as they are.
    """
    if given is None:
        return ()
    for name, state in given.items():
        refuse_unknown([name], surface.adjacent, f"the surface {surface.name} has no neighbour '{{}}'", state.place)
    for name, phase in surface.adjacent.items():
        state = given.get(name, Neighbour(place=place))
        if problem := _problem(phase, state) or _misheld(name, state):
            raise InputError(problem, state.place)
        held = HeldPhase(phase, state)
        held.put(phase.T, held.at_start)
    return missing_species(surface)


def _problem(phase: Any, state: Neighbour) -> str:
    """Error in the state of a phase, in words; empty where it can be held so."""
    name, known, given = phase.name, phase.species_names, [*state.composition, *([state.rest] if state.rest else [])]
    pressureless = phase.thermo_model in GASES and state.pressure is None
    if pressureless or (len(known) > 1 and not given):
        pressure = "pressure: 1 atm, " if phase.thermo_model in GASES else ""
        example = f"{{{pressure}composition: {{{known[0]}: 1}}}}"
        missing = "pressure" if pressureless else "composition"
        return f"the neighbour {name} has no `{missing}`: give `neighbours: {{{name}: {example}}}`."
    for species in given:
        if species not in known:
            return f"the neighbour {name} has no species '{species}'.{suggestion(species, known)}"
    if state.rest in state.composition:
        return f"the mole fraction of {state.rest} in the neighbour {name} has two roles: give it, or `rest`."
    if state.pressure is not None and not state.pressure.at_start() > 0:
        return f"the pressure of the neighbour {name} is {state.pressure.at_start():g} Pa, not above zero."
    return uneven(name, {species: load.at_start() for species, load in state.composition.items()}, bool(state.rest))


def _misheld(name: str, state: Neighbour) -> str:
    """Error in the charge data of a phase, in words; empty where there is none."""
    if state.capacitance is None:
        need = f"the current into the neighbour {name} needs a `capacitance`, else its potential is given."
        return "" if state.current is None else need
    given = state.electric_potential
    if given is not None and symengine.sympify(given.value(symengine.Symbol("t"))).free_symbols:
        return (
            f"the potential of the neighbour {name} follows from its charge, so `electric-potential` is a number, that "
            "of the start. Remove `capacitance` where the potential is prescribed."
        )
    return ""


def uneven(name: str, parts: Mapping[str, float], rest: bool) -> str:
    """Error in the mole fractions of a phase, all or all but a ``rest``, in words; empty where there is none."""
    for species, part in parts.items():
        if not 0 <= part <= 1:
            return f"the mole fraction {species} = {part:g} in the neighbour {name} is outside its range: 0 to 1."
    total = sum(parts.values())
    wrong = total > 1 + SUM_TOLERANCE if rest else parts and abs(total - 1) > SUM_TOLERANCE
    return f"the mole fractions of the neighbour {name} sum to {total:.9g}, not to 1." if wrong else ""


class HeldPhase:
    """A phase beside the surface, and its ``states`` in the order in which :meth:`put` takes them: histories, or the
    potential of an ``electrode``.
    """

    def __init__(self, phase: Any, state: Neighbour) -> None:
        self.phase, self.given, self.pressure = phase, state, float(phase.P)
        self.species = np.array([phase.species_index(name) for name in state.composition], dtype=np.int64)
        self.rest = phase.species_index(state.rest) if state.rest else None
        self.charges = FARADAY * np.asarray(phase.charges)
        name = word(phase.name)
        p = Quantity(f"p_{name}", "Pa", f"pressure of {phase.name}")
        V = Quantity(f"V_{name}", "V", f"electric potential of {phase.name}")
        names = identifiers(state.composition, f"x_{name}_")
        x = [Quantity(names[species], "1", f"mole fraction of {species} in {phase.name}") for species in names]
        self.electrode: Electrode | None = None
        if state.capacitance is not None:
            own = name, phase.name, V, state.potential_at_start
            self.electrode = Electrode(*own, state.capacitance, state.current)
        potential = None if self.electrode else state.electric_potential
        loads = zip((p, V, *x), (state.pressure, potential, *state.composition.values()), strict=True)
        self.histories = tuple((quantity, load) for quantity, load in loads if load is not None)
        self._pressed, self._charged = state.pressure is not None, self.electrode is not None or potential is not None
        self.states = (*((p,) if self._pressed else ()), *((V,) if self._charged else ()), *x)
        self._fractions = [*names.values()]
        self.enthalpies = np.zeros(phase.n_species)
        """Partial molar enthalpies of its species where it was put last [J/kmol]."""
        self._parts: Sequence[float] = [math.nan]
        self._all = np.zeros(phase.n_species)

    @property
    def taken_over(self) -> list[tuple[Quantity, Load]]:
        """Those of its pressure and composition, which a reactor may give."""
        return [item for item in self.histories if item[1] is not self.given.electric_potential]

    @property
    def at_start(self) -> list[float]:
        """Its states at the start."""
        starts = {quantity: load.at_start() for quantity, load in self.histories}
        return [starts.get(quantity, self.given.potential_at_start) for quantity in self.states]

    def put(self, T: float, values: Sequence[float]) -> None:
        """Go to a temperature [K] and to values of the histories."""
        # Beyond the end of a falling pressure rates stay finite, or no step could reach that end.
        pressure = max(values[0], TINY) if self._pressed else self.pressure
        if self._charged:
            self.phase.electric_potential = values[self._pressed]
        if not len(self.species) and self.rest is None:
            self.phase.TP = T, pressure
            return
        parts = values[self._pressed + self._charged :]
        if parts != self._parts:
            self._parts, self._all[self.species] = parts, parts
            if self.rest is not None:
                self._all[self.rest] = max(1.0 - sum(parts), 0.0)
        self.phase.TPX = T, pressure, self._all

    def limits(self, values: Mapping[str, Expression]) -> Iterator[tuple[str, Expression, str]]:
        """Margins on the histories (by name): a name, an expression to stay positive, and the reason if it fails."""
        name, parts = self.phase.name, [values[q.name] for q, _ in self.histories if q.name in self._fractions]
        if self._pressed:
            yield f"pressure of {name} > 0", values[f"p_{word(name)}"], f"the pressure of {name} reached zero"
        for species, part in zip(self._fractions, parts, strict=True):
            yield f"{species} >= 0", part + SUM_TOLERANCE, f"the mole fraction {species} fell below zero"
        if self.rest is not None:
            text = f"the mole fractions given in {name} add up to more than one"
            yield f"rest of {name} >= 0", 1 + SUM_TOLERANCE - symengine.Add(*parts), text
        elif parts:
            text = f"the mole fractions of {name} no longer add up to one; let one species be its `rest`"
            yield f"sum in {name} = 1", SUM_TOLERANCE - absolute(symengine.Add(*parts) - 1), text

    def charged(self, names: Iterable[str]) -> dict[str, float]:
        """Charge [C] of a molecule of each of these species that is its own and has any."""
        charges = dict(zip(self.phase.species_names, self.phase.charges.tolist(), strict=True))
        return {name: ELEMENTARY_CHARGE * charges[name] for name in names if charges.get(name)}

    def energies(self, both: Array) -> None:
        """Set partial molar enthalpies and Gibbs energies of its species [J/kmol], with those of their charges."""
        both[0] = self.enthalpies = self.phase.partial_molar_enthalpies
        both[1] = self.phase.chemical_potentials
        if self._charged:
            both += self.charges * self.phase.electric_potential


def indices(surface: Any, phase: Any) -> range:
    """Indices of the species of a phase among those of the kinetics, some of which may have the same name."""
    first = surface.kinetics_species_index(0, surface.phase_index(phase.name))
    return range(first, first + phase.n_species)


def missing_species(surface: Any) -> tuple[str, ...]:
    """Species that a neighbour does not hold, though reactions give them to it."""
    back = np.array([reaction.reversible for reaction in surface.reactions()], dtype=bool)
    made = surface.product_stoich_coeffs.sum(axis=1) + surface.reactant_stoich_coeffs[:, back].sum(axis=1)
    there = (
        item
        for phase in surface.adjacent.values()
        for item in zip(phase.species_names, phase.X, indices(surface, phase), strict=True)
    )
    found = [name for name, part, index in there if part == 0 and made[index] > 0]
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
    beside: Mapping[str, float] = option("molecules of each species that it makes in neighbours")

    @property
    def made(self) -> Mapping[str, float]:
        """Molecules that one reaction makes in neighbours, by species."""
        return self.beside

    @property
    def taken(self) -> tuple[Formula, Formula]:
        """Enthalpy and Gibbs energy [J] that one reaction takes from the neighbours."""
        return Formula((), lambda _: self.enthalpy), Formula((), lambda _: self.gibbs)


def amounts_taken(surface: Any, phases: Sequence[Any]) -> Any:
    """Amount of each species of these phases, one after another, that each reaction takes: a row for a reaction."""
    rows = [index for phase in phases for index in indices(surface, phase)]
    return np.asarray(surface.reactant_stoich_coeffs - surface.product_stoich_coeffs)[rows].T


class SurfaceEngine:
    """A Cantera surface as the source of the net rates of some of its reactions, and of what they take from neighbours.

    ``reactions`` are the laws of all its reactions, in its order.
    """

    def __init__(
        self,
        surface: Any,
        species: Sequence[Species],
        reactions: Sequence[RateLaw],
        neighbours: Mapping[str, Neighbour],
    ) -> None:
        self.surface = surface
        self.positions = np.array([i for i, law in enumerate(reactions) if isinstance(law, EvaluatedReaction)])
        open_ones = [i for i, law in enumerate(reactions) if isinstance(law, NeighbourReaction)]
        energies = [f"{reactions[i].path}.{name}" for name in ("enthalpy", "gibbs") for i in open_ones]
        self.gives = (*(f"{reactions[i].path}.value" for i in self.positions), *energies)
        # Rates may read a neighbour that no reaction takes from, by an order.
        beside = surface.adjacent.items() if len(self.positions) else ()
        self.held = [HeldPhase(phase, neighbours.get(name, Neighbour())) for name, phase in beside]
        self.names = identifiers(dict.fromkeys(name for law in reactions for name in law.made), "")
        first, own = species[0], [item.variable for item in species]
        self._own = "T_c", first.concentration, *own
        self._sites, self._count = first.sites, len(own)
        self._taken = amounts_taken(surface, [held.phase for held in self.held])[open_ones].T / MOLECULAR
        self._energies = np.empty(0)
        self._lay_out()
        self._brought: list[tuple[object, ...]] = [()]
        """Engine, temperature, amount and states to which the surface was brought last, as several may share it."""

    def beside(self, neighbours: Mapping[str, Neighbour]) -> SurfaceEngine:
        """A copy with other pressures and compositions of neighbours; InputError where no reaction has such a one."""
        known = {held.phase.name: held for held in self.held}
        refuse_unknown(neighbours, known, f"no reaction of the surface {self.surface.name} has a neighbour '{{}}'")
        for name, state in neighbours.items():
            given = known[name].given
            electric = {key: getattr(given, key) for key in ("electric_potential", "capacitance", "current")}
            known[name] = HeldPhase(known[name].phase, replace(state, **electric))
        made = copy.copy(self)
        made.held = list(known.values())
        made._lay_out()
        return made

    def _lay_out(self) -> None:
        """Allot the slices from which neighbours read their states, and arrays to which they write their energies."""
        self._last: tuple[Sequence[float], Array] = (), np.empty(0)
        self._both, self._parts = np.empty((2, len(self._taken))), list[tuple[HeldPhase, slice, Array]]()
        first = species = 0
        for held in self.held:
            last, end = first + len(held.states), species + len(held.charges)
            self._parts.append((held, slice(first, last), self._both[:, species:end]))
            first, species = last, end

    @property
    def temperatures(self) -> tuple[float, float]:
        """Range in which the thermo of the surface and of its neighbours holds [K]."""
        phases = [self.surface, *(held.phase for held in self.held)]
        return max(float(phase.min_temp) for phase in phases), min(float(phase.max_temp) for phase in phases)

    @property
    def charges(self) -> dict[str, dict[str, float]]:
        """Charge [C] of a molecule of each species that reactions make in neighbours and that has any, by phase."""
        return {word(held.phase.name): held.charged(self.made_in(held.phase)) for held in self.held}

    def made_in(self, phase: Any) -> dict[str, str]:
        """Those ``names`` that mean species of this neighbour: of several by one name an equation means the first."""
        meant = self.surface.kinetics_species_index
        there = zip(phase.species_names, indices(self.surface, phase), strict=True)
        return {name: self.names[name] for name, i in there if name in self.names and meant(name) == i}

    @property
    def histories(self) -> tuple[tuple[Quantity, Load], ...]:
        """Histories of the neighbours."""
        return tuple(item for held in self.held for item in held.histories)

    @property
    def electrodes(self) -> tuple[Electrode, ...]:
        """Neighbours whose potential follows from their charge."""
        return tuple(held.electrode for held in self.held if held.electrode)

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the variables."""
        return (*self._own, *(quantity.name for held in self.held for quantity in held.states))

    def limits(self, values: Mapping[str, Expression]) -> Iterator[tuple[str, Expression, str]]:
        """Margins on the histories (by name): a name, an expression to stay positive, and the reason if it fails."""
        for held in self.held:
            yield from held.limits(values)

    def __call__(self, values: Sequence[float]) -> Array:
        """Net rates [1/(m^2 s)] at a temperature, the amount of the first species at full coverage, coverages, and the
        state of the neighbours.

        Then the enthalpy and the Gibbs energy [J] that each reaction with neighbours takes from them.
        """
        with ASKING:
            # The residual, its outputs and the ledger ask at the same state one after another.
            if values == self._last[0]:
                return self._last[1]
            T, amount, end = values[0], values[1], 2 + self._count
            if T > 0 and amount > 0:
                around = self, T, amount, values[end:]
                if around != self._brought[0]:
                    self._brought[0] = ()  # nowhere, should Cantera refuse on the way
                    self._bring(T, amount, values[end:])
                    self._brought[0] = around
                # Coverages that a step tries need not sum to one; a mass below zero Cantera does not know.
                try:
                    self.surface.set_unnormalized_coverages(values[2:end])
                except RuntimeError:  # a CanteraError
                    self.surface.set_unnormalized_coverages(np.maximum(values[2:end], 0.0))
                rates = self.surface.net_rates_of_progress.take(self.positions) * MOLECULAR
                found = np.concatenate((rates, self._energies))
            else:
                found = np.full(len(self.gives), math.nan)
            self._last = values, found
            return found

    def _bring(self, T: float, amount: float, states: Sequence[float]) -> None:
        """Bring the surface and its neighbours to a temperature [K], an amount of sites, and states of neighbours."""
        self.surface.TP = T, None
        # A stretched surface has fewer sites per area; their density can be set where the surface has a mass.
        self.surface.set_unnormalized_coverages(np.ones(self._count))
        self.surface.site_density = amount * self._sites / MOLECULAR
        for held, read, written in self._parts:
            held.put(T, states[read])
            held.energies(written)
        if self.held:
            self._energies = self._both.dot(self._taken).ravel()
