"""Rates of bonds under load as an extension of Cantera.

A mechanism with ``extensions: [{type: python, name: surfacechem.extension}]`` may give its reactions any rate type of
this package (``type: Bell`` and so on), in every Cantera script. Loads that a rate reads in addition to temperature and
coverages (``f``, the force per bond [N]; ``g_n``, the gap [m]) are attributes of the surface, which has to be of a
subclass of ``cantera.Interface`` that takes attributes, such as :class:`LoadedInterface`.
"""

from __future__ import annotations

import ctypes
import math
import warnings
import weakref
from collections.abc import Callable, Collection, Mapping
from functools import cached_property, partial
from typing import Any, ClassVar

import cantera
import symengine

from surfacechem.compile.program import C_FUNCTION, compile_function
from surfacechem.errors import InputError, refuse_unknown, suggestion
from surfacechem.expressions import EXPONENT_CAP
from surfacechem.mechanism.rates import AffinityReaction, CoverageTerm, InterfaceArrhenius, kinds
from surfacechem.mechanism.source import REACTION, converted, own_parameters, sides
from surfacechem.quantities import BOLTZMANN, KILO, MOLECULAR, VARIABLES
from surfacechem.tolerances import TINY

__all__ = ["LoadedInterface"]

PER_KMOL = {"J/mol": KILO, "J": MOLECULAR}
"""Energies that may be per amount, with the factor to an energy per kmol."""

LARGEST = 700.0
"""Largest affinity over k_B T in an exponential."""

TOP = math.exp(EXPONENT_CAP)

FLOOR = TINY ** (1 / 3)
"""Floor of coverages in a division by mass action of up to third order."""


class LoadedInterface(cantera.Interface):
    """A Cantera surface whose bonds are under load: set the attributes that its rates read, ``f`` or ``g_n``.

    ``f`` [N] may be a mapping from species to forces; a reaction then reads that of the first of its species.
    """


class Surroundings(cantera.ExtensibleRateData):
    """Data that the rates of a type read: temperature, coverages, and the attributes of the surface."""

    def __init__(self) -> None:
        super().__init__()
        self.T = 0.0
        self.names: list[str] = []
        self.surface: Any = None
        self.loads: Mapping[str, Any] = {}
        """Attributes of the surface instance."""
        self._coverages: dict[str, float] | None = None

    def update(self, surface: Any) -> bool:
        """Update the state; always, since a force can change at constant temperature."""
        self.T, self._coverages = surface.T, None
        if self.surface is not None and self.surface() is surface:
            return True
        if not self.names:
            self.names = [surface.species(k).name for k in range(surface.n_species)]
        # Weak, since a strong reference would keep the surface alive; only a class that takes attributes allows it.
        self.surface = weakref.ref(surface) if hasattr(surface, "__weakref__") else None
        self.loads = getattr(surface, "__dict__", {})
        if self.surface is None:
            self._coverages = self._of(surface)
        return True

    @property
    def coverages(self) -> dict[str, float]:
        """Coverages by species, taken from the surface when a rate first reads one."""
        if self._coverages is None:
            self._coverages = self._of(self.surface())
        return self._coverages

    def _of(self, surface: Any) -> dict[str, float]:
        coverages = getattr(surface, "coverages", None)  # a clone is no Interface, and has lost its load
        return dict(zip(self.names, coverages.tolist(), strict=True)) if coverages is not None else {}

    def read(self, name: str, kind: str) -> Any:
        """Return an attribute of the surface; there is no default, since a forgotten load is not zero."""
        surface = self.surface() if self.surface is not None else None
        if not hasattr(surface, name):
            quantity = VARIABLES[name]
            raise AttributeError(
                f"a rate of type {kind} reads {name}, the {quantity.long_name.partition(',')[0]} [{quantity.unit}], "
                f"which the surface does not have. Load the mechanism with surfacechem.extension.LoadedInterface, set "
                f"its attribute `{name}`, and do not let Cantera clone it."
            )
        return getattr(surface, name)


class _Symbols(dict[str, Any]):
    """Symbols by name, made when a formula reads them."""

    def __missing__(self, name: str) -> Any:
        self[name] = symengine.Symbol(name)
        return self[name]


