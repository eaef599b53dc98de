"""Bonds under load in a scene: who carries what, when bonds rupture, and survival however small."""

import math
from dataclasses import replace

import numpy as np
import pytest
from solved import solve

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.free_energy import BondSprings, LatticeGas, LinearEnthalpy, NormalStiffness
from surfacechem.laws.kinetics import Bell, ReversibleBell
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.quantities import BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Scene, Sites

THERMAL = BOLTZMANN * 300.0
X = 4e-10
UNIT = THERMAL / X
"""Force at which Bell's exponent is one [N]."""
SLIP = Bell(k_off=1.0, x_off=X)
SITES = 1e16


def isothermal(law, loading, phi=1.0, potentials=()) -> Scene:
    """Bonds between two reservoirs of one temperature."""
    kept = Hold(level=300.0)
    interface = Interface(kept, potentials, reactions=[law], sites=Sites(SITES, SITES))
    return Scene((Body("lower", kept), Body("upper", kept)), interface, loading=loading, initial={"phi": phi})


def solved(scene, *times, **settings):
    return solve(scene, times, **settings)


# -- who carries the load ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("loading", "potentials", "message"),
    [
        ({}, (), "the law bell reads the force per bond, tension positive f, but nothing evolves or prescribes it"),
        ({"f": 1e-12, "t_n": 1.0}, (), "f has two roles: prescribed (loading) and derived (load shared by all bonds)"),
        ({"g_n": 1e-9, "t_n": 1.0}, (NormalStiffness(E_n=1.0),), "t_n has two roles: prescribed (loading) and derived"),
        ({"g_n": 1e-9, "f": 1.0}, (BondSprings(k_b=1.0),), "f has two roles: prescribed (loading) and derived"),
    ],
)
def test_a_load_has_one_role(loading, potentials, message):
    histories = {name: Hold(level=value) for name, value in loading.items()}
    with pytest.raises(InputError) as error:
        assemble(isothermal(SLIP, histories, potentials=potentials))
    assert message in str(error.value)


# -- rupture ----------------------------------------------------------------------------------------------------------


def test_a_load_beyond_reason_is_refused_at_the_start():
    with pytest.raises(InputError, match=r"at the start the bonds ruptured .*lower `t_n`, or let it grow from zero"):
        solved(isothermal(SLIP, {"t_n": Hold(level=1e5 * UNIT * SITES)}), 1.0)


# -- survival in logarithms -------------------------------------------------------------------------------------------


def in_logarithms(scene, ln_phi=0.0):
    return Scene(scene.bodies, scene.interface, loading=scene.loading, initial={"ln_phi": ln_phi}, T_0=scene.T_0)


def test_survival_of_any_smallness():
    """Along a ramp ln S = -(k_0 / f') (exp(f) - 1) is met to 1e-10 down to S = e^-1000000."""
    hazard = np.array([1e-3, 1.0, 50.0, 690.0, 745.0, 1e4, 1e6])
    times = np.log1p(hazard)  # the force grows by one unit, the rate at no force is one
    trajectory = solved(in_logarithms(isothermal(SLIP, {"f": Ramp(rate=UNIT)})), *times)
    np.testing.assert_allclose(trajectory.result.outputs[1:, 0], -hazard, rtol=1e-10)
    np.testing.assert_allclose(trajectory["phi"][1:5], np.exp(-hazard[:4]), rtol=1e-8)
    assert np.isfinite(trajectory.outputs).all()
    assert audit(trajectory).site_error < 1e-10


def test_laws_that_read_a_load_share_what_they_break_however_fast_they_are():
    """At e^200 per second no time resolves them; each still breaks its half, and not what rounding leaves of bonds."""
    scene = isothermal(SLIP, {"f": Ramp(rate=UNIT)}, potentials=[LinearEnthalpy(H_r=1.0)])
    interface = replace(scene.interface, reactions=[SLIP, replace(SLIP, k_off=2.0)])
    trajectory = solved(replace(scene, interface=interface), 200.0)
    found = audit(trajectory)
    assert found.site_error < 1e-8
    assert found.entropy_error < 1e-8
    accounts = [account.quantity.name for account in trajectory.model.system.ledger]
    heats = dict(zip(accounts, trajectory.result.ledger.tolist(), strict=True))
    assert (heats["heat_bell"], heats["heat_bell_2"]) == pytest.approx((-1 / 3, -2 / 3), rel=1e-9)


@pytest.mark.parametrize("rate", ["1 nN/s", "100 nN/s"])
def test_two_bound_states_keep_their_sites_far_beyond_their_rupture(rate):
    """What is left of one is let go, and turned into the other, at rates that have no number."""
    run = surfacechem.run("vinculin-catch-bond", {"loading.f": {"ramp": {"rate": rate}}, "run": {"until": "1 s"}})
    assert run.status == "finished"
    assert run.accuracy.error < 1e-10
    assert run.audit.site_error < 1e-8
    assert run.dataset["theta_free_s"].values[-1] == pytest.approx(1, rel=1e-14)


