"""Properties of the constraints over masses, stiffnesses, loads and restitution; each scene is compiled once.

Unilateral contact (rigid and by a penalty), set-valued friction, bounds of the bonding state, and a strength.
"""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.equilibria import DRIFT

BODIES = """
T_0: 300 K
bodies:
  a: {temperature: T, capacity: constant, C: 10 J/m^2/K}
  b: {temperature: T, capacity: constant, C: 10 J/m^2/K}
interface:
  temperature: T
"""
FALLING = f"""{BODIES}
mechanics: {{normal: {{m: 1, e: 0.5}}}}
loading: {{F_n: -10 Pa}}
initial: {{T: 300 K, g_n: 1 mm, v_n: 0}}
run: {{until: 0.1 s, outputs: 41}}
"""
PRESSED = f"""{BODIES}  potential: [penalty: {{E_n: 1e9 Pa/m}}]
mechanics: {{normal: {{k: 1e9 Pa/m}}}}
loading: {{w_n: {{ramp: {{start: 1 um, rate: -1 um/s}}}}}}
initial: {{T: 300 K, g_n: 1 um}}
run: {{until: 2 s, outputs: 21}}
"""
DRAGGED = f"""{BODIES}  friction: [coulomb: {{mu: 0.5}}]
mechanics: {{tangential: {{k: 1e9 Pa/m}}}}
loading: {{p: 1 MPa, w_t: {{harmonic: {{amplitude: 1 mm, frequency: 1 Hz}}}}}}
initial: {{T: 300 K}}
run: {{until: 2 s, outputs: 81}}
"""
BONDED = f"""{BODIES}  sites: 1e18 1/m^2
  potential: [bond-energy: {{K_0: 1 J/m^2, phi_eq: 2}}]
  bonding: [linear-affinity: {{c_r: 1e18}}]
initial: {{T: 300 K, phi: 0.5}}
run: {{until: 4 s, outputs: 41}}
"""
TORN = f"""{BODIES}  sites: 1e18 1/m^2
  potential: [bond-energy: {{K_0: 1e-6 J/m^2}}]
  limits: [tensile-strength: {{t_max: 1 MPa}}]
mechanics: {{normal: {{k: 1e12 Pa/m}}}}
loading: {{w_n: {{ramp: {{rate: 1 um/s}}}}}}
initial: {{T: 300 K, phi: 1}}
run: {{until: 3 s, outputs: 31}}
"""

simulation = cache(lambda text: Simulation(load_text(text)))

few = settings(max_examples=6, derandomize=True)


def decades(low, high):
    return st.floats(low, high).map(lambda power: 10.0**power)


def run(text, changes):
    """A run with changed parameters, whose energy is closed and in which no law destroys entropy."""
    solution = simulation(text).run(changes, error="balances")
    assert solution.status == "finished", solution.reason
    assert solution.audit.findings == ()
    return solution


@few
@given(m=decades(-3, 3), a=decades(0, 2), g=decades(-4, -3), e=st.floats(0.05, 1.0))
def test_a_rigid_contact_sends_back_what_hits_it(m, a, g, e):
    """Newton's rule at every impact: v_n turns to -e v_n, and (1 - e^2) of the kinetic energy becomes heat."""
    changes = {"mechanics.normal.m": m, "mechanics.normal.e": e, "loading.F_n": -m * a, "initial.g_n": g}
    solution = run(FALLING, changes)
    names = [state.name for state in solution.trajectory.model.system.states]
    gap, velocity = names.index("g_n"), names.index("v_n")
    assert solution.dataset["g_n"].values.min() >= -1e-12 * g
    impacts = [jump for jump in solution.trajectory.jumps if jump.before.y[velocity] < 0 and not jump.edge.fold]
    fall = np.sqrt(2 * g / a)
    assert bool(impacts) == (fall < 0.1)
    for jump in impacts[:3]:
        before, after = jump.before.y[velocity], jump.after.y[velocity]
        assert abs(jump.before.y[gap]) <= 1e-9 * g
        if after:  # the last ones of infinitely many come to rest
            assert after == pytest.approx(-e * before, rel=1e-9)
            assert jump.released == pytest.approx(0.5 * m * (1 - e**2) * before**2, rel=1e-9, abs=1e-15 * m * before**2)
    if impacts:
        assert impacts[0].t == pytest.approx(fall, rel=1e-9)


