"""Where two exact solutions must agree, extreme parameters, and what has no solution; every case tests the equations
that one solves.
"""

import math

import mpmath
import numpy as np
import pytest

from surfacechem.errors import InputError
from surfacechem.references import Reference, get
from surfacechem.references.numerics import AutonomousODE, increasing_root

TIMES = np.array([0.0, 1e-17, 1e-9, 1e-3, 0.1, 0.7, 3.0, 20.0, 1e3, 1e6])
BODIES = {"C_1": 1.5, "C_2": 0.7, "C_c": 0.3, "T_0": 300.0}
MEDIUM = {"C_1": 1200.0, "C_2": 500.0, "h_1": 2500.0, "h_2": 700.0, "T_1": 290.0, "T_2": 350.0}
SOURCE = {"D_0": 150.0, "D_1": 4000.0, "gamma": 3.0}
WIDE, WARM, T_0 = (-6.0, 6.0), (0.0, 4.0), (math.log10(300.0),) * 2
EXPONENTS = {
    "pair-exchange": {"C_1": WIDE, "C_2": WIDE, "h": (-9.0, 9.0), "T_0": T_0, "T_1": WARM, "T_2": WARM},
    "reservoir-exchange": {"C": WIDE, "h": (-9.0, 9.0), "T_0": T_0, "T_i": (-2.0, 4.0), "T_a": (-2.0, 4.0)},
    "weakening-friction-with-loss": {"C": WIDE, "T_0": T_0, "T_i": WARM, "D_0": WIDE, "H": WIDE, "T_a": WARM},
    "thinning-film": {"C": (-3.0, 6.0), "T_0": T_0, "T_i": (2.3, 2.6), "D_0": WIDE, "beta": (-6.0, 0.5)},
    "adiabatic-arrhenius": {"A": (0.0, 20.0), "E_a": (3.0, 5.5), "T_i": (2.0, 3.0), "delta_T": (-3.0, 3.3)},
    "semenov-fold": {"T_0": T_0, "beta": (-4.0, 1.0), "H": (-3.0, 6.0), "D_0": (-16.0, -1e-16)},
    "bonding": {"C_1": WIDE, "C_2": WIDE, "T_0": T_0, "T_i": T_0, "K_0": WIDE, "K_1": WIDE, "tau": WIDE, "D": WIDE},
    "three-temperatures": {
        "C_1": (-3.0, 6.0),
        "C_2": (-3.0, 6.0),
        "C_c": (-15.0, 6.0),
        "h_1": (-12.0, 20.0),
        "h_2": (-12.0, 20.0),
        "T_1": WARM,
        "T_2": WARM,
        "T_c": WARM,
        "D_0": WARM,
        "D_1": WARM,
        "gamma": WIDE,
    },
}
FILM = {"C": 4000.0, "T_0": 300.0, "D_0": 3000.0}
SLID = {"C_1": 3000.0, "C_2": 1000.0, "T_0": 300.0, "D": 3000.0}
COLD, RUBBED = {"T_i": 300.0, "tau": 2.0}, {"T_i": 310.0, "D": 40.0}
LOSS, HOT = {"T_i": 310.0, "T_a": 300.0}, {"C": 900.0, "T_0": 300.0, "T_i": 500.0, "T_a": 290.0}

SLIDER = {"m": 10.0, "k": 1e8, "V": 1e-3, "p": 1e5, "mu_b": 0.9, "mu_ub": 0.6, "mu_k": 0.4}
ROCK = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
STEPS = {"theta_i": 3.0, "v_i": 1e-6, "v_step": 1e-4, "t_1": 2.0, "t_2": 3.0}
ZONE = {"t_max": 8e7, "E_b": 1e15, "g_f": 24e-6, "H_r": 2.0, "g_1": 8e-6, "speed": 1e-6}