def test_logarithms_change_nothing_else():
    potentials = [LatticeGas(epsilon=2e-20), BondSprings(k_b=1e-3)]
    scene = isothermal(ReversibleBell(k_off=1.0, x_off=X), {"g_n": Ramp(rate=1e-9)}, 0.7, potentials=potentials)
    plain, logarithmic = (solved(form, 1.0, 3.0, 9.0) for form in (scene, in_logarithms(scene, math.log(0.7))))
    assert logarithmic.model.system.states[0].name == "ln_phi"
    for item in logarithmic.system.outputs:
        ours, theirs = logarithmic[item.name], plain[item.name]
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8 * abs(theirs).max(), err_msg=item.name)
    assert logarithmic.energy_error < 1e-9
    assert audit(logarithmic).violations == ()


@pytest.mark.parametrize(
    ("initial", "message"),
    [
        ({"ln_phi": 0.0, "phi": 1.0}, "phi has two roles: given by itself and by ln_phi"),
        ({"ln_phi": 0.1}, "initial phi = 1.10517 is outside its range: 0 to 1"),
        ({"ln_phi": -1e4}, "is no bonding state that a number can hold"),
    ],
)
def test_initial_logarithms_are_checked(initial, message):
    scene = isothermal(SLIP, {"f": Hold(level=0.0)})
    with pytest.raises(InputError) as error:
        assemble(Scene(scene.bodies, scene.interface, loading=scene.loading, initial=initial))
    assert message in str(error.value)


# -- contact enthalpy per bonding site, and the class of a reaction by its heat ---------------------------------------

HEATED = """
title: bonds between bodies of one temperature
T_0: 300 K
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  sites: 1e16 1/m^2
  potential: [{potential}]
  bonding: [linear-affinity: {{c_r: 1e19 1/J/s}}]
{load}
initial: {{phi: 0.2{more}}}
run: {{until: 20 s}}
"""
SPRINGS = "{bond-stiffness: {E_b: 1e13 Pa/m, E_n: 1e14 Pa/m}}, {lattice-gas: {epsilon: 2e-20 J}}"


def run(folder, potential, load="", more=""):
    path = folder / "case.yaml"
    path.write_text(HEATED.format(potential=potential, load=load, more=more))
    return surfacechem.load(path).run(error="balances")


@pytest.mark.parametrize(
    ("energy", "expected"),
    [("K_0: 1 mJ/m^2", "exothermic"), ("K_2: 1 mJ/m^2", "endothermic"), ("K_1: 1 mJ/m^2", "isothermic")],
)
def test_the_class_of_a_reaction(energy, expected, tmp_path):
    """Bonds form in all of them, by the affinity; the heat that keeps the temperatures says the class."""
    solution = run(tmp_path, f"bond-energy: {{{energy}}}")
    data = solution.dataset
    assert solution.attributes["reaction"] == expected
    assert data["phi"][-1] > 0.5
    kept = -sum(data[name] for name in data if name.startswith("Q_T"))
    np.testing.assert_allclose(data["q_reaction"], kept, atol=1e-12)


def test_bonds_that_form_and_break_are_of_both_classes(tmp_path):
    path = tmp_path / "case.yaml"
    text = HEATED.format(potential="bond-energy: {K_0: 1 mJ/m^2}", load="", more="")
    history = "loading: {phi: {table: {times: [0 s, 1 s, 2 s], values: [0.2, 0.8, 0.2]}}}"
    lines = [line for line in text.splitlines() if "bonding:" not in line and "initial:" not in line]
    body = "{temperature: T_1, C: 1 J/m^2/K}"
    path.write_text("\n".join(lines).replace("a: {temperature: 300 K}", f"a: {body}").replace("20 s", "2 s")
                    + f"\n{history}\ninitial: {{T_1: 300 K}}\n")  # fmt: skip
    solution = surfacechem.load(path).run(error="balances")
    assert solution.attributes["reaction"] == "exothermic and endothermic"
    assert float(solution.dataset["e_c"][0]) == pytest.approx(0.5e-3 * 0.8**2 / 1e16, rel=1e-12)


@pytest.mark.parametrize("area", [1, 2])
def test_at_constant_traction_the_fall_of_the_enthalpy_is_the_heat_that_leaves(area, tmp_path):
    load = f"loading: {{F_n: 20 kPa, J_c: {area}}}"
    solution = run(tmp_path, SPRINGS, load, ", g_n: 5 nm")
    data = solution.dataset
    given = (
        data["H_T_c"]
        if "H_T_c" in data
        else sum(data[name] for name in data if name.startswith("H_") and not name.endswith("entropy"))
    )
    np.testing.assert_allclose(1e16 * (data["e_c"] - data["e_c"][0]), given, atol=1e-12)
    t_n = data["t_n_nominal"] if area == 2 else data["t_n"]
    np.testing.assert_allclose(1e16 * data["e_c"], data["U_c"] - t_n * data["g_n"], rtol=1e-12)
    np.testing.assert_allclose(t_n, 2e4, rtol=1e-9)
