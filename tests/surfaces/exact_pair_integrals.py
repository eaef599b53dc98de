"""Integrals of r^-6 over pairs of surfaces to 20 digits, with mpmath at 30.

python tests/surfaces/exact_pair_integrals.py

writes exact_pair_integrals.json beside this file. Two of the four directions have antiderivatives, along an axis with
no end and across plates; the trapezium rule on circles and Gauss's rule do the rest, and two numbers of points agree.
"""

import itertools
import json
from pathlib import Path

import mpmath
from mpmath import mpf

TARGET = Path(__file__).with_suffix(".json")
DIGITS = 20


def near():
    """The gap, over the radius of the smaller cylinder."""
    return mpf(3) / 10


def circles(integrand, n):
    """Trapezium rule over two circles, of an integrand that is even in both angles."""
    cosines = [mpmath.cos(mpmath.pi * k / n) for k in range(n + 1)]
    weights = [mpf(1 if k in (0, n) else 2) for k in range(n + 1)]
    pairs = itertools.product(zip(cosines, weights, strict=True), repeat=2)
    return (mpmath.pi / n) ** 2 * mpmath.fsum(a * b * integrand(x, y) for (x, a), (y, b) in pairs)


def parallel_cylinders(n):
    """Per length: along a line r^-6 gives 3 pi / (8 a^5); not even in each angle, so that both have a whole turn."""
    d, R_1, R_2 = near(), 1, 2
    angles = [2 * mpmath.pi * k / n for k in range(n)]
    points = [[(R * mpmath.sin(t), R * mpmath.cos(t)) for t in angles] for R in (R_1, R_2)]
    c = R_1 + R_2 + d
    half = [(p, 1 if k in (0, n // 2) else 2) for k, p in enumerate(points[0]) if k <= n // 2]
    sums = (w * ((a - x) ** 2 + (c - b - y) ** 2) ** mpf(-2.5) for ((a, b), w) in half for x, y in points[1])
    return 3 * mpmath.pi / 8 * (2 * mpmath.pi / n) ** 2 * R_1 * R_2 * mpmath.fsum(sums)


def crossed_cylinders(n):
    """Over a plane at the distance h r^-6 gives pi / (2 h^4), along both axes at once."""
    d, R_1, R_2 = near(), 1, 2
    return R_1 * R_2 * circles(lambda x, y: mpmath.pi / 2 / (d + R_1 * (1 - x) + R_2 * (1 - y)) ** 4, n)


def tilted_plates(degree):
    """1 by 0.7 below 0.8 by 1: across both, (rho^2 + y^2)^-3 has a second antiderivative."""
    d, tilt = 2 * near(), mpf(1) / 5

    def across(rho, y):
        return -1 / (8 * rho**2 * (rho**2 + y**2)) + 3 * y / (8 * rho**5) * mpmath.atan(y / rho)

    def integrand(u, a):
        rho = mpmath.hypot(u - mpmath.cos(tilt) * a, d + mpmath.sin(tilt) * a)
        return 2 * (across(rho, mpf("0.85")) - across(rho, mpf("0.15")))

    ends = [-mpf("0.5"), mpf("0.5")], [-mpf("0.4"), mpf("0.4")]
    return mpmath.quad(integrand, *ends, method="gauss-legendre", maxdegree=degree)


def main():
    """Write what two numbers of points agree on."""
    found = {}
    for form, counts in ((parallel_cylinders, (400, 480)), (crossed_cylinders, (150, 200)), (tilted_plates, (5, 6))):
        few, many = (form(n) for n in counts)
        assert abs(few / many - 1) < mpf(10) ** -DIGITS, form
        found[form.__name__] = mpmath.nstr(many, DIGITS, strip_zeros=False)
    TARGET.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    # Here alone, as the digits are those of all that uses the library in a process.
    with mpmath.workdps(30):
        main()
