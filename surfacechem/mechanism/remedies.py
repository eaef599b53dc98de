"""What Cantera knows and the compiled path does not, with the way out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from surfacechem.mechanism.rate_types import kind_of
from surfacechem.mechanism.source import sides

LEAVE = "With `solver: cantera` under `run` Cantera evaluates it."
"""The way out for what is not lowered."""

BESIDE = f"the compiled path knows surface species only. {LEAVE[:-1]}, with the neighbours held as the case says."
"""The way out for what needs phases beside the surface."""

REMEDIES = {
    "adjacent-phases": f"gas and bulk neighbours: {BESIDE}",
    "reference-state-coverage": "it belongs to `thermo: coverage-dependent-surface`.",
    "sticking-coefficient": f"a sticking reaction needs a gas: {BESIDE}",
    "Motz-Wise": f"this correction is for sticking reactions, which need a gas: {BESIDE}",
    "sticking-species": f"a sticking reaction needs a gas: {BESIDE}",
    "sticking-order": f"a sticking reaction needs a gas: {BESIDE}",
    "beta": f"charge transfer needs a neighbour at an electric potential: {BESIDE}",
    "exchange-current-density-formulation": f"charge transfer needs a neighbour at an electric potential: {BESIDE}",
    "efficiencies": "third bodies belong to gases; remove it.",
    "default-efficiency": "third bodies belong to gases; remove it.",
    "explicit-third-body-duplicates": "third bodies belong to gases; remove it.",
    "skip-undeclared-elements": "species would vanish without a word; write down their elements instead.",
    "skip-undeclared-third-bodies": "third bodies belong to gases; remove it.",
    "negative-A": "a negative rate goes on where nothing is left to react; use a positive `A`.",
    "equation-of-state": "a surface species has no volume; remove it.",
    "critical-parameters": "a surface species has no critical point; remove it.",
}
"""Keys, with the way out."""

MODELS = {
    "edge": "a contact line has rates per length, and a scene has an area; write the reactions on a surface.",
}
"""Phase models that are not plain surfaces, with the way out."""

KINDS = {
    "sticking": f"a sticking reaction needs a gas beside the surface: {BESIDE}",
    "electrochemical": f"charge transfer needs a neighbour at an electric potential: {BESIDE}",
}
"""Rate types, by how they begin, of surfaces with neighbours, with the way out."""

PRESSURE = ("three-body", "falloff", "chemically-activated", "pressure-dependent-Arrhenius", "Chebyshev")
"""Rate types of gases."""

STICKING: Mapping[str, tuple[str, ...]] = {
    "sticking-coefficient": ("A", "b", "Ea"),
    "Motz-Wise": (),
    "sticking-species": (),
    "sticking-order": (),
}
"""Keys of sticking reactions, with the keys inside."""

CHARGED: Mapping[str, tuple[str, ...]] = {"beta": (), "exchange-current-density-formulation": ()}
"""Keys of reactions that carry charge from one phase to another."""


def needs_neighbour(kind: str) -> str:
    """Why a rate type needs a neighbour, and the way out; empty where it needs none."""
    return next((text for start, text in KINDS.items() if kind.removeprefix("interface-").startswith(start)), "")


def is_foreign(entry: Any) -> bool:
    """Whether a reaction is of a type that is not known here, but may be one of Cantera's or of another extension."""
    kind = str(entry.get("type", "Arrhenius"))
    return "equation" in entry and kind_of(kind) is None and kind not in PRESSURE and not needs_neighbour(kind)


def is_evaluated(entry: Any, names: Iterable[str], beside: bool) -> bool:
    """Whether only Cantera can say how fast a reaction is; ``beside`` tells whether the surface has neighbours.

    ``names`` are the species of the surface.
    """
    if "equation" not in entry:
        return False
    reactants, products, _ = sides(str(entry["equation"]))
    outside = beside and not {*reactants, *products, *(entry.get("orders") or {})} <= set(names)
    special = any(key in entry for key in (*STICKING, *CHARGED))
    return outside or special or is_foreign(entry) or bool(needs_neighbour(str(entry.get("type", ""))))
