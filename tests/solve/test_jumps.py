"""Jumps: the work of dead loads, gaps that share pressure, areas, and what an interface bears after it has debonded."""

import pytest
from scenes import bodies, path, together, varying
from solved import closed, solve

from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.factors import LinearInTemperature
from surfacechem.laws.free_energy import BondEnergy, NormalStiffness
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Interface, Mounting, Scene

PULLED, STIFF = {"w_n": Ramp(rate=1e-6)}, Mounting(k=1e12)


@pytest.mark.parametrize("J_c", [0.5, 2.0])
def test_sticking_bears_friction_on_the_current_area(J_c):
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=1e-6), "J_c": Hold(level=J_c)}
    trajectory = closed(together((), [Coulomb(mu=0.5)], loading, tangential=Mounting(k=5e10)), 5.0)
    assert trajectory.of("slip forward")[0].t == pytest.approx(J_c * 0.5 * 1e5 / (5e10 * 1e-6), rel=1e-12)


def test_a_rigid_interface_that_has_debonded_bears_no_tension():
    drive = Table(times=[0.0, 2.0, 4.0, 6.0], values=[0.0, 2e-6, -2e-6, 2e-6])
    given = {"loading": {"w_n": drive}, "initial": {"phi": 1.0}, "limits": [TensileStrength(t_max=1e6)]}
    first, second = solve(together([BondEnergy(K_0=0.1)], **given, normal=STIFF), 6.0).of("debond")
    assert (first.t, second.t) == pytest.approx((1.0, 5.0), rel=1e-9)
    assert second.released == pytest.approx(0.0, abs=1e-9)


def test_a_dead_shear_load_sticks_up_to_the_limit_and_ends_there():
    trajectory = solve(together((), [Coulomb(mu=0.5)], {"p": Hold(level=1e5), "F_t": Ramp(rate=1e4)}), 10.0)
    assert trajectory.status == "stopped"
    assert "dead load" in trajectory.reason
    assert trajectory.result.t == pytest.approx(5.0, rel=1e-12)


def test_a_quasi_static_gap_without_heat_capacity_but_with_thermal_traction_is_refused():
    spring = NormalStiffness(E_n=varying(1e12, LinearInTemperature(slope=-1e-3)))
    heat, initial = [path(end, "interface", 100.0) for end in ("lower", "upper")], {"T_1": 300.0, "T_2": 310.0}
    with pytest.raises(InputError, match="no capacity"):
        assemble(Scene(bodies(), Interface("T_c", [spring]), heat, PULLED, None, 300.0, initial, normal=STIFF))


# -- debonding for which the interface alone pays ---------------------------------------------------------------------

CASE = """
T_0: 300 K
bodies:
  a: {{temperature: T_1, capacity: constant, C: 1.2 J/m^2/K, E: 2 GPa, H: 100 um}}
  b: {{temperature: T_2, capacity: constant, C: 0.9 J/m^2/K, E: 1 GPa, H: 150 um}}
interface:
  sites: 1e18 1/m^2
{interface}
    - bond-energy: {{K_0: {K_0} J/m^2}}
  limits:
    - tensile-strength: {{t_max: 40 MPa, release: {release}, violation: {violation}}}
mechanics: {{normal: {{beta_1: 0.25}}}}
{heat}
loading: {{w_n: {{ramp: {{rate: 2 um/s}}}}}}
initial: {{T_1: 310 K, T_2: 290 K, phi: 0.8{initial}}}
run: {{until: 8 s, outputs: 7}}
"""
MEDIUM = "  temperature: T_c\n  potential:\n    - interface-capacity: {C_c: 0.5 J/m^2/K}"
HEAT = "heat: " + str([{"conductance": {"between": [end, "interface"], "h": 1e-3}} for end in "ab"]).replace("'", "")
ELASTIC, RIGID = "\n    - bonded-contact: {E_n: 5e13 Pa/m}", ""

STIFFNESS = 1 / (100e-6 / 2e9 + 150e-6 / 1e9)
SPRING = (40e6) ** 2 / (2 * STIFFNESS)


def run(
    stiffness=ELASTIC, release="local", violation="warn", interface=MEDIUM, heat=HEAT, initial=", T_c: 300 K", K_0=90
):
    text = CASE.format(
        interface=interface + stiffness, release=release, violation=violation, heat=heat, initial=initial, K_0=K_0
    )
    return Simulation(load_text(text)).run(error="balances")


def bonds(K_0):
    return K_0 / 2 * 0.8 * (2 - 0.8)


@pytest.mark.parametrize(("stiffness", "stored"), [(ELASTIC, 16.0), (RIGID, 0.0)])
@pytest.mark.parametrize(("K_0", "verdict"), [(90, "destroys entropy"), (20, None)])
def test_the_interface_pays_and_then_the_gap_follows(stiffness, stored, K_0, verdict):
    solution = run(stiffness, K_0=K_0)
    first, second = solution.trajectory.jumps
    assert [first.edge.name, second.edge.name] == ["debond", "relax" if stored else "open"]
    assert first.t == second.t
    assert first.released == pytest.approx(stored - bonds(K_0), rel=1e-9)
    assert second.released == pytest.approx(SPRING, rel=1e-9)
    assert first.verdict == (verdict or ("admissible" if stored else "destroys entropy"))
    assert second.verdict == "admissible"
    states = [state.name for state in solution.trajectory.model.system.states]
    change = dict(zip(states, first.after.y - first.before.y, strict=True))
    assert change["T_1"] == change["T_2"] == change.get("g_n", 0.0) == 0.0
    assert solution.audit.energy_error < 1e-12
    assert solution.audit.violations == ()


def test_a_local_jump_that_destroys_entropy_may_be_refused():
    trajectory = run(violation="refuse").trajectory
    assert trajectory.status == "stopped"
    assert "debonds as its tensile strength is reached, which destroys entropy" in trajectory.reason


def test_an_interface_without_heat_of_its_own_cannot_pay():
    with pytest.raises(InputError, match="the interface pays, but here it has no heat of its own"):
        run(interface="  potential:", heat="", initial="")


PRESSED = """
bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}
interface: {temperature: 300 K, potential: [penalty: {E_n: 1 GPa/m}], friction: [coulomb: {mu: 0.5}]}
mechanics: {normal: {k: 1 GPa/m}, tangential: {k: 1 GPa/m}}
programme: [press: {w_n: -SPEED, until: {p: 1 MPa}}, shear: {w_t: 1 mm/s, for: 0.1 s}]
initial: {w_n: 1 mm, g_n: 1 mm, w_t: 0}
run: {until: 20 s}
"""


@pytest.mark.parametrize("speed", ["1 mm/s", "0.7 mm/s", "0.3 mm/s"])
def test_a_touch_within_the_rounding_of_its_gap_destroys_no_entropy(speed):
    trajectory = Simulation(load_text(PRESSED.replace("SPEED", speed))).run().trajectory
    assert [jump.edge.name for jump in trajectory.jumps][:2] == ["touch", "end of press"]
    assert {jump.verdict for jump in trajectory.jumps} == {"admissible"}