def assert_same(one: Reference, other: Reference, *, relative=1e-13, t=TIMES, absolute=0.0):
    """Both give the same values of every quantity they share."""
    first, second = one.solution(t), other.solution(t)
    shared = first.keys() & second.keys()
    assert shared
    for name in shared:
        np.testing.assert_allclose(first[name], second[name], rtol=relative, atol=absolute, err_msg=name)


class TestLimits:
    @pytest.mark.parametrize(
        ("one", "given", "other", "others"),
        [
            ("bonding", {**BODIES, **COLD, "K_0": 180.0}, "exothermic-bonding", {**BODIES, "K_0": 180.0, "tau": 2.0}),
            *(
                ("bonding", {**BODIES, **COLD, "K_2": K_2}, "endothermic-bonding", {**BODIES, "K_2": K_2, "tau": 2.0})
                for K_2 in (1.0, 500.0, 749.999999)
            ),
            ("bonding", {**BODIES, **RUBBED, "tau": 1.0}, "sliding", {**BODIES, **RUBBED}),
            *(
                ("thinning-film", {**FILM, "T_i": 310.0, "beta": beta}, "sliding", {**SLID, "T_i": 310.0})
                for beta in (0.0, 1e-18)
            ),
            (
                "weakening-friction-with-loss",
                {**FILM, **LOSS, "H": 1e-15},
                "weakening-friction",
                {**FILM, "T_i": 310.0},
            ),
            ("weakening-friction-with-loss", {**HOT, "D_0": 0.0, "H": 40.0}, "reservoir-exchange", {**HOT, "h": 40.0}),
        ],
    )
    def test_a_solution_without_what_it_has_more_is_the_other(self, one, given, other, others):
        assert_same(get(one)(**given), get(other)(**others))

    @pytest.mark.parametrize("C_c", [1e-9, 1e-15])
    def test_medium_without_capacity(self, C_c):
        """The difference is the layer, gone after t = 1e-9, and C_c times the rates of change."""
        dynamic = get("three-temperatures")(**MEDIUM, **SOURCE, C_c=C_c, T_c=300.0)
        algebraic = get("three-temperatures-no-capacity")(**MEDIUM, **SOURCE)
        assert_same(dynamic, algebraic, t=TIMES[3:], relative=max(1e-13, 20 * C_c), absolute=1e4 * C_c + 1e-11)

    @pytest.mark.parametrize("gamma", [0.0, 1e-12])
    def test_slow_decay_of_the_source_is_a_steady_source(self, gamma):
        decaying = get("three-temperatures")(**MEDIUM, C_c=8.0, T_c=300.0, D_1=400.0, gamma=gamma)
        steady = get("three-temperatures")(**MEDIUM, C_c=8.0, T_c=300.0, D_0=400.0)
        assert_same(decaying, steady, t=TIMES[:8], relative=max(1e-13, 100 * gamma), absolute=1e-9)

    def test_source_that_decays_like_a_mode(self):
        bodies = {**MEDIUM, "C_c": 8.0, "T_c": 300.0, "D_1": 4000.0}
        for rate, _, _ in get("three-temperatures")(**bodies).modes():
            at = get("three-temperatures")(**bodies, gamma=rate)
            assert_same(
                at, get("three-temperatures")(**bodies, gamma=rate * (1 + 1e-14)), absolute=1e-9, relative=1e-11
            )


