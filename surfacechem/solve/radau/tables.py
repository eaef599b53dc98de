"""Radau IIA coefficients for 3, 5 and 7 stages, and the tables and settings derived from them.

coefficients.json contains those rounded from 60 digits: the nodes c are the zeros of P_{s-1} - P_s shifted to (0, 1]; A
is the collocation matrix; A^-1 = T diag(lambda) T^-1 has one real eigenvalue and (s-1)/2 complex pairs, of which only
the member with positive imaginary part is stored. -T^-1 and T are real tables: a row, or a column, of the real
eigenvector, then two of each pair, real and imaginary part (T has the factor 2 of the conjugate, and -Im).
Tables are padded to seven stages; the first index is the family member k = (s - 3) / 2.

Source: Hairer & Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.radau.stepper import SCAN_POINTS

STAGES = (3, 5, 7)

SCAN_EDGE = 1e-6
"""Distance from the ends of a step, as a part of it, of the points that determine the slopes of margins there."""
MEMBER_RTOLS = (2e-5, 3e-12)
"""Relative tolerances above which 3 and 5 stages are the most efficient, measured on Robertson's and other problems."""
COARSE_RTOL = 3e-6
"""Tolerance above which a single Newton correction is not trusted: its Jacobian may have missed a thinner layer."""

_GIVEN = json.loads(Path(__file__).with_name("coefficients.json").read_text(encoding="utf-8"))


def _padded(name: str, *shape: int) -> NDArray[np.float64]:
    """Return the tables of this name, each padded with zeros to this shape."""
    table = np.zeros((len(_GIVEN[name]), *shape))
    for row, given in zip(table, map(np.array, _GIVEN[name]), strict=True):
        row[tuple(map(slice, given.shape))] = given
    return table


GAMMA = np.array(_GIVEN["GAMMA"])
"""The real eigenvalue of A^-1."""
NODES = _padded("NODES", 7)
COLLOCATION, INVERSE = _padded("COLLOCATION", 7, 7), _padded("INVERSE", 7, 7)
PAIR_VALUES = _padded("PAIR_VALUES_REAL", 3) + 1j * _padded("PAIR_VALUES_IMAG", 3)
TO_PARTS, FROM_PARTS = _padded("TO_PARTS", 7, 7), _padded("FROM_PARTS", 7, 7)
"""From residuals to the right-hand sides of the decoupled systems, and from their solutions to the stages."""

LAST_STAGE, STAGES_OF_DENSE = 15, 13
"""Of the explicit method: the last row of its rates, and the number of rows before those that only its dense output
needs.
"""
EXPLICIT_NODES = np.array(_GIVEN["EXPLICIT_NODES"])
EXPLICIT = np.pad(_padded("EXPLICIT", LAST_STAGE + 1), ((1, 0), (0, 0)))
"""Coefficients of the stages of the explicit method by the rates of earlier stages; row 12 is the step."""
EXPLICIT_ERRORS = _padded("EXPLICIT_ERRORS", LAST_STAGE + 1)
"""Coefficients of the errors of order 5 and 3."""
_step, _first, _last = EXPLICIT[12], np.eye(LAST_STAGE + 1)[0], np.eye(LAST_STAGE + 1)[12]
_dense = _step, _first - _step, 2.0 * _step - _last - _first, *_padded("EXPLICIT_DENSE", LAST_STAGE + 1)
DENSE_FACTORS = np.array(_dense).T
"""Coefficients of F_0, F_1, ... in the dense output x (F_0 + (1 - x) (F_1 + x (F_2 + (1 - x) (F_3 + ...)))) of an
explicit step, a row for each of its rates; F_0 to F_2 interpolate both ends.
"""


def dense_at(x: Any) -> list[Any]:
    """Return the coefficients of an explicit step's dense output by its rates, at numbers or as polynomials of x."""
    found = []
    for factors in DENSE_FACTORS:
        total = 0.0
        for i, factor in enumerate(factors[::-1]):
            total = (total + factor) * (x if i % 2 == 0 else 1.0 - x)
        found.append(total)
    return found


DENSE = np.array(dense_at(NODES[2])).T


