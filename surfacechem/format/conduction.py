"""Conduction across a body, as a case states it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from surfacechem.contracts.terms import Load, Spec
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError
from surfacechem.format.fields import choice, mapping, number, whole
from surfacechem.format.laws import Units, build, history
from surfacechem.scene import MOST_CELLS, Conduction

CONDUCTION_KEYS = ("thickness", "conductivity", "cells", "grading", "far")
FAR_KEYS = ("temperature", "h")
LUMP, INSULATED = "lump", "insulated"

FIRST_CELLS = 16
"""Cells of a body before a run has chosen them."""

ACCURACY = Spec("1", "accuracy", above=0, at_most=0.1)
GRADING = Spec("1", "grading", at_least=1e-6, at_most=1e6)
CONDUCTANCE = Spec("W/(m^2 K)", "conductance at the far side", at_least=0)


def read_conduction(tree: Tree, units: Units, above_zero: Callable[[Load, Tree], Load]) -> Conduction:
    """The section ``conduction`` of a body."""
    fields = mapping(tree, CONDUCTION_KEYS)
    if "cells" not in fields:
        raise tree.error("conduction needs `cells`: a number, {accuracy: 1e-4}, or lump.")
    cells, accuracy = _cells(fields["cells"])
    far, h_far = _far(fields.get("far"), units, above_zero)
    grading = number(fields["grading"], "1", "grading", GRADING) if "grading" in fields else 1.0
    law = build(Conduction, tree, units, fields={k: v for k, v in fields.items() if k in dict(Conduction.specs())})
    return replace(law, cells=cells, accuracy=accuracy, grading=grading, far=far, h_far=h_far)


def _cells(tree: Tree) -> tuple[int, float | None]:
    """Number of cells and the accuracy by which a run chooses them, where it does."""
    if isinstance(tree.value, dict):
        fields = mapping(tree, ["accuracy"])
        if "accuracy" not in fields:
            raise tree.error("give the number of cells, or {accuracy: 1e-4}.")
        return FIRST_CELLS, number(fields["accuracy"], "1", "accuracy", ACCURACY)
    if isinstance(tree.value, str) and not tree.value.isdigit():
        choice(tree, "choice of cells", [LUMP])
        return 0, None
    cells = whole(tree, "cells", 2, MOST_CELLS)
    if cells % 2:
        raise tree.error(f"cells must be even, so that half of them show the error; got {cells}.")
    return cells, None


def _far(tree: Tree | None, units: Units, above_zero: Callable[[Load, Tree], Load]) -> tuple[Load | None, float | None]:
    """Temperature at or beyond the far side, and the conductance to it."""
    if tree is None or tree.value == INSULATED:
        return None, None
    if not isinstance(tree.value, dict):
        text = "the far side is `insulated`, {temperature: 25 degC}, or {temperature: 25 degC, h: 10 W/m^2/K}."
        raise InputError(text, tree.place)
    fields = mapping(tree, FAR_KEYS)
    if "temperature" not in fields:
        raise tree.error("the far side needs a `temperature`.")
    far = above_zero(history(fields["temperature"], "K", units), fields["temperature"])
    return far, number(fields["h"], "W/(m^2 K)", "h", CONDUCTANCE) if "h" in fields else None
