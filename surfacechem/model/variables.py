"""Symbols of a scene: parameters of laws, variables and their roles. A law gets its arguments by their names."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import symengine

from surfacechem.contracts.terms import Factor, Law, Load, Spec, UnderPressure, Varying, optional, reads, resolved_unit
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.expressions import Expression, product
from surfacechem.model.system import Parameter, Role
from surfacechem.quantities import VARIABLES

L = TypeVar("L", bound=Law)

REMEDIES = {
    "g_n": "Prescribe `g_n` under `loading`, or mount the bodies: `mechanics: {normal: {k: ...}}`.",
    "g_t": "Prescribe `g_t` under `loading`, or mount the bodies: `mechanics: {tangential: {k: ...}}`.",
    "v": "Prescribe `v` under `loading`, or let `mechanics` give it.",
    "v_2": "Prescribe `v` and `v_2` under `loading`, or let `mechanics` give both.",
    "w_n": "Prescribe `w_n` under `loading` or move it in the programme: 0 m where the far field does not move.",
    "w_t": "Prescribe `w_t` under `loading` or move it in the programme: 0 m where the far field does not move.",
    "w_t2": "Prescribe `w_t2` under `loading`, beside `w_t`: 0 m where the far field does not move across.",
    "direction": "Prescribe `v` under `loading`, or mount the bodies, `mechanics: {tangential: ...}`, and give the "
    "interface what resists sliding: `friction`, or a potential of the tangential gap.",
    "direction_2": "Prescribe `v` and `v_2` under `loading`, or mount the bodies: `mechanics: {tangential: ...}`.",
    "p": "Prescribe `p` under `loading`, or give the interface a potential that reads the normal gap.",
    "t_s": "Give the interface a law of friction.",
    "p_contact": "Give the interface a potential that reads the normal gap, or prescribe `p`.",
    "t_n": "Prescribe `t_n` under `loading`, or give the interface a potential that reads the normal gap.",
    "f": "Prescribe `f` under `loading`, or a load on the bonds: `t_n`, or a potential that reads the normal gap.",
    "phi": "Give `phi` under `initial` and a law under `bonding`, or prescribe `phi` under `loading`.",
    "T_0": "Give the reference temperature `T_0` at the top of the case.",
    "T_c": "Give `interface.temperature`, or both bodies a temperature.",
    "N_c": "Give `interface.sites`, or the force on a single bond, `f` under `loading`.",
    "n_c": "Give `interface.sites`.",
    "n_1": "Give `interface.sites`.",
    "n_2": "Give `interface.sites`.",
    "mu": "Give `interface.sites` and a potential that reads the bonding state.",
}


def unit_of(name: str) -> str:
    """Return the unit of a variable; a name that is not in the table is a temperature node or a coverage."""
    if name in VARIABLES:
        return VARIABLES[name].unit
    return "K" if name.startswith("T") else "1"


class Parameters:
    """The run-time numbers, each with a short name that is unique in the scene."""

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        self.items: list[Parameter] = []
        self.constants: dict[str, tuple[Spec, float]] = {}
        """Specification and value of parameters of laws that have their default values, hence numbers in formulas."""
        self._taken = {*VARIABLES, *reserved}
        self._paths: set[str] = set()
        self._numbers: dict[str, int] = {}
        """Largest number in use, by the names and paths that need one."""

    def add(
        self, name: str, path: str, spec: Spec, value: float, load: Load | None = None, field: str = ""
    ) -> Expression:
        """Add a parameter of a law and return its symbol; if its name is taken it gets another one."""
        owners = [part for part in path.replace("-", "_").split(".")[:-1] if part.isidentifier()]
        candidates = [name, *(f"{name}_{owner}" for owner in reversed(owners))]
        free = next((c for c in candidates if c not in self._taken), "") or self._numbered(name, "_{}", self._taken)
        self._taken.add(free)
        return self._append(Parameter(symengine.Symbol(free), path, spec, value, load, field))

    def constant(self, name: str, path: str, spec: Spec, value: float, internal: bool) -> Expression:
        """Add a scene-level number under exactly this name and return its symbol."""
        spec.check(path, value)
        self._taken.add(name)
        return self._append(Parameter(symengine.Symbol(name), path, spec, value, internal=internal))

    def _append(self, parameter: Parameter) -> Expression:
        path = parameter.path
        if path in self._paths:
            path = self._numbered(path, "[{}]", self._paths)
        self._paths.add(path)
        self.items.append(parameter._replace(path=path))
        return parameter.symbol

    def _numbered(self, name: str, ending: str, taken: Container[str]) -> str:
        """Return the name with the first free number appended."""
        i = self._numbers.get(name + ending, 2)
        while (found := name + ending.format(i)) in taken:
            i += 1
        self._numbers[name + ending] = i
        return found


class Variables:
    """Variables that formulas may read. A variable is made when it is first read; an unread one is never made."""

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.roles: list[Role] = []
        self.varying: list[tuple[Law, str, Spec, Expression]] = []
        """Parameters whose factors may carry them out of their range: law, name, specification and expression."""
        self.factors: list[tuple[Factor, Factor, Expression]] = []
        """The factors of parameters that vary, as given and bound, with their variable; None for that of the scene."""
        self._makers: dict[str, Callable[[], Expression] | Expression] = {}
        self._symbols: dict[str, Expression] = {}
        self._bound: dict[Any, Any] = {}

    def define(self, name: str, make: Callable[[], Expression] | Expression, role: str, by: str) -> None:
        """Give a name its role and its expression, or a function that makes it; a second role is an error."""
        if name in self._makers:
            taken = next(r for r in self.roles if r.variable == name)
            raise InputError(
                f"{name} has two roles: {taken.role} ({taken.by}) and {role} ({by}). Remove one of them.",
                path=f"loading.{name}" if "loading" in (taken.by, by) else "",
            )
        self._makers[name] = make
        self.roles.append(Role(name, role, by))

    def has(self, name: str) -> bool:
        """True if the name has a role."""
        return name in self._makers

    def was_read(self, name: str) -> bool:
        """True if the name has been read so far."""
        return name in self._symbols

    def get(self, name: str, reader: str | Law, path: str = "") -> Expression:
        """Return the expression of a name.

        ``reader`` is a law, or another reader in words, with its ``path`` in a case; messages name it.
        """
        if name == "p" and isinstance(reader, UnderPressure) and reader.pressure == "contact":
            name = "p_contact"
        if name not in self._symbols:
            if name not in self._makers:
                who, place = (f"the law {reader.name()}", reader.place) if isinstance(reader, Law) else (reader, None)
                remedy = REMEDIES.get(name, suggestion(name, self._makers).strip())
                message = f"{who} reads {self._described(name)}, but nothing evolves or prescribes it. {remedy}"
                raise InputError(message, place, path=path)
            made = self._makers[name]
            self._symbols[name] = made() if callable(made) else made
        return self._symbols[name]

    def _described(self, name: str) -> str:
        words = VARIABLES[name].long_name.partition(":")[0] if name in VARIABLES else "variable"
        if words.startswith("one while"):
            return f"the variable {name}"
        return f"the {words}" if name in words.split() else f"the {words} {name}"

    def call(
        self, law: Law, formula: Callable[..., Expression] | None, extra: Mapping[str, Expression] | None = None
    ) -> Expression:
        """Evaluate the formula of a bound law on the arguments that it names.

        ``extra`` has precedence over the variables of the scene. An argument with a default is left out if the scene
        has no variable of that name.
        """
        assert formula is not None, f"{law.name()} does not state this"
        own = extra or {}
        names = [name for name in reads(formula) if name in own or self.has(name) or name not in optional(formula)]
        return formula(**{name: own[name] if name in own else self.get(name, law) for name in names})

    def bind(self, law: L, path: str, suffix: str = "", unit: str = "") -> L:
        """Bind a law: replace every numeric parameter by its symbol, times its factors if it varies.

        ``path`` is the path in a case file for a law that was built in Python, ``unit`` the meaning of "[x]".
        """
        law = law if law.place else replace(law, place=Place(path=path))
        law = law.with_parts(self.shared)
        values: dict[str, Expression] = {}
        for name, spec in law.specs():
            values[name] = self._symbol(law, name, law.refine(name, spec).resolved(unit), suffix)
            if spec.stretch and values[name] is not None and self.has("J_c"):
                values[name] *= self.get("J_c", law) ** spec.stretch
        if isinstance(law, Load):
            for name, local_unit in law.local.items():
                spec = Spec(resolved_unit(local_unit, unit), f"{name} of the present piece")
                values[name] = self.parameters.add(name, f"{law.path}.{name}", spec, 0.0, law, name)
        return law.bind(values)

    def shared(self, law: Any, path: str, suffix: str = "") -> Any:
        """Bind a law that has several readers, or what consists of such laws, once, and return it."""
        if law not in self._bound:
            self._bound[law] = self.bind(law, path, suffix) if isinstance(law, Law) else law.bound(self.shared)
        return self._bound[law]

    def _symbol(self, law: Law, name: str, spec: Spec, suffix: str) -> Expression:
        value = getattr(law, name)
        path = f"{law.path}.{name}"
        if isinstance(value, Varying):
            symbol = self.parameters.add(name + suffix, path, spec, value.value)
            bound = [(item, self.bind(item, f"{path}.{item.name()}", unit=unit_of(item.of))) for item in value.factors]
            self.factors += [(*pair, None) for pair in bound]
            symbol = product(symbol, *(self.factor(factor) for _, factor in bound))
            low = max(spec.above, spec.at_least)
            bounded = low > 0 or math.isfinite(spec.at_most)
            if bounded or not all(factor.keeps_sign for factor in value.factors):
                self.varying.append((law, name, spec, symbol))
            return symbol
        if value is None:
            return None
        if law.is_default(name):
            self.parameters.constants[path] = (spec, float(value))
            return int(value) if float(value).is_integer() else value
        return self.parameters.add(name + suffix, path, spec, value)

    def factor(self, factor: Factor, own: Mapping[str, Expression] | None = None) -> Expression:
        """Return the value of a bound factor; ``own`` has precedence over the variables of the scene."""
        if "T_0" in reads(factor.factor) and unit_of(factor.of) != "K":
            message = f"the factor {factor.name()} is one of temperature; of: {factor.of} is none. Use `linear`."
            raise InputError(message, factor.place)
        names = [name for name in reads(factor.factor) if name not in (own or {})]
        return factor.factor(**{name: self.get(factor.source(name), factor) for name in names}, **(own or {}))
