"""Rates far from one per second: tiny prefactors with large exponents, stiff pairs, orders below one.

Every expectation is computed here from the rate laws alone, with SciPy or mpmath, and not by what is tested.
"""

import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg

import surfacechem
from surfacechem.expressions import EXPONENT_CAP

BOLTZMANN, GAS = mpmath.mpf("1.380649e-23"), mpmath.mpf("8.31446261815324")

CAPPED = "the rate goes on along its tangent"

CASE = """
T_0: {T_0} K
bodies: {{one: {{temperature: {T} K}}, two: {{temperature: {T} K}}}}
interface: {{temperature: {T} K, {interface}}}
{more}
run: {{times: {times}, rtol: {rtol}}}
"""


def solve(folder, interface, times, T=300, T_0=300, more="", mechanism=None, rtol=1e-11):
    """A run of a case with bodies held at T; ``mechanism`` is the text of mech.yaml."""
    if mechanism:
        (folder / "mech.yaml").write_text(mechanism)
    text = CASE.format(T=T, T_0=T_0, interface=interface, more=more, times=list(map(float, times)), rtol=rtol)
    (folder / "case.yaml").write_text(text)
    return surfacechem.load(folder / "case.yaml").run(error="balances")


def bonded(solution):
    return solution.dataset["phi"].values


MECHANISM = """
units: {{length: m, quantity: mol, energy: kJ, activation-energy: kJ/mol}}
phases:
- name: p
  thermo: ideal-surface
  kinetics: surface
  species: [{names}]
  reactions: all
  site-density: 1e14 molec/m^2
species:
{species}
reactions:
{reactions}
"""


def mechanism(enthalpies, reactions):
    """Text of a mechanism of species with these enthalpies [kJ/mol] and reactions as YAML."""
    species = (
        f"- {{name: {name}, composition: {{}}, thermo: {{model: constant-cp, h0: {h!r}, s0: 0}}}}"
        for name, h in enthalpies.items()
    )
    return MECHANISM.format(
        names=", ".join(enthalpies), species="\n".join(species), reactions="\n".join(f"- {{{r}}}" for r in reactions)
    )


# -- a large exponent of something tiny ------------------------------------------------------------------------------

COLD, SPEED, LENGTH = 4, 20e-12, 0.3e-9
TINY = "1e-239"
"""A barrier of 0.2 eV at 4 K: 1e13 1/s exp(-0.2 eV / k_B T)."""


def work(f, length=LENGTH):
    return mpmath.mpf(f) * length / (BOLTZMANN * COLD)


def dudko(f, barrier=1e-18):
    nu = mpmath.mpf(1) / 2
    s = 1 - nu * mpmath.mpf(f) * LENGTH / barrier
    return s ** (1 / nu - 1) * mpmath.exp(barrier / (BOLTZMANN * COLD) * (1 - s ** (1 / nu)))


LOADED = {
    "bell: {k_off: 1e-239, x_off: 0.3 nm}": lambda f: mpmath.exp(work(f)),
    "dudko-hummer-szabo: {k_off: 1e-239, x_off: 0.3 nm, barrier: 1e-18, nu: 0.5}": dudko,
    "dembo-spring: {k_off: 1e-239, stiffness: 2 N/m, transition_stiffness: 1.3 N/m}": (
        lambda f: mpmath.exp(mpmath.mpf("0.7") * mpmath.mpf(f) ** 2 / (8 * BOLTZMANN * COLD))
    ),
}
RANGE = dict.fromkeys(LOADED, (100e-12, 106e-12))
RANGE[next(name for name in LOADED if "dembo" in name)] = (580e-12, 591e-12)


def test_the_warning_is_of_the_rate_and_not_of_its_exponent(tmp_path):
    """At 16 s the exponent is 1739, but only 1189 of the rate; at 10 s 1087 and 537, at 5 s 543 and -7."""
    law, loading = next(iter(LOADED)), "loading: {f: {ramp: {rate: 20 pN/s}}}\ninitial: {phi: 1}"
    for end, said in ((5.0, False), (7.5, False), (16.0, True)):
        solution = solve(tmp_path, f"sites: 1e14, bonding: [{law}]", [0.0, end], T=COLD, more=loading)
        reached = float(work(SPEED * end)) + float(mpmath.log(mpmath.mpf(TINY)))
        assert (reached > EXPONENT_CAP) == said
        texts = [text for text in solution.warnings if CAPPED in text]
        assert bool(texts) == said
        assert all(f"reached {reached:.4g}" in text for text in texts)


