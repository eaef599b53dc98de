r"""Mechanical folds (snap-through): loss of the joint equilibrium of quasi-static gaps.

With the driving traction :math:`r_i` of each gap :math:`g_i` that has neither mass nor damper, the stiffness is
:math:`A_{ij} = -\partial r_i/\partial g_j`. Gaps that share a potential have off-diagonal entries: shear softens an
opened gap. A snap takes no time, so that no heat is conducted away during it: with the temperatures :math:`T_k` the
stiffness is :math:`A_{ij} = -\partial r_i/\partial g_j - \sum_k \partial r_i/\partial T_k\,\partial T_k/\partial g_j`.
The rise of the temperatures follows from the energy balances of their nodes. For elastic motion it is isentropic,
:math:`T \Psi_{T g_j} / C`; for sliding it is the heat of friction, so that friction that falls with temperature loses
its balance with a spring that is softer than this fall. Equilibrium is stable while det A > 0; with all gaps but one
eliminated this is the Schur complement of that gap.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import symengine

from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, absolute, depends, derivative, where
from surfacechem.model.automaton import FOLD_STIFFNESS, Constraint, Edge, Equilibrium, Fold
from surfacechem.model.balances import Node
from surfacechem.model.build import Build

Rise = Mapping[Any, Expression]
"""Rise of temperatures along a gap [K/m]."""

Matrix = Sequence[Sequence[Expression]]


def jumps(build: Build) -> Iterator[Constraint]:
    """Yield the edge at which quasi-static gaps lose their equilibrium, with the data for the direction of the snap."""
    gaps = build.equilibria
    if not gaps:
        return
    residuals = [build.expanded(gap.residual) for gap in gaps]
    rises = [_rises(build, gap, residuals) for gap in gaps]
    A = _tangent(gaps, residuals, rises)
    relative = _relative(build, A)
    tangent, whole = determinant(relative), determinant(A)
    moved = {symengine.Symbol(x) for gap in gaps for x in (gap.state, *gap.coupled)}.union(*rises)
    if all(gap.state != "g_n" for gap in gaps) and not tangent.free_symbols & moved:
        return  # a constant stiffness cannot vanish
    falling = tuple(-_along(whole, gap, rise) for gap, rise in zip(gaps, rises, strict=True))
    warming = tuple({str(T): slope for T, slope in rise.items()} for rise in rises)
    # Same zero, bounded by 1: a guard is resolved relative to its largest value, and the stiffness may fall by decades.
    left = tangent - FOLD_STIFFNESS
    snap = Edge(
        "snap",
        left / (1 + absolute(left)),
        "the quasi-static equilibrium of the gap was lost (mechanical fold)",
        equilibrates=True,
        heat="snap",
        fold=Fold(tangent, falling, relative, warming),
    )
    yield Constraint(edges=(snap,))


def _tangent(gaps: Sequence[Equilibrium], residuals: Sequence[Expression], rises: Sequence[Rise]) -> Matrix:
    """Return the stiffness matrix: decrease of the driving traction of a gap as another opens; one for a held gap."""
    A = []
    for i, (gap, residual) in enumerate(zip(gaps, residuals, strict=True)):
        row = [-_along(residual, other, rise) for other, rise in zip(gaps, rises, strict=True)]
        if gap.active != 1:
            row = [gap.active * x + (1 - gap.active) * int(i == j) for j, x in enumerate(row)]
        A.append(row)
    return A


def _relative(build: Build, A: Matrix) -> tuple[tuple[Expression, ...], ...]:
    """Return the stiffness matrix, each row divided by the reference stiffness of its gap unless that is held."""
    sizes = [gap.active * _size(build, gap, A[i][i]) + 1 - gap.active for i, gap in enumerate(build.equilibria)]
    return tuple(tuple(entry / size for entry in row) for row, size in zip(A, sizes, strict=True))


def _along(expression: Expression, gap: Equilibrium, rise: Rise) -> Expression:
    """Return the derivative along a gap, including the gaps that move with it and the temperatures that follow."""
    moving = {gap.state: symengine.Integer(1), **gap.coupled}
    slope = sum((w * derivative(expression, symengine.Symbol(x)) for x, w in moving.items()), symengine.Integer(0))
    return slope + sum((warmer * derivative(expression, T) for T, warmer in rise.items()), 0)


def _rises(build: Build, gap: Equilibrium, residuals: Sequence[Expression]) -> Rise:
    """Return the rise of the temperatures that tractions depend on along a gap, by the heat of its motion [K/m].

    It follows from the energy balances for a motion that is faster than heat conduction.
    """
    free = build.thermal.free
    nodes = _coupled_nodes(build, residuals)
    motion = {symengine.Symbol(f"d{x}_dt"): w for x, w in ((gap.state, symengine.Integer(1)), *gap.coupled.items())}
    rest = {state.dot: symengine.Integer(0) for state in build.states}
    rows = {node.name: build.expanded(build.energy_row(node)) for node in free}
    heats = {
        name: -sum((w * derivative(row, dot) for dot, w in motion.items()), symengine.Integer(0))
        for name, row in rows.items()
    }
    # A node without capacity passes its heat on.
    passing = {x.T: heats[x.name] / derivative(rows[x.name], x.T).subs(rest) for x in free if x.capacity() == 0}
    rises = {}
    for node in nodes:
        passed = sum((derivative(rows[node.name], T).subs(rest) * warmer for T, warmer in passing.items()), 0)
        heat = heats[node.name] - passed
        if heat != 0:
            rises[node.T] = heat / node.capacity()
    return rises


def _coupled_nodes(build: Build, residuals: Sequence[Expression]) -> list[Node]:
    """Return the nodes on whose temperatures the balances of tractions depend."""
    nodes = [node for node in build.thermal.free if any(depends(residual, node.T) for residual in residuals)]
    for node in nodes:
        if node.capacity() == 0:
            problem = f"the traction of a quasi-static gap varies with {node.name}, which has no capacity"
            remedy = "Give the interface one, or mount the bodies with a damper or a mass."
            raise InputError(f"{problem}. {remedy}", Place(path="interface.temperature"))
    return nodes


def _size(build: Build, gap: Equilibrium, own: Expression) -> Expression:
    """Return the reference stiffness of a gap, to which its stiffness is related [Pa/m]."""
    far = build.motion.far_fields.get(gap.axis)
    if far is not None and far.law.k != 0:
        return far.law.k + absolute(far.law.k - own)
    # No secant, traction over gap: at zero load, or where the gap closes, it is a quotient of roundoff.
    size = _uncancelled(own)
    return where(size > 0, size, 1)


def _uncancelled(e: Expression) -> Expression:
    """Return an expression with each term of its sums by its magnitude, so that none cancel."""
    if e.is_Add or e.is_Mul:
        return e.func(*(_uncancelled(part) for part in e.args))
    if isinstance(e, symengine.Piecewise):
        sides = [_uncancelled(side) for side in e.args[::2]]
        return symengine.Piecewise(*zip(sides, e.args[1::2], strict=True))
    return absolute(e)


def determinant(A: Matrix) -> Expression:
    """Determinant, expanded by the first row; there are three gaps at most.

    >>> determinant([[2, 1, 0], [1, 3, 0], [5, 5, 4]])
    20
    """
    if len(A) == 1:
        return A[0][0]
    terms = (
        (-1) ** j * entry * determinant([[*row[:j], *row[j + 1 :]] for row in A[1:]]) for j, entry in enumerate(A[0])
    )
    return sum(terms, symengine.Integer(0))
