"""Root finding in an interval, in Python: importing SciPy's takes a quarter of a second, as long as most runs."""

from collections.abc import Callable

from surfacechem.tolerances import FEW_EPS, TINY


def zero(value: Callable[[float], float], ends: tuple[float, float], at_ends: tuple[float, float]) -> float:
    """Return a zero of a function of one variable by bracketing, to the last digits of the argument.

    Each step is by inverse quadratic interpolation where that is monotone, else by bisection.

    Parameters
    ----------
    value
        The function; NaN counts as negative.
    ends, at_ends
        Two arguments, in any order, and the values there, of different signs.

    Returns
    -------
    float
        The zero. Source: Chandrupatla (1997), Advances in Engineering Software 28, 145-149.

    Examples
    --------
    >>> zero(lambda x: x * x - 2, (0.0, 2.0), (-2.0, 2.0))
    1.4142135623730954
    """
    (b, a), (at_b, at_a), part = ends, at_ends, 0.5
    if 0.0 in at_ends:
        return ends[at_ends.index(0.0)]
    while True:
        x = a + part * (b - a)
        at_x = value(x)
        if (at_x > 0) == (at_a > 0):
            c, at_c = a, at_a
        else:
            c, at_c, b, at_b = b, at_b, a, at_a
        a, at_a = x, at_x
        best = b if abs(at_b) < abs(at_a) else a
        closest = FEW_EPS * abs(best) + TINY
        if at_x == 0.0 or abs(b - a) <= 2 * closest:
            return best
        xi, phi = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        if phi * phi < xi and (1 - phi) ** 2 < 1 - xi:
            part = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            part += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
        else:
            part = 0.5
        least = closest / abs(b - a)
        part = min(1 - least, max(least, part))