@pytest.mark.parametrize(("law", "energies"), [("mass-action: {k_on: 0 1/s,", (12, 8)), ("bell: {", (30, -10))])
def test_factors_of_a_rate_are_one_exponential(tmp_path, law, energies):
    """A rate known at 4 K, taken to 300 K: e^593 times 1e-257."""
    factors = ", ".join(f"activated: {{E_a: {energy} kJ/mol}}" for energy in energies)
    law = f"{law} k_off: {{value: 1e-257 1/s, times: [{factors}]}}}}"
    times = [0.0, 0.1, 0.2, 0.5]
    solution = solve(
        tmp_path, f"sites: 1e14, bonding: [{law}]", times, T=300, T_0=4, more="loading: {f: 0 N}\ninitial: {phi: 1}"
    )
    with mpmath.workdps(30):
        k = mpmath.mpf("1e-257") * mpmath.exp(-20000 / GAS * (mpmath.mpf(1) / 300 - mpmath.mpf(1) / 4))
        exact = [float(mpmath.exp(-k * t)) for t in times]
    assert 0.1 < exact[1] < 0.9
    np.testing.assert_allclose(bonded(solution), exact, rtol=0, atol=1e-9)
    assert not any(CAPPED in text for text in solution.warnings)


# -- orders below one ------------------------------------------------------------------------------------------------

SITES = 1e14 / 6.02214076e23
"""Density of sites [mol/m^2]."""


def order(n, k=1.0):
    """Rate constant of an order n that is k [1/s] at full coverage."""
    return f"rate-constant: {{A: {k * SITES ** (1 - n)!r}, b: 0, Ea: 0}}"


def coverages(folder, enthalpies, reactions, start, times, more=""):
    initial = ", ".join(f"{name}: {value}" for name, value in start.items())
    more = f"{more}\ninitial: {{coverages: {{{initial}}}}}"
    solution = solve(folder, "mechanism: mech.yaml", times, more=more, mechanism=mechanism(enthalpies, reactions))
    assert solution.status == "finished", solution.reason
    return np.array([solution.dataset[f"theta_{name}"].values for name in enthalpies])