class LoadedRate(cantera.ExtensibleRate):
    """A rate type of this package as an extensible rate of Cantera; subclasses name the law that they evaluate."""

    law: ClassVar[type[InterfaceArrhenius]]

    def set_parameters(self, node: Any, units: Any) -> None:
        """Read the entry of a reaction; an error is kept for ``validate``, which reports it with its line."""
        self.kind = self.law.kind.removeprefix("interface-")
        self.problem, self.capped = "", False
        self.bound: InterfaceArrhenius | None = None
        self.units = units.product()
        try:
            self.bound = self._read(node, units)
        except (InputError, cantera.CanteraError, ValueError) as error:
            self.problem = str(error)

    def _read(self, node: Any, units: Any) -> InterfaceArrhenius:
        equation = str(node.get("equation", ""))
        own = self.law.own_keys()
        refuse_unknown(node, {*REACTION, *self.law.keys, *own}, f"a rate of type {self.kind}: unknown key '{{}}'")
        constant = node.get("rate-constant")
        _check_all(constant, self.law.keys["rate-constant"], "rate-constant")
        coverage = []
        for name, item in sorted((node.get("coverage-dependencies") or {}).items()):
            _check_all(item, self.law.keys["coverage-dependencies"], f"coverage-dependencies: {name}")
            energies = item["E"] if isinstance(item["E"], list | tuple) else [item["E"]]
            E = tuple(_number(node.units, "E", energy, "J/mol") for energy in energies)
            coverage.append(CoverageTerm(name, float(item["a"]), float(item["m"]), E))
        values: dict[str, Any] = {
            "A": float(constant.convert_rate_coeff("A", units)),
            "b": float(constant["b"]),
            "Ea": _number(node.units, "Ea", constant["Ea"], "J/mol"),
            "coverage": tuple(coverage),
        }
        who = f"a rate of type {self.kind}"
        values |= own_parameters(
            self.law, own, node, who, lambda key, spec: _number(node.units, key, node[key], spec.unit)
        )
        reactants, products, reversible = sides(equation)
        orders = reactants | {str(name): float(order) for name, order in (node.get("orders") or {}).items()}
        change = {name: products.get(name, 0.0) - reactants.get(name, 0.0) for name in (*reactants, *products)}
        structure = {"equation": equation, "orders": orders, "products": products, "change": change}
        values |= {"number": "R", "species": (), "reversible": reversible, **structure}
        return self.law(**values)

    def get_parameters(self, node: Any) -> None:
        """Write the entry of the reaction in the units of its file."""
        if self.bound is None:
            return
        specs = dict(self.law.specs())
        for key, name in self.law.own_keys().items():
            value, unit = getattr(self.bound, name), specs[name].unit
            if self.bound.is_default(name):
                continue
            if unit == "1":
                node[key] = value
            elif unit in PER_KMOL:
                node.set_activation_energy(key, value * PER_KMOL[unit], "J/kmol")
            else:
                node.set_quantity(key, value, unit)
        constant = cantera.AnyMap()
        constant.set_quantity("A", self.bound.A, self.units)
        constant["b"] = self.bound.b
        constant.set_activation_energy("Ea", self.bound.Ea * KILO, "J/kmol")
        node["rate-constant"] = constant
        entries = {term.variable: cantera.AnyMap() for term in self.bound.coverage}
        for term in self.bound.coverage:
            entry = entries[term.variable]
            entry["a"], entry["m"] = term.a, term.m
            entry["E"] = [f"{energy!r} J/mol" for energy in term.E]  # Cantera gives a list no units
        if entries:
            node["coverage-dependencies"] = entries

    def validate(self, equation: str, surface: Any) -> None:
        """Refuse an invalid entry, and one that Cantera would evaluate wrongly."""
        if self.problem:
            raise ValueError(self.problem)
        assert self.bound is not None
        species = {item.name: item for item in map(surface.species, range(surface.n_species))}
        for term in self.bound.coverage:
            if term.variable not in species:
                guess = suggestion(term.variable, species)
                raise ValueError(f"coverage-dependencies: no species '{term.variable}'.{guess}")
        self.species = tuple(word for word in equation.split() if word in species)
        elastic = [name for name in self.species if "bond" in species[name].input_data]
        if "<=>" in equation and elastic:
            raise ValueError(
                f"{elastic[0]} is elastic, which Cantera's equilibrium constant does not know, so the reverse rate "
                "would be wrong. Write two one-way reactions."
            )

    @cached_property
    def coefficient(self) -> tuple[list[tuple[int, str]], Any, Any, Callable[[], None]]:
        """Compiled coefficient: indices and names of the arguments but temperature, arguments, value, evaluation."""
        assert self.bound is not None
        symbols = _Symbols(T_c=symengine.Symbol("T_c"))
        expression = self.bound.coefficient(symbols, 0.0)
        code = compile_function(list(symbols.values()), [expression])
        arguments, value = (ctypes.c_double * len(symbols))(), (ctypes.c_double * 1)()
        function = C_FUNCTION(code.address)
        places = ctypes.addressof(value), ctypes.addressof(arguments), code.user
        self._code = code
        return list(enumerate(symbols))[1:], arguments, value, partial(function, *places)

    def eval(self, data: Any) -> float:
        """Return the rate coefficient in kmol, m and s."""
        reads, arguments, value, evaluate = self.coefficient
        arguments[0] = data.T
        for i, name in reads:
            load = data.loads.get(name)
            arguments[i] = load if isinstance(load, float) else self._read_from(data, name)
        evaluate()
        found: float = value[0]
        law = self.bound
        if not math.isfinite(found):
            told = ", ".join(f"{name} = {arguments[i]:g}" for i, name in ((0, "T"), *reads))
            raise ValueError(f"a rate of type {self.kind} has no value at {told}.")
        if found > TOP and law is not None and found > max(law.A * data.T**law.b, 1.0) * TOP and not self.capped:
            self.capped = True
            warnings.warn(
                f"reaction {law.equation}: the logarithm of its rate of type {self.kind} is above "
                f"{EXPONENT_CAP:g}; beyond that the rate goes on along its tangent.",
                RuntimeWarning,
                stacklevel=2,
            )
        return found

    def _read_from(self, data: Surroundings, name: str) -> float:
        """Return a coverage or a load, which may be given by species."""
        if name in data.names:
            return data.coverages[name]
        value = data.read(name, self.kind)
        if not isinstance(value, Mapping):
            return float(value)
        found = next((species for species in self.species if species in value), None)
        if found is None:
            raise AttributeError(f"{name} has no value for any of {', '.join(self.species)}.")
        return float(value[found])


