r"""Mechanical folds: where gaps that are in equilibrium together lose it.

With the driving traction :math:`r_i` of each gap :math:`g_i` that has neither mass nor damper, the stiffness is
:math:`A_{ij} = -\partial r_i/\partial g_j`, of which gaps that share a potential have off-diagonal parts: shear softens
what is opened. A gap that runs away takes no time, so that what it warms keeps its heat: with the temperatures
:math:`T_k` the stiffness is :math:`A_{ij} = -\partial r_i/\partial g_j - \sum_k \partial r_i/\partial T_k\,
\partial T_k/\partial g_j`. The rise of the temperatures follows from the energy balances of their nodes. That of what
is elastic is isentropic, :math:`T \Psi_{T g_j} / C`; that of what slides is the heat of its friction, so that friction
that falls with temperature loses its balance with a spring that is softer than this fall.
Equilibrium is stable while det A > 0; where all gaps but one are eliminated this is the Schur complement of that one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import symengine

from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, absolute, depends, derivative, where
from surfacechem.model.automaton import FOLD, Constraint, Edge, Equilibrium, Fold
from surfacechem.model.balances import Node
from surfacechem.model.build import Build

Rise = Mapping[Any, Expression]
"""Rise of temperatures along a gap [K/m]."""

Matrix = Sequence[Sequence[Expression]]


def jumps(build: Build) -> Iterator[Constraint]:
    """The edge where the gaps in equilibrium lose it, and what tells which way they run."""
    if not build.equilibria:
        return
    residuals = [build.expanded(e.residual) for e in build.equilibria]
    rises = [_rises(build, e, residuals) for e in build.equilibria]
    pairs = list(zip(build.equilibria, rises, strict=True))
    A = _tangent(build.equilibria, residuals, rises)
    relative = _relative(build, A)
    tangent = determinant(relative)
    names = {name for e in build.equilibria for name in (e.state, *e.along)}
    moved = set(map(symengine.Symbol, names)).union(*rises)
    if all(e.state != "g_n" for e in build.equilibria) and not tangent.free_symbols & moved:
        return  # a stiffness that does not change stays what it is
    whole = determinant(A)
    falling = tuple(-_along(whole, e, rise) for e, rise in pairs)
    warming = tuple({str(T): slope for T, slope in rise.items()} for rise in rises)
    # The same zero with sizes up to 1: what is far stiffer at first must not drown what is left later.
    left = tangent - FOLD
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
    """Fall of the traction that drives one gap as another one opens; one where the gap is held."""
    A = []
    for i, residual in zip(gaps, residuals, strict=True):
        falls = [-_along(residual, j, rise) for j, rise in zip(gaps, rises, strict=True)]
        held = [symengine.Integer(int(i is j)) for j in gaps]
        A.append([x if i.active == 1 else i.active * x + (1 - i.active) * y for x, y in zip(falls, held, strict=True)])
    return A


def _along(expression: Expression, e: Equilibrium, rise: Rise) -> Expression:
    """Derivative along a gap, what moves with it, and the temperatures that follow."""
    slope = derivative(expression, symengine.Symbol(e.state))
    slope += sum((w * derivative(expression, symengine.Symbol(x)) for x, w in e.along.items()), 0)
    return slope + sum((warmer * derivative(expression, T) for T, warmer in rise.items()), 0)


def _relative(build: Build, A: Matrix) -> tuple[tuple[Expression, ...], ...]:
    """The stiffness of each gap in parts of what it is compared with, where it is not held."""
    sizes = [e.active * _size(build, e, A[i][i]) + 1 - e.active for i, e in enumerate(build.equilibria)]
    return tuple(tuple(entry / size for entry in row) for row, size in zip(A, sizes, strict=True))


def _rises(build: Build, e: Equilibrium, residuals: Sequence[Expression]) -> Rise:
    """Rise of the temperatures that the balances of tractions feel along a gap, by the heat of its own motion [K/m].

    It is what the energy balances say of motion that is faster than any flow of heat.
    """
    free = build.thermal.free
    felt = [node for node in free if any(depends(residual, node.T) for residual in residuals)]
    _refuse_no_capacity(felt)
    motion = {symengine.Symbol(f"d{x}_dt"): w for x, w in ((e.state, symengine.Integer(1)), *e.along.items())}
    rest = {state.dot: symengine.Integer(0) for state in build.states}
    rows = {node.name: build.expanded(build.energy_row(node)) for node in free}

    def made(row: Expression) -> Expression:
        return -sum((w * derivative(row, dot) for dot, w in motion.items()), symengine.Integer(0))

    # A node that stores nothing passes on what it gets.
    passing = {x.T: made(rows[x.name]) / derivative(rows[x.name], x.T).subs(rest) for x in free if x.capacity() == 0}
    rises = {}
    for node in felt:
        passed = sum((derivative(rows[node.name], T).subs(rest) * warmer for T, warmer in passing.items()), 0)
        heat = made(rows[node.name]) - passed
        if heat != 0:
            rises[node.T] = heat / node.capacity()
    return rises


def _refuse_no_capacity(felt: Sequence[Node]) -> None:
    for node in felt:
        if node.capacity() == 0:
            raise InputError(
                f"the traction of a quasi-static gap varies with {node.name}, which has no capacity. Give the "
                "interface one, or mount the bodies with a damper or a mass.",
                Place(path="interface.temperature"),
            )


def _size(build: Build, e: Equilibrium, own: Expression) -> Expression:
    """What the stiffness of a gap is compared with [Pa/m]."""
    far = build.motion.far_fields.get(e.state.partition("_")[2])
    if far is not None and far.k != 0:
        return far.k + absolute(far.k - own)
    g = absolute(symengine.Symbol(e.state))
    if far is None:
        return where(g > 0, build.expanded(e.size) / g, 1)
    # Of what holds the gap itself: friction beside it has no stiffness.
    t = build.expanded(derivative(build.psi, symengine.Symbol(e.state)))
    t = t if t != 0 else far.F - build.expanded(e.residual)
    secant = t * symengine.Symbol(e.state)
    return where(secant > 0, secant / g**2, where(absolute(own) > 0, absolute(own), 1))


def determinant(A: Matrix) -> Expression:
    """By the first row; there are three gaps at most.

    >>> determinant([[2, 1, 0], [1, 3, 0], [5, 5, 4]])
    20
    """
    if len(A) == 1:
        return A[0][0]
    terms = (
        (-1) ** j * entry * determinant([[*row[:j], *row[j + 1 :]] for row in A[1:]]) for j, entry in enumerate(A[0])
    )
    return sum(terms, symengine.Integer(0))
