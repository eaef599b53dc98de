r"""Mechanical folds: where gaps that are in equilibrium together lose it.

With the driving traction :math:`r_i` of each gap :math:`g_i` that has neither mass nor damper, the stiffness is
:math:`A_{ij} = -\partial r_i/\partial g_j`, of which gaps that share a potential have off-diagonal parts: shear softens
what is opened. In perfect contact or with a capacity of its own the interface keeps its heat, and the stiffness is
isentropic, :math:`A_{ij} = -\partial r_i/\partial g_j - \partial r_i/\partial T\, T \Psi_{T g_j} / C`.
Equilibrium is stable while det A > 0; where all gaps but one are eliminated this is the Schur complement of that one.
"""

from __future__ import annotations

from collections.abc import Sequence

import symengine

from surfacechem.assembly.build import Build
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, absolute, depends, derivative, where
from surfacechem.transitions import Equilibrium, Fold, Transition

FOLD = 1e-7
"""Tangent stiffness, relative to its parts, at which a quasi-static gap counts as having lost its equilibrium."""

Matrix = Sequence[Sequence[Expression]]


def folds(build: Build) -> None:
    """The transition where the gaps in equilibrium lose it, and what tells which way they run."""
    gaps = {symengine.Symbol(e.state) for e in build.equilibria}
    if not gaps:
        return
    A = [[_stiffness(build, i, j) for j in build.equilibria] for i in build.equilibria]
    sizes = [e.active * _size(build, e, A[i][i]) + 1 - e.active for i, e in enumerate(build.equilibria)]
    relative = tuple(tuple(entry / size for entry in row) for row, size in zip(A, sizes, strict=True))
    tangent = determinant(relative)
    moved = {symengine.Symbol(name) for e in build.equilibria for name in e.along} | gaps
    if symengine.Symbol("g_n") not in gaps and not tangent.free_symbols & moved:
        return
    whole = determinant(A)
    falls = tuple(-_along(whole, e) for e in build.equilibria)
    warming = tuple(_rise(build, e) for e in build.equilibria)
    build.transitions.append(
        Transition(
            "snap",
            _bounded(tangent - FOLD),
            "the quasi-static equilibrium of the gap was lost (mechanical fold)",
            settles=True,
            sinks="snap",
            fold=Fold(tangent, falls, relative, warming, str(_temperature(build))),
        )
    )


def _bounded(x: Expression) -> Expression:
    """The same zero with sizes up to 1: what is far stiffer at first must not drown what is left later."""
    return x / (1 + absolute(x))


def _along(expression: Expression, e: Equilibrium) -> Expression:
    """Derivative along a gap and what moves with it."""
    slope = derivative(expression, symengine.Symbol(e.state))
    return slope + sum((w * derivative(expression, symengine.Symbol(x)) for x, w in e.along.items()), 0)


def _stiffness(build: Build, i: Equilibrium, j: Equilibrium) -> Expression:
    """Fall of the traction that drives one gap as another one opens; one where the gap is held."""
    residual = build.expanded(i.residual)
    fall = -_along(residual, j) - _thermal(build, residual, j)
    same = symengine.Integer(1 if i is j else 0)
    return fall if i.active == 1 else i.active * fall + (1 - i.active) * same


def _thermal(build: Build, residual: Expression, j: Equilibrium) -> Expression:
    """What the temperature adds that follows a gap without heat from outside."""
    T = _temperature(build)
    return derivative(residual, T) * _rise(build, j) if T is not None and depends(residual, T) else symengine.Integer(0)


def _temperature(build: Build) -> Expression | None:
    """The temperature of the interface where it follows the gaps."""
    node = build.node_of.get("interface")
    return None if node is None or node.prescribed else node.T


def _rise(build: Build, e: Equilibrium) -> Expression:
    """Rise of the interface temperature along a gap without heat from outside [K/m]."""
    T = _temperature(build)
    coupling = symengine.Integer(0) if T is None else derivative(_along(build.psi, e), T)
    if coupling == 0:
        return symengine.Integer(0)
    node = build.node_of["interface"]
    capacity = node.capacity()
    if capacity == 0:
        raise InputError(
            f"the traction of a quasi-static gap varies with {node.name}, which has no capacity. Give the interface "
            "one, or mount the bodies with a damper or a mass.",
            Place(path="interface.temperature"),
        )
    return T * coupling / capacity


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
