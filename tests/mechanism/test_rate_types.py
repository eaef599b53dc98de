"""Rate types of bonds under load: the laws of a case in a mechanism, with detailed balance under any force."""

import json
import math

import cantera as ct
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from mechanisms import KMOL, call, mechanism_texts, states, values
from surfacechem.errors import InputError
from surfacechem.laws.free_energy import LatticeGas
from surfacechem.laws.kinetics import (
    Bell,
    DemboSpring,
    DudkoHummerSzabo,
    ExponentialAffinity,
    GapAttachment,
    KamalSourour,
    LinearAffinity,
    TwoPathway,
)
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.rates import LoadedReaction, names
from surfacechem.model.assemble import assemble
from surfacechem.quantities import AVOGADRO, BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Scene, Sites
from surfacechem.solve.run import Model, Run

SITES = 1e16
RATE = {"A": 2.0, "b": 0.0, "Ea": 0.0}
BELL = {"x-beta": "0.4 nm"}
DEMBO = {"stiffness": "2 pN/nm", "transition-stiffness": "1 pN/nm"}
PATHS = {"x-slip": "0.2 nm", "x-catch": "1 nm", "catch-ratio": 50}
DUDKO = {"x-beta": "0.4 nm", "barrier": "40 kJ/mol", "nu": 0.5}
TETHER = {"stiffness": "1 pN/nm", "rest-length": "20 nm"}
CURE = {"A-2": "30 1/s", "E-2": "3 kJ/mol", "m": 0.5, "n": 1.5}
BARRIER = 40e3 / AVOGADRO
springs = {"stiffness": 2e-3, "transition_stiffness": 1e-3}

SAME = [
    ("bond => free", "Bell", BELL, Bell(k_off=2.0, x_off=4e-10)),
    ("free => bond", "Bell", {"x-beta": "-0.1 nm"}, Bell(k_off=0.0, k_on=2.0, x_on=-1e-10)),
    ("bond => free", "Dembo", DEMBO, DemboSpring(k_off=2.0, **springs)),
    ("free => bond", "Dembo-formation", DEMBO, DemboSpring(k_off=0.0, k_on=2.0, **springs)),
    ("bond => free", "two-pathway", PATHS, TwoPathway(k_slip=2.0, x_slip=2e-10, k_catch=100.0, x_catch=1e-9)),
    ("bond => free", "Dudko-Hummer-Szabo", DUDKO, DudkoHummerSzabo(k_off=2.0, x_off=4e-10, barrier=BARRIER, nu=0.5)),
    ("free => bond", "gap-attachment", TETHER, GapAttachment(k_on=2.0, stiffness=1e-3, rest_length=2e-8)),
    ("free => bond", "Kamal-Sourour", CURE, KamalSourour(A_1=2.0, A_2=30.0, E_2=3e3, m=0.5, n=1.5)),
]
"""A reaction of a mechanism, and the law of a case that says the same."""


def species(name, h=0.0, s=0.0, **more):
    thermo = {"model": "constant-cp", "T0": 298.15, "h0": f"{h} kJ/mol", "s0": f"{s} J/mol/K", "cp0": 0.0}
    return {"name": name, "composition": {}, "thermo": thermo, **more}


def mechanism(folder, reactions, bond=None, others=(), density=SITES, **more):
    """Free sites and bonds, worth -20 kJ/mol, with some reactions."""
    phase = {
        "name": "surface",
        "thermo": "ideal-surface",
        "kinetics": "surface",
        "species": "all",
        "reactions": "all",
        "site-density": density / KMOL,
    }
    elastic = {"bond": bond} if bond else {}
    every = [species("free"), species("bond", -20.0, -30.0, **elastic), *others]
    units = {"length": "m", "quantity": "kmol"}
    path = folder / "mechanism.yaml"
    path.write_text(json.dumps({"units": units, "phases": [phase], "species": every, "reactions": reactions, **more}))
    return load_mechanism(path, bonds=["bond"])


def reaction(equation, kind, more, rate=RATE):
    return {"equation": equation, "type": kind, "rate-constant": rate, **more}


def scene(read, loading, T=300.0, coverages=None, extra=()):
    kept = Hold(level=T)
    interface = Interface(
        kept,
        [*extra, *read.potentials],
        reactions=read.reactions,
        sites=read.sites,
        variables=read.variables,
        bonds=read.bonds,
    )
    initial = read.coverages(coverages or {"free": 0.4, "bond": 0.6})
    return Scene((Body("lower", kept), Body("upper", kept)), interface, loading=loading, initial=initial, T_0=T)


