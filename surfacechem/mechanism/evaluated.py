"""Reactions that are not lowered, and phases next to a surface: Cantera evaluates their rates during a run.

The heat of such a reaction follows from the potential as for any other, since the thermo of surface species is lowered.
Neighbours, gases and solids, have a prescribed composition and the temperature of the interface: reactions take
molecules, enthalpy and entropy from them without a change of their state.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, RateLaw, option, parameter
from surfacechem.contracts.units import ELECTRON_VOLT
from surfacechem.errors import InputError, Place, listed, refuse_unknown, suggestion
from surfacechem.expressions import Expression, absolute
from surfacechem.mechanism.rates import MechanismReaction
from surfacechem.mechanism.thermo import Formula, Species, identifiers, word
from surfacechem.quantities import MOLECULAR, Quantity
from surfacechem.scene import Electrode
from surfacechem.tolerances import TINY

Array = NDArray[np.float64]

ASKING = threading.Lock()
"""Lock around calls of Cantera: a surface has one state, which engines and threads share."""

GASES = frozenset(("ideal-gas", "Redlich-Kwong", "Peng-Robinson", "plasma"))
"""Cantera's phase models that depend on pressure."""

ELEMENTARY_CHARGE = float(ELECTRON_VOLT)
"""Elementary charge [C]: an electron volt in joules."""

FARADAY = ELEMENTARY_CHARGE * MOLECULAR
"""Charge of a kmol of elementary charges [C/kmol]."""

TRACE = 1e-300
"""Mole fraction at which a species that a neighbour lacks is counted, as in most models of Cantera: some have none."""

SUM_TOLERANCE = 1e-6
"""Tolerance of the sum of mole fractions, which has to be one."""


class Neighbour(NamedTuple):
    """Prescribed state of a phase next to the surface, as histories; constants are histories too."""

    pressure: Load | None = None
    """Pressure [Pa]; None if it is not given."""
    composition: Mapping[str, Load] = {}
    """Mole fractions."""
    rest: str = ""
    """The species whose mole fraction is one minus the sum of the others; empty if the given ones sum to one."""
    electric_potential: Load | None = None
    """Electric potential relative to the surface [V]; None if it is zero."""
    capacitance: float | None = None
    """Capacitance [F/m^2], if any: the potential then follows from the charge, and the value given is the initial
    one."""
    current: Load | None = None
    """Electric current into the phase from outside [A/m^2]."""
    place: Place | None = None

    @property
    def potential_at_start(self) -> float:
        """Electric potential at the start [V]."""
        return self.electric_potential.at_start() if self.electric_potential else 0.0


def hold(surface: Any, given: Mapping[str, Neighbour] | None, place: Place | None) -> tuple[str, ...]:
    """Set the neighbours of a surface to their initial states, and return remarks on species that they lack.

    InputError if a state is missing, unknown or invalid. None leaves the neighbours unchanged.
    """
    if given is None:
        return ()
    for name, state in given.items():
        refuse_unknown([name], surface.adjacent, f"the surface {surface.name} has no neighbour '{{}}'", state.place)
    for name, phase in surface.adjacent.items():
        state = given.get(name, Neighbour(place=place))
        if problem := _problem(phase, state) or _misheld(phase, state):
            raise InputError(problem, state.place)
        held = HeldPhase(phase, state)
        held.put(phase.T, held.at_start)
    return missing_species(surface)


def _problem(phase: Any, state: Neighbour) -> str:
    """Return the error of the state of a phase, in words; empty if the state is valid."""
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
    return _uneven(name, {species: load.at_start() for species, load in state.composition.items()}, bool(state.rest))


def _uneven(name: str, parts: Mapping[str, float], rest: bool) -> str:
    """Return the error of mole fractions, all or all but a ``rest``, in words; empty if there is none."""
    for species, part in parts.items():
        if not 0 <= part <= 1:
            return f"the mole fraction {species} = {part:g} in the neighbour {name} is outside its range: 0 to 1."
    total = sum(parts.values())
    wrong = total > 1 + SUM_TOLERANCE if rest else parts and abs(total - 1) > SUM_TOLERANCE
    return f"the mole fractions of the neighbour {name} sum to {total:.9g}, not to 1." if wrong else ""


