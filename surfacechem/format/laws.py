"""From ``name: {parameters}`` to a law: its class is found by name, its fields say what the parameters are."""

from __future__ import annotations

import dataclasses
import re
import typing
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from surfacechem import laws
from surfacechem.contracts.terms import Factor, Law, Load, Spec, Varying, resolved_unit
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError
from surfacechem.format.csvtable import is_csv, table
from surfacechem.format.fields import choice, items, mapping, number, shown, text
from surfacechem.units import quotient

L = TypeVar("L", bound=Law)
Units = Mapping[str, str]
"""Unit of each variable that the case has."""

MOST = 500
"""Laws of a list. Each may be the same law again, whose names are numbered up to a thousand."""

DIFFERENCES = ("amplitude",)
"""Fields that are a change of their variable, so that degrees Celsius have no meaning for them."""


def law_list(contract: type[L], tree: Tree | None, units: Units) -> tuple[L, ...]:
    """The laws of a list."""
    found = items(tree, partial(_example, contract))
    if len(found) > MOST:
        raise found[MOST].error(f"more than {MOST} laws in a list.")
    return tuple(law(contract, item, units) for item in found)


def law(contract: type[L], item: Tree, units: Units, x: str = "") -> L:
    """The law ``name: {parameters}``, or ``name`` alone; ``x`` is the unit that "[x]" stands for."""
    if isinstance(item.value, dict) and len(item.value) == 1:
        ((name, fields),) = item.value.items()
    elif isinstance(item.value, str) and item.value:
        name, fields = item.value, Tree(None, item.place)
    else:
        raise item.error(f"a law is `name: {{parameters}}`, not {shown(item)}.")
    try:
        found = laws.find(contract, name)
    except InputError as error:
        raise error.at(item.place) from None
    return build(typing.cast(type[L], found), fields, units, x)


def build(kind: type[L], tree: Tree, units: Units, x: str = "", fields: Mapping[str, Tree] | None = None) -> L:
    """A law of a known class from the mapping of its parameters, or from some of its ``fields``."""
    specs, options = dict(kind.specs()), dict(kind.options())
    given = mapping(tree, [*specs, *options]) if fields is None else dict(fields)
    _check_complete(kind, given, tree)
    values: dict[str, Any] = {name: _option(kind, name, given[name], x) for name in options if name in given}
    if issubclass(kind, Factor):
        x = _unit_of(values.get("of", _default(kind, "of")), given.get("of", tree), units)
    for name, spec in specs.items():
        if name in given:
            values[name] = _parameter(given[name], name, spec.resolved(x), units)
    try:
        return kind(**values, place=tree.place)
    except InputError as error:
        raise error.at(tree.place) from None


def history(tree: Tree, unit: str, units: Units) -> Load:
    """A prescribed history; a bare value is a constant."""
    if is_csv(tree):
        return table(tree, unit)
    if isinstance(tree.value, dict):
        return law(Load, tree, units, unit)  # type: ignore[type-abstract]
    hold: Any = laws.find(Load, "hold")
    name = tree.place.path.rpartition(".")[2]
    constant: Load = hold(level=_level(tree, unit, name), place=tree.place)
    return constant


def _level(tree: Tree, unit: str, name: str) -> float:
    """A constant value; who gives a rate means a ramp."""
    try:
        return number(tree, unit, name)
    except InputError as error:
        if not _is_rate(tree, unit):
            raise
        hint = f"To change it in time, write `{{ramp: {{rate: {tree.value}}}}}`."
        raise InputError(f"{error.message} {hint}", tree.place) from None


def _is_rate(tree: Tree, unit: str) -> bool:
    with suppress(InputError):
        number(tree, quotient(unit, "s"), "rate")
        return True
    return False


def _check_complete(kind: type[Law], given: Mapping[str, Tree], tree: Tree) -> None:
    meanings = {name: f"{spec.text} [{spec.unit}]" for name, spec in kind.specs()} | dict(kind.options())
    for name, meaning in meanings.items():
        if name not in given and _default(kind, name) is dataclasses.MISSING:
            raise tree.error(f"{kind.name()} needs `{name}`: {meaning}.")


def _default(kind: type[Law], name: str) -> Any:
    return next(item.default for item in dataclasses.fields(kind) if item.name == name)


def _unit_of(name: str, tree: Tree, units: Units) -> str:
    return units[choice(dataclasses.replace(tree, value=name), "variable", units)]


def _parameter(tree: Tree, name: str, spec: Spec, units: Units) -> float | Varying:
    if not (isinstance(tree.value, dict) and "value" in tree.value):
        return number(tree, spec.unit, name, spec, difference=name in DIFFERENCES)
    if not spec.varies:
        raise tree.error(f"{name} cannot vary; give it a value.")
    parts = mapping(tree, ["value", "times"])
    value = number(parts["value"], spec.unit, name, spec)
    if "times" not in parts:
        return value
    return Varying(value, law_list(Factor, parts["times"], units))


def _option(kind: type[Law], name: str, tree: Tree, x: str) -> Any:
    """A structural field, by the type that its class declares."""
    declared = typing.get_type_hints(kind)[name]
    origin, arguments = typing.get_origin(declared), typing.get_args(declared)
    if declared is str:
        return text(tree, name)
    if origin is typing.Literal:
        return choice(tree, name, arguments)
    if origin is tuple and Ellipsis not in arguments:
        entries = items(tree)
        if len(entries) != len(arguments):
            raise tree.error(f"{name} needs {len(arguments)} entries, got {len(entries)}.")
        return tuple(text(entry, name) for entry in entries)
    if origin is not None and float in arguments:
        return _numbers(tree, name, resolved_unit(_bracketed(dict(kind.options())[name]), x))
    return tree.plain()


def _numbers(tree: Tree, name: str, unit: str) -> Sequence[float]:
    return tuple(number(entry, unit, name) for entry in items(tree))


def _bracketed(meaning: str) -> str:
    """The unit at the end of a meaning.

    >>> _bracketed("values at the times [x]"), _bracketed("orders")
    ('[x]', '1')
    """
    found = re.search(r"(\[[^\]]*\])$", meaning)
    return "1" if not found else found[1] if found[1] == "[x]" else found[1][1:-1]


def _example(contract: type[Law]) -> str:
    kind = next(iter(laws.laws(contract).values()))
    fields = ", ".join(f"{name}: ..." for name in (*dict(kind.options()), *dict(kind.specs())))
    return f"- {kind.name()}: {{{fields}}}"