def _lagrange(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1 / (c_j prod_{k != j} (c_j - c_k)), barycentric weights of the nodes 0, c_1, ..., c_s except 0."""
    return np.asarray(1.0 / (nodes * (nodes[:, None] - nodes[None, :] + np.eye(len(nodes))).prod(axis=1)))


def _defect(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients of x, x^2, ... in the integral from 0 to x of prod_i (1 - x / c_i)."""
    product = np.poly1d([1.0])
    for node in nodes:
        product *= np.poly1d([-1.0 / node, 1.0])
    return np.asarray(product.integ().coeffs[::-1][1:])


def _probe(nodes: NDArray[np.float64]) -> np.float64:
    """Return the point at which the interpolation error x prod_i (x - c_i) is largest."""
    x = np.linspace(0.0, 1.0, 1001)
    return np.float64(x[np.argmax(np.abs(x * np.prod(x[:, None] - nodes, axis=1)))])


def _probe_rate(nodes: NDArray[np.float64], x: float) -> NDArray[np.float64]:
    """Return the values at x of the Lagrange polynomials on c_1, ..., c_s and, last of eight, on 0."""
    points = np.append(nodes, 0.0)
    values = [np.prod((x - np.delete(points, i)) / (c - np.delete(points, i))) for i, c in enumerate(points)]
    return np.concatenate([values[:-1], np.zeros(8 - len(points)), values[-1:]])


def _newton(nodes: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a polynomial with these coefficients of x, x^2, ... in Newton's form.

    Its basis is x, x (x - c_1), x (x - c_1)(x - c_2), ..., of which the last of ten factors is x again.
    """
    rest, result = np.poly1d(coefficients[::-1]), np.zeros(9)
    for i, node in enumerate(np.append(nodes, 0.0)):
        rest, remainder = np.polydiv(rest, np.poly1d([1.0, -node]))
        result[i] = remainder[-1] if isinstance(remainder, np.ndarray) else remainder(0.0)
    result[len(nodes) + 1] = np.poly1d(rest)(0.0)
    return result


def _scanned(k: int) -> NDArray[np.float64]:
    """Return fractions of the step, from its start, just inside its end, to its end; more points for higher orders."""
    last = 4 * k + 7
    inside = [SCAN_EDGE, *(np.arange(1, last) / last), 1.0 - SCAN_EDGE, 1.0]
    return np.pad(inside, (0, SCAN_POINTS - len(inside)), constant_values=1.0)


def _scan_table(nodes: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return value and rate at the points, per unit z_j, of the polynomial through (0, 0), (c_j, z_j).

    The last column is the shape of its error.
    """
    table = np.zeros((2, SCAN_POINTS, 8))
    for j, c in enumerate(nodes):
        others = np.append(np.delete(nodes, j), 0.0)
        # Products keep the digits that sums of powers would lose; the end of the step is a node.
        parts = (points[:, None] - others) / (c - others)
        table[0, :, j] = parts.prod(axis=1)
        for i, other in enumerate(others):
            table[1, :, j] += np.delete(parts, i, axis=1).prod(axis=1) / (c - other)
    table[0, :, len(nodes)] = np.polyval(np.append(_defect(nodes)[::-1], 0.0), points)
    table[1, :, len(nodes)] = (1.0 - points[:, None] / nodes).prod(axis=1)
    return table


def _inverse_gaps(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1 / (c_i - c_{i-level}) for divided differences of each level; level 0 divides by c_i."""
    table = np.zeros((7, 7))
    for level in range(len(nodes)):
        for i in range(level, len(nodes)):
            table[level, i] = 1.0 / (nodes[i] - (nodes[i - level] if level else 0.0))
    return table


_members = [NODES[k, :s] for k, s in enumerate(STAGES)]
START_RATE = np.array([np.pad(-_lagrange(c) * np.prod(-c), (0, 7 - len(c))) for c in _members])
"""Values at 0 of the Lagrange polynomials on c_1, ..., c_s: they extrapolate stage rates to the start of the step."""
START_SLOPE = np.array([np.pad(-_lagrange(c) * np.prod(-c) / c, (0, 7 - len(c))) for c in _members])
"""Derivative at 0 of the polynomial through (0, 0), (c_j, z_j): its error is the error estimate of the step."""
INVERSE_GAPS = np.array([_inverse_gaps(c) for c in _members])
NEWTON_NODES = np.array([np.pad(c, (0, 9 - len(c))) for c in _members])
DEFECT = np.array([_newton(c, _defect(c)) for c in _members])
"""Shape of the error of the collocation polynomial, per unit defect of its derivative at 0, in Newton's form."""
PROBE = np.array([_probe(c) for c in _members])
"""Fraction of the step at which the error of an interpolated component is largest."""
PROBE_RATE = np.array([_probe_rate(c, x) for c, x in zip(_members, PROBE, strict=True)])
"""Coefficients that extrapolate the rates of the stages and of the start (last) to the probe."""
# Integrals of x prod_i (x - c_i), scaled to one at the probe, by their coefficients of x, x^2, ...
_products = [np.poly1d(np.append(c, 0.0), r=True) for c in _members]
_shapes = [(product / product(x)).integ().coeffs[::-1][1:] for product, x in zip(_products, PROBE, strict=True)]
PROBE_SHAPE = np.array([_newton(c, shape) for c, shape in zip(_members, _shapes, strict=True)])
"""Shape of a quadrature's error, per unit defect of its rate at the probe, in Newton's form."""
SCANNED = np.array([_scanned(k) for k in range(len(STAGES))])
"""Points of a step at which margins are evaluated."""
_scans = np.array([_scan_table(c, x) for c, x in zip(_members, SCANNED, strict=True)])
SCAN_VALUES, SCAN_RATES = np.ascontiguousarray(_scans[:, 0]), np.ascontiguousarray(_scans[:, 1])
"""State and rate at these points by the stages and, in the last column, the correction of the polynomial."""
