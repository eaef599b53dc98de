"""Reading values off a document: strict keys, texts, numbers, lists. Every error has its place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

from surfacechem.contracts.terms import Spec
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, suggestion
from surfacechem.units import parse


def mapping(tree: Tree | None, known: Iterable[str] | None = None, what: str = "keys") -> dict[str, Tree]:
    """The entries of a mapping, which may be empty; InputError for keys that are not known."""
    if tree is None or tree.value is None:
        return {}
    if not isinstance(tree.value, dict):
        wanted = f" with the {what} {', '.join(known)}" if known is not None else ""
        raise tree.error(f"this must be a mapping{wanted}, not {shown(tree)}.")
    if known is not None:
        allowed = list(known)
        for key, child in tree.value.items():
            if key not in allowed:
                place = replace(child.place, path=tree.place.path)
                raise InputError(f"unknown key '{key}'.{suggestion(key, allowed)}", place)
    return dict(tree.value)


def items(tree: Tree | None, example: str | Callable[[], str] = "") -> list[Tree]:
    """The items of a list, which may be empty; the example is asked for where there is no list."""
    if tree is None or tree.value is None:
        return []
    if not isinstance(tree.value, list):
        shape = example if isinstance(example, str) else example()
        hint = f", for example `{shape}`" if shape else ""
        raise tree.error(f"this must be a list{hint}, not {shown(tree)}.")
    return list(tree.value)


def text(tree: Tree, what: str) -> str:
    """A text."""
    if not isinstance(tree.value, str) or not tree.value.strip():
        raise tree.error(f"{what} must be a text, not {shown(tree)}.")
    return tree.value


def choice(tree: Tree, what: str, known: Iterable[str]) -> str:
    """One of some names."""
    options, name = list(known), str(tree.value)
    if not isinstance(tree.value, str) or name not in options:
        raise tree.error(f"no {what} {shown(tree)}.{suggestion(name, options)}")
    return name


def number(tree: Tree, unit: str, name: str, spec: Spec | None = None, *, difference: bool = False) -> float:
    """A number in SI, in the range of its specification."""
    value = parse(tree.value if _is_leaf(tree) else tree.plain(), unit, tree.place, name, difference=difference)
    if spec is not None:
        check(tree, spec, name, value)
    return value


def check(tree: Tree, spec: Spec, name: str, value: float) -> None:
    """Raise the error of a value out of range at its place."""
    try:
        spec.check(name, value)
    except InputError as error:
        raise error.at(tree.place) from None


def whole(tree: Tree, name: str, at_least: int, at_most: float = math.inf) -> int:
    """A whole number in a range."""
    value = number(tree, "1", name, Spec("1", name, at_least=at_least, at_most=at_most))
    if not value.is_integer():
        raise tree.error(f"{name} must be a whole number, got {value:g}.")
    return int(value)


def shown(tree: Tree) -> str:
    """A value as it stands in a message."""
    kinds = {dict: "a mapping", list: "a list", type(None): "nothing", bool: str(tree.value).lower()}
    return kinds.get(type(tree.value)) or f"'{str(tree.value)[:40]}'"


def _is_leaf(tree: Tree) -> bool:
    return not isinstance(tree.value, dict | list)