def _misheld(phase: Any, state: Neighbour) -> str:
    """Return the error of the charge data of a phase, in words; empty if there is none."""
    name = phase.name
    if state.capacitance is None:
        if state.electric_potential is not None and not any(phase.charges):
            return f"`electric-potential` of the neighbour {name} is without effect, since its species have no charge."
        need = f"the current into the neighbour {name} needs a `capacitance`, else its potential is given."
        return "" if state.current is None else need
    given = state.electric_potential
    if given is not None and symengine.sympify(given.value(symengine.Symbol("t"))).free_symbols:
        problem = "follows from its charge, so `electric-potential` is a number, that of the start"
        remedy = "Remove `capacitance` where the potential is prescribed."
        return f"the potential of the neighbour {name} {problem}. {remedy}"
    return ""


class HeldPhase:
    """A phase next to the surface, with the ``states`` that :meth:`put` sets, in order.

    They are histories, and the potential of an ``electrode``.
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
        """Partial molar enthalpies of the species in the state set last [J/kmol]."""
        self._parts: Sequence[float] = [math.nan]
        self._all = np.zeros(phase.n_species)

    @property
    def taken_over(self) -> list[tuple[Quantity, Load]]:
        """Histories of pressure and composition, which a reactor may replace."""
        return [item for item in self.histories if item[1] is not self.given.electric_potential]

    @property
    def at_start(self) -> list[float]:
        """Values of the states at the start."""
        starts = {quantity: load.at_start() for quantity, load in self.histories}
        return [starts.get(quantity, self.given.potential_at_start) for quantity in self.states]

    def put(self, T: float, values: Sequence[float]) -> None:
        """Set a temperature [K] and values of the states."""
        # Beyond the zero of a falling pressure rates stay finite; otherwise no step could reach that zero.
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
        self.phase.TPX = T, pressure, np.maximum(self._all, TRACE)

    def limits(self, values: Mapping[str, Expression]) -> Iterator[tuple[str, Expression, str]]:
        """Yield margins of the histories: a name, an expression that must stay positive, and the reason if it fails."""
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

    def energies(self, both: Array) -> None:
        """Set partial molar enthalpies and Gibbs energies of the species [J/kmol], including their electric energy."""
        both[0] = self.enthalpies = self.phase.partial_molar_enthalpies
        both[1] = self.phase.chemical_potentials
        if self._charged:
            both += self.charges * self.phase.electric_potential


def indices(surface: Any, phase: Any) -> range:
    """Return the indices of a phase's species in the kinetics, where names may occur more than once."""
    first = surface.kinetics_species_index(0, surface.phase_index(phase.name))
    return range(first, first + phase.n_species)


def missing_species(surface: Any) -> tuple[str, ...]:
    """Return a remark on species that are absent in a neighbour although reactions produce them there."""
    back = np.array([reaction.reversible for reaction in surface.reactions()], dtype=bool)
    made = surface.product_stoich_coeffs.sum(axis=1) + surface.reactant_stoich_coeffs[:, back].sum(axis=1)
    there = (
        item
        for phase in surface.adjacent.values()
        for item in zip(phase.species_names, phase.X, indices(surface, phase), strict=True)
    )
    found = [name for name, part, index in there if part <= TRACE and made[index] > 0]
    diluted = "diluted without end, and its entropy is counted as at a mole fraction of 1e-300"
    text = f"the neighbours hold no {listed(found)}, which reactions make: what they release is {diluted}."
    return (text,) if found else ()