class TestExtremes:
    @pytest.mark.parametrize("t", [0.0, 1e-17, 1.0, 40.0])
    @pytest.mark.parametrize("power", [10, 52])
    def test_kappa_next_to_one(self, power, t):
        """Digits that double precision holds of 1 - kappa are all kept."""
        with mpmath.workdps(60):
            left = mpmath.mpf(2) ** -power
            exact = 256 * mpmath.sqrt(left / (left - (1 - left) * mpmath.expm1(-2 * mpmath.mpf(t))))
        given = {"C_1": 1.0, "C_2": 1.0, "T_0": 256.0, "K_2": 512.0 * (1.0 - 2.0**-power), "tau": 1.0}
        for reference in (get("endothermic-bonding")(**given), get("bonding")(**given, T_i=256.0)):
            assert float(reference.solution(t)["T"] / exact - 1) == pytest.approx(0.0, abs=1e-15)

    @pytest.mark.parametrize("beta", [1e-9, 1e-3, 1.0, 100.0])
    def test_film_with_any_thinning(self, beta):
        with mpmath.workdps(80):
            b = mpmath.mpf(beta)
            argument = mpmath.exp(300 * b - 1) * (300 * b - 1 + b**2 * 3000 * 300 * 50 / 4000)
            exact = (1 + mpmath.lambertw(argument)) / b
        assert get("thinning-film")(**FILM, T_i=300.0, beta=beta).solution(50.0)["T"] == pytest.approx(
            float(exact), rel=1e-14
        )

    @pytest.mark.parametrize("H", [1e-9, 1e-3, 0.3, 12.0, 1e4])
    @pytest.mark.parametrize("T_i", [1.0, 250.0, 900.0])
    def test_loss_of_any_strength(self, H, T_i):
        """Against the logarithms with many digits."""
        body = get("weakening-friction-with-loss")(**FILM, T_i=T_i, H=H, T_a=300.0)
        T = np.array([T_i + share * (body.steady_temperature - T_i) for share in (1e-6, 1e-3, 0.1, 0.5, 0.9)])
        with mpmath.workdps(80):
            product, start = mpmath.mpf(3000) * 300 / mpmath.mpf(H), mpmath.mpf(T_i)
            upper = (300 + mpmath.sqrt(90000 + 4 * product)) / 2
            lower = -product / upper
            exact = [
                start
                - x
                + (
                    upper**2 * mpmath.log((upper - start) / (upper - x))
                    + lower**2 * mpmath.log((x - lower) / (start - lower))
                )
                / (upper - lower)
                for x in map(mpmath.mpf, map(float, T))
            ]
        t = np.array([float(value) for value in exact]) * 4000.0 / (H * 300.0)
        np.testing.assert_allclose(body.solution(t)["T"], T, rtol=1e-13)

    @pytest.mark.parametrize("name", EXPONENTS)
    def test_finite_everywhere(self, name):
        """Parameters over many decades, times over 35."""
        random = np.random.default_rng(7)
        t = np.concatenate([[0.0], np.logspace(-20, 15, 36)])
        for _ in range(10):
            given = {key: float(10 ** random.uniform(*span)) for key, span in EXPONENTS[name].items()}
            if name == "semenov-fold":
                given["D_0"] *= given["H"] / (math.e * given["beta"])
            assert all(np.isfinite(value).all() for value in get(name)(**given).solution(t).values())

    def test_what_cannot_be_is_refused(self):
        with pytest.raises(InputError, match="T_0 = -1"):
            get("sliding")(**{**BODIES, "T_0": -1.0}, T_i=300.0, D=1.0)
        with pytest.raises(InputError, match="K_2 must be below"):
            get("endothermic-bonding")(**BODIES, K_2=750.0, tau=1.0)
        with pytest.raises(InputError, match="T has no real value at t = "):
            get("bonding")(**BODIES, K_0=-2000.0, T_i=300.0, tau=1.0).solution([0.0, 9.0])


@pytest.mark.parametrize("name", ["aging-velocity-steps", "slip-velocity-steps"])
def test_friction_jumps_by_a_and_settles_by_a_minus_b(name):
    steps = get(name)(**ROCK, **{**STEPS, "theta_i": 10.0, "t_2": 1e3})
    values = steps.solution([1.0, STEPS["t_1"], np.nextafter(2.0, 3.0), 900.0])
    friction = values[f"t_{steps.law}"] / ROCK["p"]
    ten = np.log(STEPS["v_step"] / STEPS["v_i"])
    np.testing.assert_allclose(friction, 0.6 + np.array([0, 0, 0.01 * ten, -0.005 * ten]), rtol=1e-12)