class ByAffinity(Surroundings):
    """Data that rates by affinity read: also the chemical potentials over R T."""

    def update(self, surface: Any) -> bool:
        """Update the state."""
        super().update(surface)
        potentials = surface.chemical_potentials / (cantera.gas_constant * self.T)
        self.potentials = dict(zip(self.names, potentials.tolist(), strict=True))
        return True


class AffinityRate(LoadedRate):
    """A rate by affinity as the coefficient of mass action with the same net rate."""

    def eval(self, data: Any) -> float:
        """Return the rate coefficient in kmol, m and s."""
        law = self.bound
        assert isinstance(law, AffinityReaction)
        x = sum(nu * data.potentials[name] for name, nu in law.change.items())
        ratio = -law.net(1.0, x * BOLTZMANN * data.T, data.T) / math.expm1(min(x, LARGEST)) if x else 1.0
        for name, order in law.orders.items():
            ratio /= max(data.coverages[name], FLOOR) ** order
        return float(super().eval(data) * ratio)


def _check_all(node: Any, keys: Collection[str], title: str) -> None:
    """Raise InputError unless a mapping has exactly these keys, like Cantera's own rates."""
    if not isinstance(node, Mapping):
        raise InputError(f"{title} must be a mapping with {', '.join(sorted(keys))}.")
    refuse_unknown(node, keys, f"{title}: unknown key '{{}}'")
    for key in sorted(set(keys) - set(node)):
        raise InputError(f"{title}: {key} is missing.")


def _number(units: Any, key: str, value: Any, unit: str) -> float:
    try:
        return converted(units, value, unit)
    except (cantera.CanteraError, TypeError, ValueError):
        raise InputError(f"{key} = {value} is not a quantity in {unit}.") from None


# One Cantera rate for every rate type that Cantera does not have.
for _kind, _law in kinds().items():
    if not _law.native:
        _rate, _data = (AffinityRate, ByAffinity) if issubclass(_law, AffinityReaction) else (LoadedRate, Surroundings)
        _made = type(_law.__name__, (_rate,), {"law": _law, "__module__": __name__, "__doc__": _law.__doc__})
        globals()[_law.__name__] = cantera.extension(name=_kind, data=_data)(_made)