class EvaluatedReaction(MechanismReaction):
    """A reaction whose net rate is a number, evaluated outside at every call."""

    value: float = parameter("1/(m^2 s)", "net rate, evaluated by Cantera", varies=False)
    whole: Mapping[str, float] = option("products less reactants, those in neighbours included")
    reversible: bool = option("whether it runs both ways", default=True)

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]."""
        return Formula((), lambda _: self.value)

    @property
    def one_way(self) -> bool:
        """True if the reaction is irreversible."""
        return not self.reversible

    def turnover(self) -> Mapping[str, int | float]:
        """Change of every species, in molecules."""
        return dict(self.whole)


class NeighbourReaction(EvaluatedReaction):
    """A reaction that takes molecules from, or gives them to, phases next to the surface."""

    enthalpy: float = parameter("J", "enthalpy taken from neighbours, evaluated by Cantera", varies=False)
    gibbs: float = parameter("J", "Gibbs energy taken from neighbours, evaluated by Cantera", varies=False)
    in_neighbours: Mapping[str, float] = option("molecules of each species that it makes in neighbours")

    @property
    def made(self) -> Mapping[str, float]:
        """Molecules that one reaction produces in neighbours, by species."""
        return self.in_neighbours

    @property
    def taken(self) -> tuple[Formula, Formula]:
        """Enthalpy and Gibbs energy [J] that one reaction takes from the neighbours."""
        return Formula((), lambda _: self.enthalpy), Formula((), lambda _: self.gibbs)


class SurfaceEngine:
    """A Cantera surface that evaluates the net rates of some of its reactions, and what they take from neighbours.

    ``reactions`` are the laws of all its reactions, in its order; ``again`` makes an equal engine, and is what a pickle
    keeps, since Cantera's surfaces cannot be pickled.
    """

    def __init__(
        self,
        surface: Any,
        species: Sequence[Species],
        reactions: Sequence[RateLaw],
        neighbours: Mapping[str, Neighbour],
        again: Callable[[], Any],
    ) -> None:
        self.surface, self._again = surface, again
        self.positions = np.array([i for i, law in enumerate(reactions) if isinstance(law, EvaluatedReaction)])
        open_ones = [i for i, law in enumerate(reactions) if isinstance(law, NeighbourReaction)]
        given = ("value", self.positions), ("enthalpy", open_ones), ("gibbs", open_ones)
        self.gives = tuple(f"{reactions[i].path}.{name}" for name, numbers in given for i in numbers)
        # Motz and Wise's correction reverses a rate above a sticking coefficient of two, where it has no meaning.
        self._corrected = any(getattr(item.rate, "motz_wise_correction", False) for item in surface.reactions())
        # Rates may depend on a neighbour by an order, without a reaction that takes from it.
        beside = surface.adjacent.items() if len(self.positions) else ()
        self.held = [HeldPhase(phase, neighbours.get(name, Neighbour())) for name, phase in beside]
        self.names = identifiers(dict.fromkeys(name for law in reactions for name in law.made), "")
        first, own = species[0], [item.variable for item in species]
        self._own = "T_c", first.concentration, *own
        self._sites, self._count = first.sites, len(own)
        taken = np.asarray(surface.reactant_stoich_coeffs - surface.product_stoich_coeffs)
        rows = [*chain.from_iterable(indices(surface, held.phase) for held in self.held)]
        self._taken = taken[rows][:, open_ones] / MOLECULAR
        """What each reaction takes from neighbours, shape (species, reactions)."""
        self._energies = np.empty(0)
        self._lay_out()
        self._brought: list[tuple[object, ...]] = [()]
        """Engine, temperature, amount and states set last on the surface, since several engines may share it."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the call that reads the surface again, and the states of its neighbours."""
        return _read_again, (self._again, {held.phase.name: held.given for held in self.held})

    def with_neighbours(self, neighbours: Mapping[str, Neighbour]) -> SurfaceEngine:
        """Return a copy with other states of neighbours; InputError if no reaction has a neighbour of that name."""
        known = {held.phase.name: held.given for held in self.held}
        refuse_unknown(neighbours, known, f"no reaction of the surface {self.surface.name} has a neighbour '{{}}'")
        electric = "electric_potential", "capacitance", "current"
        kept = {name: {key: getattr(known[name], key) for key in electric} for name in neighbours}
        return self._holding({name: state._replace(**kept[name]) for name, state in neighbours.items()})

    def driven(self, loads: Mapping[str, Load]) -> SurfaceEngine:
        """Return a copy with other external currents into electrodes, by their names."""
        names = {held.phase.name: held.electrode.drive.name for held in self.held if held.electrode}
        given = {held.phase.name: held.given for held in self.held}
        return self._holding({x: given[x]._replace(current=loads[j]) for x, j in names.items() if j in loads})

    def _holding(self, states: Mapping[str, Neighbour]) -> SurfaceEngine:
        """Return a copy with other states of some neighbours."""
        made = SurfaceEngine.__new__(SurfaceEngine)  # no copy, which would read the surface again
        vars(made).update(vars(self))
        made.held = [HeldPhase(x.phase, states[x.phase.name]) if x.phase.name in states else x for x in self.held]
        made._lay_out()
        return made

    def _lay_out(self) -> None:
        """Assign the slices from which neighbours read their states, and the arrays for their energies."""
        self._last: tuple[Sequence[float], Array] = (), np.empty(0)
        self._both, self._parts = np.empty((2, len(self._taken))), list[tuple[HeldPhase, slice, Array]]()
        first = species = 0
        for held in self.held:
            last, end = first + len(held.states), species + len(held.charges)
            self._parts.append((held, slice(first, last), self._both[:, species:end]))
            first, species = last, end

    @property
    def temperatures(self) -> tuple[float, float]:
        """Temperature range in which the thermo of the surface and of its neighbours is valid [K]."""
        phases = [self.surface, *(held.phase for held in self.held)]
        return max(float(phase.min_temp) for phase in phases), min(float(phase.max_temp) for phase in phases)

    @property
    def charges(self) -> dict[str, dict[str, float]]:
        """Charge [C] per molecule of each charged species that reactions produce in neighbours, by phase."""
        found: dict[str, dict[str, float]] = {}
        for phase in (held.phase for held in self.held):
            charges = dict(zip(phase.species_names, phase.charges.tolist(), strict=True))
            made = (name for name in self.made_in(phase) if charges[name])
            found[word(phase.name)] = {name: ELEMENTARY_CHARGE * charges[name] for name in made}
        return found

    def made_in(self, phase: Any) -> dict[str, str]:
        """Return the ``names`` of species of this neighbour; an ambiguous name refers to the first such species."""
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
        """Yield margins of the histories: a name, an expression that must stay positive, and the reason if it fails."""
        for held in self.held:
            yield from held.limits(values)

    def __call__(self, values: Sequence[float]) -> Array:
        """Return net rates [1/(m^2 s)], then enthalpy and Gibbs energy [J] that each reaction takes from neighbours.

        ``values`` are the temperature, the amount of the first species at full coverage, the coverages, and the states
        of the neighbours.
        """
        with ASKING:
            # The residual, the outputs and the ledger are evaluated at the same state in turn.
            if values == self._last[0]:
                return self._last[1]
            T, amount, end = values[0], values[1], 2 + self._count
            if T > 0 and amount > 0:
                states = values[end:]
                around = self, T, amount, states
                if around != self._brought[0]:
                    self._brought[0] = ()  # invalid until all is set, as Cantera may raise
                    self.surface.TP = T, None
                    # A stretched surface has fewer sites per area; Cantera sets their density only for a surface
                    # with mass.
                    self.surface.set_unnormalized_coverages(np.ones(self._count))
                    self.surface.site_density = amount * self._sites / MOLECULAR
                    for held, read, written in self._parts:
                        held.put(T, states[read])
                        held.energies(written)
                    if self.held:
                        self._energies = self._both.dot(self._taken).ravel()
                    self._brought[0] = around
                # Trial coverages of a step need not sum to one; Cantera refuses negative mass.
                try:
                    self.surface.set_unnormalized_coverages(values[2:end])
                except RuntimeError:  # a CanteraError
                    self.surface.set_unnormalized_coverages(np.maximum(values[2:end], 0.0))
                rates = self.surface.net_rates_of_progress.take(self.positions) * MOLECULAR
                if self._corrected:
                    rates[self.surface.forward_rate_constants.take(self.positions) < 0] = math.nan
                found = np.concatenate((rates, self._energies))
            else:
                found = np.full(len(self.gives), math.nan)
            self._last = values, found
            return found


def _read_again(again: Callable[[], Any], states: Mapping[str, Neighbour]) -> Any:
    return again()._holding(states)