@few
@given(k=decades(6, 12), E=decades(6, 12), rate=decades(-8, -5))
def test_a_pressed_contact_bears_pressure_alone(k, E, rate):
    """Complementarity: apart there is no traction; in contact both springs bear the same one."""
    changes = {"mechanics.normal.k": k, "interface.potential.penalty.E_n": E, "loading.w_n.ramp.rate": -rate}
    solution = run(PRESSED, changes)
    data = solution.dataset
    w = 1e-6 - rate * data["time"].values
    scale = np.abs(w).max()
    np.testing.assert_allclose(data["g_n"], np.where(w > 0, w, w * k / (k + E)), rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(data["t_n"], E * np.minimum(data["g_n"], 0), rtol=0, atol=1e-9 * E * scale)


@few
@given(k=decades(8, 10), p=decades(5, 6.5), mu=st.floats(0.05, 1.0), frequency=st.floats(0.5, 2.0))
def test_dry_friction_is_within_its_limit_and_on_it_while_it_slides(k, p, mu, frequency):
    """Against the return to the limit at every turn of the load: t = k (w - u) stays in [-mu p, mu p].

    The displacement is integrated, so that its drift within the tolerance of the run is one of the spring's traction.
    """
    changes = {"interface.friction.coulomb.mu": mu, "loading.w_t.harmonic.frequency": frequency}
    solution = run(DRAGGED, changes | {"mechanics.tangential.k": k, "loading.p": p})
    data, limit = solution.dataset, mu * p
    traction = k * (data["w_t"] - data["u_t"]).values
    drift = DRIFT * solution.trajectory.run.rtol * np.abs(data["u_t"].values).max()
    assert np.abs(traction).max() <= limit * (1 + 1e-12) + k * drift
    slipped, t = 0.0, data["time"].values
    turns = [(0.5 * j + 0.25) / frequency for j in range(int(4 * frequency) + 2)]
    for at, u in zip(t, data["u_t"].values, strict=True):
        while turns and turns[0] < at:
            slipped = returned(1e-3 * np.sin(2 * np.pi * frequency * turns.pop(0)), slipped, limit / k)
        now = returned(1e-3 * np.sin(2 * np.pi * frequency * at), slipped, limit / k)
        assert u == pytest.approx(now, rel=1e-9, abs=1e-12)


def returned(w, slipped, reach):
    """The slip after a monotone way of the load: no more than brings the spring back to the limit."""
    return min(max(slipped, w - reach), w + reach)


@few
@given(c=decades(17, 20), phi_eq=st.floats(1.1, 3.0), start=st.floats(0.0, 0.95))
def test_bonds_stop_at_their_bound(c, phi_eq, start):
    """phi relaxes towards phi_eq > 1 and stays at 1 from where it is reached."""
    paths = {"interface.bonding.linear-affinity.c_r": c, "interface.potential.bond-energy.phi_eq": phi_eq}
    solution = run(BONDED, paths | {"initial.phi": start})
    free = phi_eq + (start - phi_eq) * np.exp(-c / 1e18 * solution.dataset["time"].values)
    np.testing.assert_allclose(solution.dataset["phi"], np.minimum(free, 1.0), rtol=0, atol=1e-8)
    assert [jump.edge.name for jump in solution.trajectory.jumps] == ["complete"] * bool(free[-1] > 1)


@few
@given(k=decades(11, 13), strength=decades(5, 6.3), rate=decades(-6.3, -5.7))
def test_a_contact_bears_tension_up_to_its_strength(k, strength, rate):
    """It debonds where k w is the strength, and the energy of the spring, less that of the bonds, becomes heat."""
    paths = {"interface.limits.tensile-strength.t_max": strength, "mechanics.normal.k": k}
    solution = run(TORN, paths | {"loading.w_n.ramp.rate": rate})
    jumps, when = solution.trajectory.jumps, strength / (k * rate)
    assert [jump.edge.name for jump in jumps] == ["debond"] * (when < 3.0)
    if jumps:
        assert jumps[0].t == pytest.approx(when, rel=1e-9)
        assert jumps[0].released == pytest.approx(strength**2 / (2 * k) - 0.5e-6, rel=1e-8)
    assert solution.dataset["t_n"].values.max() <= strength * (1 + 1e-9)
