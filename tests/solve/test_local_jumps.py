"""Debonding for which the interface alone pays: the verdict is that of the gap as it is, and the gap follows after."""

import pytest

from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

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

K = 1 / (100e-6 / 2e9 + 150e-6 / 1e9)
SPRING = (40e6) ** 2 / (2 * K)


def run(
    stiffness=ELASTIC, release="local", violation="warn", interface=MEDIUM, heat=HEAT, initial=", T_c: 300 K", K_0=90
):
    text = CASE.format(
        interface=interface + stiffness,
        release=release,
        violation=violation,
        heat=heat,
        initial=initial,
        K_0=K_0,
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


def test_together_the_springs_pay():
    trajectory = run(release="joint").trajectory
    (jump,) = trajectory.jumps
    states = [state.name for state in trajectory.model.system.states]
    rises = dict(zip(states, jump.after.y - jump.before.y, strict=True))
    assert [1.2 * rises["T_1"], 0.9 * rises["T_2"]] == pytest.approx([jump.released / 4, 3 * jump.released / 4])
    assert jump.released == pytest.approx(SPRING + 16 - bonds(90), rel=1e-9)
    assert jump.verdict == "admissible"


def test_an_interface_without_heat_of_its_own_cannot_pay():
    with pytest.raises(InputError, match="the interface pays, but here it has no heat of its own"):
        run(interface="  potential:", heat="", initial="")