@pytest.mark.parametrize("name", ["aging-velocity-steps", "slip-velocity-steps"])
def test_extreme_slips_and_direct_effects_stay_finite(name):
    steps = get(name)(**{**ROCK, "L": 1e-12, "a": 1e-5}, **STEPS)
    values = steps.solution(np.linspace(0.0, 1e6, 50))
    assert all(np.isfinite(value).all() for value in values.values())
    assert values["theta"][-1] == pytest.approx(1e-6, rel=1e-12)


def test_stick_slip_debonding_without_stronger_bonds_is_stick_slip():
    t = np.linspace(0.0, 3.0, 3998)
    ours = get("stick-slip-debonding")(**{**SLIDER, "mu_b": 0.6}).solution(t)
    plain = get("stick-slip")(m=10.0, k=1e8, V=1e-3, t_s=6e4, t_k=4e4).solution(t)
    for name, values in plain.items():
        np.testing.assert_allclose(ours[name], values, atol=1e-10 * np.abs(values).max())


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("aging-velocity-steps", {**ROCK, **STEPS, "t_2": 1.0}, "t_2 must not be below t_1 = 2"),
        ("bilinear-debonding", {**ZONE, "g_f": 8e-8}, "g_f must be above t_max / E_b = 8e-08 m"),
        ("stick-slip-debonding", {**SLIDER, "mu_b": 1.5}, "exact for mu_k <= mu_ub <= mu_b <= 2 mu_k"),
    ],
)
def test_what_has_no_solution_is_refused(name, given, message):
    with pytest.raises(InputError, match=message):
        get(name)(**given)


def test_a_root_that_is_settled_is_not_evaluated_again():
    evaluated = []

    def square(x, part):
        evaluated.append(part.tolist())
        return x**2, 2 * x

    target = np.array([1.0, 2.0, 1e9])
    found = increasing_root(square, target, np.ones(3), np.full(3, 1e5), None, np.arange(3))
    assert found == pytest.approx(np.sqrt(target), rel=2e-16)
    assert evaluated[0] == [0, 1, 2]
    assert evaluated[1] == [1, 2]
    assert evaluated[-1] == [2]


@pytest.mark.parametrize("function", [lambda x: (x**0.1, 0.1 * x**-0.9), lambda x: (x + x**3, 1 + 3 * x**2)])
def test_roots_close_to_each_other_are_found_to_rounding(function):
    """The values of one make the bracket of another narrow before that one is near it."""
    for seed in range(200):
        random = np.random.default_rng(seed)
        roots = np.repeat(random.uniform(0.0, 1.0, 4), 3) * (1 + 1e-9 * np.tile([-1, 0, 1], 4))
        start = random.uniform(0.0, 1.0, 12)
        found = increasing_root(function, function(roots)[0], np.full(12, 1e-12), np.ones(12), start)
        assert found == pytest.approx(roots, rel=1e-14)


@pytest.mark.parametrize("power", [0.05, 0.5, 0.9])
def test_a_path_from_and_to_a_singular_rate_is_known_to_rounding(power):
    """Of a rate x^p (1 - x)^p with p below one, from zero to one: its time is a beta function."""
    path = AutonomousODE(lambda gone, left: (gone * left) ** power, 1.0)
    assert path.duration == pytest.approx(float(mpmath.beta(1 - power, 1 - power)), rel=1e-15)
    gone, left = path.position(np.array([path.duration / 2, path.duration / 1e3]))
    assert gone[0] == pytest.approx(left[0], rel=1e-13)
    elapsed = mpmath.betainc(1 - power, 1 - power, 0, mpmath.mpf(gone[1]))
    assert path.duration / 1e3 == pytest.approx(float(elapsed), rel=1e-14)