def solved(built, times, **settings):
    return Model(assemble(built)).solve(Run(times=times, **settings))


@pytest.mark.parametrize(("equation", "kind", "more", "law"), SAME, ids=[f"{s[1]}-{s[0][:4]}" for s in SAME])
@pytest.mark.parametrize("f", [0.0, 20e-12, 4e-9])
def test_a_mechanism_says_what_a_case_says(tmp_path, equation, kind, more, law, f):
    (lowered,) = mechanism(tmp_path, [reaction(equation, kind, more)]).reactions
    phi, T, g_n = 0.3, 310.0, 2.4e-8
    point = {"T_c": T, "f": f, "g_n": g_n, "theta_free": 1 - phi, "theta_bond": phi}
    point |= dict.fromkeys(("n_theta_free", "n_theta_bond"), SITES)
    state = {"phi": phi, "n_c": SITES, "f": f, "T_c": T, "g_n": g_n}
    expected = law.rate(**{name: state[name] for name in state if name in law.rate.__code__.co_varnames})
    assert lowered.peaks == pytest.approx(law.peaks)
    assert lowered.ranges.keys() == law.ranges.keys()
    sign = 1 if equation.startswith("free") else -1
    assert sign * call(lowered.rate, point) == pytest.approx(expected, rel=1e-13)
    if 0 < abs(expected) < 1e100:  # beyond, a rate grows no more as its logarithm does
        assert call(lowered.log_forward, point) == pytest.approx(math.log(abs(expected)), rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "stiffness"), [("linear-affinity", None), ("exponential-affinity", {"stiffness": "1 pN/nm"})]
)
def test_affinity_laws_run_as_in_a_case(tmp_path, kind, stiffness):
    read = mechanism(tmp_path, [reaction("free <=> bond", kind, {})], stiffness)
    T, g = 300.0, 3e-9
    trajectory = solved(scene(read, {"g_n": Hold(level=g)} if stiffness else {}, T), [0.0, 0.1, 1.0])
    elastic = 1e-3 * g**2 / 2 if stiffness else 0.0
    gibbs = (-20e3 + T * 30.0) / AVOGADRO + elastic
    law = {
        "linear-affinity": LinearAffinity(c_r=RATE["A"] / (BOLTZMANN * T)),
        "exponential-affinity": ExponentialAffinity(C_r=SITES * RATE["A"] / (BOLTZMANN * T)),
    }[kind]
    kept = Hold(level=T)
    interface = Interface(kept, [LatticeGas(epsilon=-gibbs)], reactions=[law], sites=Sites(SITES, SITES))
    same = solved(Scene((Body("a", kept), Body("b", kept)), interface, initial={"phi": 0.6}), [0.0, 0.1, 1.0])
    np.testing.assert_allclose(trajectory.result.outputs[:, 1], same.result.outputs[:, 0], rtol=1e-9)
    assert audit(trajectory).violations == ()


def test_every_rate_type_is_in_the_comparison():
    compared = {kind for _, kind, _, _ in SAME}
    assert compared | {"linear-affinity", "exponential-affinity", "Arrhenius"} == set(names())


LOADS = [("Bell", BELL), ("Dembo", DEMBO), ("Dembo-formation", DEMBO), ("two-pathway", PATHS)]
LOADS += [("Dudko-Hummer-Szabo", DUDKO), ("gap-attachment", TETHER)]


