"""Ideal mixture of surface species: their data, and the free energy from which their thermodynamics follows."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain, count
from typing import Self

from surfacechem.contracts.terms import Law, Potential, option, parameter
from surfacechem.expressions import Expression, mixing
from surfacechem.mechanism.interaction import Interaction
from surfacechem.mechanism.thermo import Bind, StandardGibbs
from surfacechem.quantities import AVOGADRO, BOLTZMANN
from surfacechem.tolerances import EQUAL


class Formula:
    """A formula whose argument names are known only after a mechanism is read."""

    def __init__(self, names: Iterable[str], evaluate: Callable[[Mapping[str, Expression]], Expression]) -> None:
        self.evaluate = evaluate
        self.__signature__ = _signature(tuple(dict.fromkeys(names)))

    def __call__(self, **values: Expression) -> Expression:
        """Evaluate at the named values."""
        return self.evaluate(values)


@lru_cache(maxsize=1024)  # a reaction states several formulas of the same variables
def _signature(names: tuple[str, ...]) -> inspect.Signature:
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Signature([inspect.Parameter(name, keyword) for name in names])


SPECIES_PATH = "interface.mechanism.species"
"""Path at which a case changes parameters of species."""


class BondSpring(Law):
    """Elasticity of a bond across the gap."""

    contract = "elasticity"
    formula = "energy"

    stiffness: float = parameter("N/m", "stiffness of the bond", at_least=0)
    rest_length: float = parameter("m", "length without force", default=0.0)

    def energy(self, g_n: Expression) -> Expression:
        """Elastic energy [J] of one bond.

        >>> round(BondSpring(stiffness=1e-3).energy(2e-9), 33)
        2e-21
        """
        return self.stiffness * (g_n - self.rest_length) ** 2 / 2


@dataclass(frozen=True)
class Species:
    """A surface species: names in the mechanism and of its coverage, sites, thermo and elasticity.

    ``interactions`` are the dependences of its thermo on coverages.
    """

    name: str
    variable: str
    sites: float
    gibbs: StandardGibbs
    spring: BondSpring | None = None
    interactions: tuple[Interaction, ...] = ()
    fixed: bool = False
    """True if its parameters cannot change, because Cantera uses those of the file."""

    @property
    def path(self) -> str:
        """Path at which a case changes its parameters."""
        return f"{SPECIES_PATH}.{self.name}"

    def bound(self, bind: Bind) -> Species:
        """Return the species with symbols for the parameters of its thermo and its spring."""
        if self.fixed:
            return self
        end = self.variable.removeprefix("theta")
        spring = bind(self.spring, self.path, end) if self.spring else None
        paths = [(form, ".".join(filter(None, (self.path, key))), key) for key, form in self.gibbs.ranges.items()]
        forms = [bind(form, path, f"{end}_{key}" if key else end) for form, path, key in paths]
        return replace(self, gibbs=self.gibbs.with_forms(forms), spring=spring)

    @property
    def amount(self) -> str:
        """Name of the amount per reference area at full coverage [1/m^2]."""
        return f"N_{self.variable}"

    @property
    def concentration(self) -> str:
        """Name of the amount per current area at full coverage [1/m^2]."""
        return f"n_{self.variable}"


class IdealMixture(Potential):
    r"""Free energy of species that share the sites of a surface and mix ideally.

    .. math:: \Psi = \sum_k N_k \theta_k \left[ g_k(T) + w_k(g_n) + k_B T (\ln \theta_k - 1) \right], \quad
              \frac{1}{N_k} \frac{\partial \Psi}{\partial \theta_k} = g_k(T) + w_k(g_n) + k_B T \ln \theta_k

    :math:`w_k = \tfrac12 k_b (g_n - l_0)^2` is the elastic energy of species that are springs across the gap,
    :math:`N_k` is the amount of species k at full coverage, the site density over the sites that k takes. If the
    thermo of species depends on coverages, the energy of their interactions is added, see
    :mod:`surfacechem.mechanism.interaction`. Source: Kee, Coltrin, Glarborg & Zhu, Chemically Reacting Flow (2018),
    ch. 11; the chemical potentials, enthalpies, entropies and heat capacities of Cantera's ideal-surface and
    coverage-dependent-surface phases. 0 <= theta_k <= 1.
    """

    species: tuple[Species, ...] = option("species of the surface phase")
    temperatures: tuple[float, float] = option("range of the species' thermodynamic data [K]")

    def with_parts(self, bind: Bind) -> Self:
        """Return the mixture with symbols for the parameters of its species."""
        return self.bind({"species": tuple(bind(item, item.path, "") for item in self.species)})

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Temperature range of the thermodynamic data."""
        return {"T_c": self.temperatures}

    @property
    def energy(self) -> Formula:  # type: ignore[override]
        """Free energy [J/m^2] as a function of temperature, coverages and amounts at full coverage."""
        names = (name for species in self.species for name in (species.variable, species.amount))
        gap = ("g_n",) if any(species.spring for species in self.species) else ()
        return Formula(("T_c", *gap, *names), self._energy)

    def _energy(self, values: Mapping[str, Expression]) -> Expression:
        T = values["T_c"]
        total: Expression = 0
        around: Expression = 0
        seen: set[frozenset[str]] = set()
        for species in self.species:
            theta, amount = values[species.variable], values[species.amount]
            elastic = species.spring.energy(values["g_n"]) if species.spring else 0
            # Mixing is proportional to T: as a separate term it cancels from the internal energy.
            total += amount * theta * (BOLTZMANN * species.gibbs(T) + elastic)
            total += amount * BOLTZMANN * T * (mixing(theta) - theta)
            for interaction in species.interactions:
                other, pair = values[interaction.variable], frozenset((species.name, interaction.on))
                if interaction.on == species.name:
                    around += amount * interaction.integral(T, theta)
                elif pair not in seen:  # each pair counts once
                    around += amount * theta * interaction.gibbs(T, other)
                seen.add(pair)
        return total + around / AVOGADRO if seen else total


def unpaired_dependence(species: Sequence[Species]) -> tuple[str, str] | None:
    """Return the first species with a dependence on another that derives from no potential, and the other; or None."""
    by_name = {item.name: item for item in species}
    pairs = [(item, x, by_name[x.on]) for item in species for x in item.interactions if x.on != item.name]
    # Maxwell: d g_k / d n_j = d g_j / d n_k, where n is a coverage over the number of sites of the species.
    for item, interaction, other in pairs:
        back = next((x for x in other.interactions if x.on == item.name), Interaction(item.name, item.variable))
        ours, theirs = interaction.slopes, back.slopes
        if ours is None or theirs is None:
            return item.name, other.name
        for slope, same in zip(ours, theirs, strict=True):
            x, y = slope / item.sites, same / other.sites
            if abs(x - y) > EQUAL * max(abs(x), abs(y)):
                return item.name, other.name
    return None


def word(name: str) -> str:
    """Return a Cantera name as part of the name of a quantity.

    >>> word("Li+[elyt]")
    'Li_elyt'
    """
    return re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_") or "species"


def identifiers(names: Iterable[str], prefix: str = "theta_") -> dict[str, str]:
    """Return a unique valid name of the coverage (or other variable) of each species.

    >>> identifiers(["free(s)", "bond(s)", "free-s"])
    {'free(s)': 'theta_free_s', 'bond(s)': 'theta_bond_s', 'free-s': 'theta_free_s_2'}
    """
    result: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        base = f"{prefix}{word(name)}"
        result[name] = next(n for n in chain((base,), (f"{base}_{i}" for i in count(2))) if n not in taken)
        taken.add(result[name])
    return result