@pytest.mark.parametrize(("n", "h"), [(0.05, -20.0), (0.9, -100.0)])
def test_a_cure_of_an_order_below_one_is_complete_and_goes_on(tmp_path, n, h):
    """It ends after the integral of da / ((1 + (1 - a)^0.5) a^n) from 0 to 0.99."""
    reaction = "equation: a => b, type: Kamal-Sourour, rate-constant: {A: 1, b: 0, Ea: 0}, A-2: 1, E-2: 0, m: 0.5, n: "
    q = 1 / (1 - n)

    def age(left):
        """Time until so much is left, with a = x^q."""
        return float(mpmath.quad(lambda x: q / (1 + mpmath.sqrt(1 - x**q)), [left ** (1 - n), 0.99 ** (1 - n)]))

    times = [0.0, age(0.5), age(1e-3), 1.01 * age(0.0), 3 * age(0.0)]
    a, b = coverages(tmp_path, {"a": 0.0, "b": h}, [reaction + str(n)], {"a": 0.99, "b": 0.01}, times)
    np.testing.assert_allclose(a, [0.99, 0.5, 1e-3, 0.0, 0.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(a + b, 1.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [0.0, 0.5])
def test_what_is_used_up_stays_so_and_lives_of_what_comes(tmp_path, n):
    """a => b of order n while c => a: at first a is used up, then it follows its supply."""
    start, supply = 0.1, 0.3
    reactions = [f"equation: a => b, orders: {{a: {n}}}, {order(n)}", f"equation: c => a, {order(1, supply)}"]
    times = np.linspace(0.0, 6.0, 13)
    a, b, c = coverages(tmp_path, {"a": 0, "b": -50, "c": 50}, reactions, {"a": start, "c": 1 - start}, times)
    exact = scipy.integrate.solve_ivp(
        # A layer of 1e-9 stands for the end of the power, in which the supply is met.
        lambda t, y: [supply * y[1] - y[0] * max(y[0], 1e-9) ** (n - 1), -supply * y[1]],
        (0.0, 6.0), [start, 1 - start], t_eval=times, method="Radau", rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    np.testing.assert_allclose(a, exact.y[0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(c, exact.y[1], rtol=0, atol=1e-8)
    np.testing.assert_allclose(a + b + c, 1.0, rtol=0, atol=1e-12)


# -- fast reactions that compete ---------------------------------------------------------------------------


def closed(enthalpies, steps):
    """Matrix of a closed network of steps (from, to, rate forward, reversible) at 300 K."""
    names = list(enthalpies)
    matrix = mpmath.zeros(len(names))
    for a, b, k, reversible in steps:
        i, j = names.index(a), names.index(b)
        drop = mpmath.mpf(enthalpies[b] - enthalpies[a]) * 1000 / (GAS * 300)
        back = mpmath.mpf(k) * mpmath.exp(drop) if reversible else 0
        for source, target, rate in ((i, j, mpmath.mpf(k)), (j, i, back)):
            matrix[source, source] -= rate
            matrix[target, source] += rate
    return matrix


def network(folder, enthalpies, steps, times, loaded):
    """Coverages of a closed network that starts in its first species, from a run and from its eigenvalues."""
    # A loaded step is two of type Bell, as both directions need a length under a force.
    text, apart = [], []
    for i, (a, b, k, reversible) in enumerate(steps):
        if i in loaded and reversible:
            back = float(mpmath.mpf(k) * mpmath.exp(mpmath.mpf(enthalpies[b] - enthalpies[a]) * 1000 / (GAS * 300)))
            apart += [(a, b, k, False), (b, a, back, False)]
            bell = "type: Bell, x-beta: 0.1 nm, rate-constant: {{A: {!r}, b: 0, Ea: 0}}"
            text += [f"equation: {a} => {b}, {bell.format(k)}", f"equation: {b} => {a}, {bell.format(back)}"]
        else:
            apart.append((a, b, k, reversible))
            arrow = "<=>" if reversible else "=>"
            text.append(f"equation: {a} {arrow} {b}, rate-constant: {{A: {k!r}, b: 0, Ea: 0}}")
    more = f"loading: {{f: 0 N}}\ninitial: {{coverages: {{{next(iter(enthalpies))}: 1}}}}"
    solution = solve(folder, "mechanism: mech.yaml", times, more=more, mechanism=mechanism(enthalpies, text))
    with mpmath.workdps(60):
        values, vectors = mpmath.eig(closed(enthalpies, apart))
        parts = mpmath.lu_solve(vectors, mpmath.matrix([1] + [0] * (len(enthalpies) - 1)))
        modes = [[mpmath.exp(value * t) * part for value, part in zip(values, parts, strict=True)] for t in times]
        exact = [[float(mpmath.re(x)) for x in vectors * mpmath.matrix(mode)] for mode in modes]
    assert solution.status == "finished", solution.reason
    return np.array([solution.dataset[f"theta_{name}"].values for name in enthalpies]), np.array(exact).T


def random_network(draw, decades):
    """Enthalpies, steps and the loaded ones of a network without cycles, its rates within so many decades."""
    names = {f"s{i}": round(draw.uniform(-20, 20), 3) for i in range(draw.integers(3, 7))}
    tree = [(int(draw.integers(i)), i) for i in range(1, len(names))]
    steps = [(f"s{a}", f"s{b}", float(10 ** draw.uniform(-decades / 2, decades / 2)), True) for a, b in tree]
    return names, steps, np.flatnonzero(draw.random(len(steps)) < 0.5)


def test_random_networks_with_rates_of_twenty_decades(tmp_path):
    draw = np.random.default_rng(8)
    for _ in range(3):
        names, steps, loaded = random_network(draw, 20)
        found, exact = network(tmp_path, names, steps, [0.0, 1e-3, 1.0, 1e3], loaded)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9)