@given(data=st.data(), f=st.floats(-40e-12, 40e-12), g_n=st.floats(0.0, 4e-8))
@settings(max_examples=10, phases=[Phase.explicit, Phase.generate])
def test_loads_multiply_the_rates_of_random_mechanisms(tmp_path_factory, data, f, g_n):
    """Whatever the thermo, orders and coverage dependencies: Cantera's rates times what the load does."""
    ct.suppress_thermo_warnings(True)
    text = data.draw(mechanism_texts())
    surface, loaded = ct.Interface(yaml=text), json.loads(text)
    for entry in loaded["reactions"]:
        kind, more = data.draw(st.sampled_from([("Arrhenius", {}), *LOADS]))
        entry |= {"type": kind, **more}
    path = tmp_path_factory.mktemp("loaded") / "random.yaml"
    path.write_text(json.dumps(loaded), encoding="utf-8")
    read = load_mechanism(path)
    T, coverages = data.draw(states(len(read.variables)))
    surface.TP = T, ct.one_atm
    surface.coverages = coverages
    point = values(read, T, surface.coverages.tolist()) | {"f": f, "g_n": g_n}
    for i, law in enumerate(read.reactions):
        factor = math.exp(call(law.log_factor, point)) if isinstance(law, LoadedReaction) else 1.0
        theirs = surface.forward_rates_of_progress[i], surface.reverse_rates_of_progress[i]
        for ours, rate in zip((law.forward, law.reverse), theirs, strict=True):
            assert call(ours, point) == pytest.approx(rate * KMOL * factor, rel=2e-12, abs=1e-290)


def test_two_bond_species_share_the_load_by_their_stiffness(tmp_path):
    """Each reaction feels the force of its own bond; the traction is the sum over all bonds."""
    strong = species("strong", -25.0, -30.0, bond={"stiffness": "3 pN/nm", "rest-length": "1 nm"})
    steps = [
        reaction("bond <=> free", "Bell", BELL),
        reaction("strong <=> free", "Bell", {"x-beta": "0.1 nm"}),
        reaction("bond <=> strong", "Bell", {"x-beta": "-0.2 nm"}),
    ]
    read = mechanism(tmp_path, steps, {"stiffness": "1 pN/nm"}, [strong])
    built = scene(read, {"g_n": Ramp(rate=1e-9)}, coverages={"free": 0.2, "bond": 0.5, "strong": 0.3})
    trajectory = solved(built, [0.0, 1.0, 5.0])
    columns = {item.name: trajectory.outputs[:, j] for j, item in enumerate(trajectory.model.system.outputs)}
    gap = columns["g_n"]
    np.testing.assert_allclose(columns["f_theta_bond"], 1e-3 * gap, rtol=1e-12)
    np.testing.assert_allclose(columns["f_theta_strong"], 3e-3 * (gap - 1e-9), rtol=1e-12, atol=1e-24)
    theta = trajectory.result.outputs
    total = SITES * (theta[:, 1] * columns["f_theta_bond"] + theta[:, 2] * columns["f_theta_strong"])
    np.testing.assert_allclose(columns["t_n"], total, rtol=1e-12)
    books = audit(trajectory)
    assert books.violations == ()
    assert books.energy_error < 1e-10
    assert "f" not in columns


def test_a_load_that_all_bonds_share_breaks_them(tmp_path):
    """Two bond species without springs carry the same force; the run ends where they cannot."""
    other = species("other", -20.0, -30.0)
    steps = [reaction("bond => free", "Bell", BELL), reaction("other => free", "Bell", BELL)]
    mechanism(tmp_path, steps, others=[other])
    read = load_mechanism(tmp_path / "mechanism.yaml", bonds=["bond", "other"])
    per_bond = 0.5 * BOLTZMANN * 300.0 / 4e-10
    built = scene(read, {"t_n": Hold(level=per_bond * SITES)}, coverages={"bond": 0.7, "other": 0.3})
    trajectory = solved(built, [0.0, 1.0])
    life = 0.559773594776160811746795939315 / RATE["A"]
    assert trajectory.reason == f"the bonds ruptured at t = {life:.9g} s"


WRONG = [
    ({"type": "Bell", "x-beta": 0.4}, "x-beta: 0.4 is a length of 0.4 m, which no bond has; write it as `0.4 nm`."),
    ({"type": "Bell", "x-beta": [1, 2]}, "reaction bond <=> free: x-beta must be a number, not [1, 2]."),
    ({"type": "Dudko-Hummer-Szabo", **DUDKO, "nu": 2}, "nu = 2 is outside its range: > 0 and <= 1."),
    ({"equation": "bond => free", "type": "linear-affinity"}, "a rate by affinity runs both ways; write `<=>`."),
    ({"equation": "2 free => 2 bond", "type": "Kamal-Sourour", **CURE}, "one species that turns into another"),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_mistakes_are_named_with_their_line(tmp_path, change, message):
    with pytest.raises(InputError) as error:
        mechanism(tmp_path, [{"equation": "bond <=> free", "rate-constant": RATE, **change}])
    assert message in str(error.value)
    assert "mechanism.yaml:1" in str(error.value)
