"""Electrodes whose potential follows from charge: that of Cantera without current, and books of charge and energy."""

import cantera as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import surfacechem
from surfacechem.errors import InputError
from surfacechem.quantities import MOLECULAR
from surfacechem.reactor import InterfaceReactor, ReactingSolid, ReactorNet

CHARGE = 1.602176634e-19
FILLED, SOLUTION = [0.5, 0.5], [0.48, 0.37, 0.08, 0.07]
CASE = """
bodies: {{particle: {{temperature: 300 K}}, cell: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  mechanism:
    file: lithium_ion_battery.yaml
    phase: edge_anode_electrolyte
    neighbours:
      anode: {{composition: {{"Li[anode]": 0.5, "V[anode]": 0.5}}}}
      electrolyte:
        composition: {{"C3H4O3[elyt]": 0.48, "C4H6O3[elyt]": 0.37, "Li+[elyt]": 0.08}}
        rest: "PF6-[elyt]"
      electron: {{{electron}}}
initial: {{coverages: {{(dummy): 1}}}}
run: {{until: {until}, outputs: 41, solver: cantera, rtol: 1e-8}}
"""


def case(electron, until="1 s"):
    return CASE.format(electron=electron, until=until)


@pytest.fixture(scope="module")
def edge():
    """Cantera's interface in the state of the case."""
    found = ct.Interface("lithium_ion_battery.yaml", "edge_anode_electrolyte")
    found.adjacent["anode"].X, found.adjacent["electrolyte"].X = FILLED, SOLUTION
    for phase in (found, *found.adjacent.values()):
        phase.TP = 300.0, ct.one_atm
    return found


def current(edge, volts):
    """Electric current of the reactions into the electrode [A/m^2]."""
    edge.adjacent["electron"].electric_potential = volts
    return -edge.get_net_production_rates("electron")[0] * ct.faraday


def test_without_a_current_it_finds_open_circuit(edge):
    data = surfacechem.load(case("electric-potential: -3.3 V, capacitance: 20 uF/cm^2")).run(error="balances").dataset
    known = solve_ivp(lambda _, V: [current(edge, V[0]) / 0.2], (0, 1), [-3.3], method="LSODA", rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(data["V_electron"][-1], known.y[0, -1], atol=1e-7)
    open_circuit = brentq(lambda V: current(edge, V), -3.3, -2.5, xtol=1e-12)
    assert float(data["V_electron"][-1]) == pytest.approx(open_circuit, abs=1e-7)


def test_under_a_current_the_reactions_come_to_carry_it(edge):
    text = "electric-potential: -2.9 V, capacitance: 0.2 F/m^2, current: -3 A/m^2"
    solution = surfacechem.load(case(text, until="5 s")).run(error="balances")
    data = solution.dataset
    carried = brentq(lambda V: current(edge, V) - 3.0, -3.3, -2.5, xtol=1e-12)
    assert float(data["V_electron"][-1]) == pytest.approx(carried, abs=1e-7)
    assert float(data["i_electron"][-1]) == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("shift", [0.0, 2.967022365221])
def test_at_rest_under_a_current(edge, shift):
    """The reaction carries what is given, whatever its rate constant; the potential, near zero too, makes up for it."""
    text = case(f"electric-potential: {shift - 2.9} V, capacitance: 0.2 F/m^2, current: -3 A/m^2")
    text = text.replace('rest: "PF6-[elyt]"', f'rest: "PF6-[elyt]"\n        electric-potential: {shift} V')
    rest = surfacechem.steady(text, of=["i_electron", "q_n"])
    assert rest.coverages == {"(dummy)": 1.0}
    carried = brentq(lambda V: current(edge, V) - 3.0, -3.3, -2.5)
    assert rest.states["V_electron"] == pytest.approx(carried + shift, abs=1e-9)
    assert rest.rates["i_electron"] == pytest.approx(3.0, rel=1e-9)
    assert rest.control["i_electron"]["R1"] == pytest.approx(0.0, abs=1e-6)
    assert f"V_electron  {carried + shift:.6g} V" in str(rest)


def test_beside_a_particle_that_fills(tmp_path):
    """All charge from outside is in the double layer or has become lithium of the particle."""
    (tmp_path / "case.yaml").write_text(
        case("electric-potential: -2.9 V, capacitance: 0.2 F/m^2, current: -3 A/m^2", until="40 s")
    )
    graphite = ct.Solution("lithium_ion_battery.yaml", "anode")
    graphite.TPX = 300.0, ct.one_atm, FILLED
    particle = ReactingSolid(graphite, mass=1e-3)
    cell = InterfaceReactor(tmp_path / "case.yaml", neighbours={"anode": particle})
    net, before = ReactorNet([particle, cell]), particle.amounts[0]
    net.rtol, net.atol = 1e-9, 1e-14
    net.advance(40.0)
    stored = 0.2 * (cell["V_electron"] + 2.9)
    became = -(particle.amounts[0] - before) * CHARGE * MOLECULAR
    assert became < -100
    assert stored + became == pytest.approx(-3.0 * 40.0, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("capacitance: 1 F/m^2", "no reaction brings charge to anode, and no `current` does"),
        (
            "electric-potential: -3 V",
            "`electric-potential` of the neighbour anode is without effect, since its species",
        ),
    ],
)
def test_a_phase_that_gets_no_charge_is_refused(key, message):
    text = case("electric-potential: -3 V").replace('"V[anode]": 0.5}', f'"V[anode]": 0.5}}, {key}', 1)
    with pytest.raises(InputError, match=message):
        surfacechem.load(text).model  # noqa: B018


@pytest.mark.parametrize(
    ("electron", "message"),
    [
        ("current: 1 A/m^2", "the current into the neighbour electron needs a `capacitance`"),
        (
            "electric-potential: {ramp: {rate: 1 V/s}}, capacitance: 1 F/m^2",
            "the potential of the neighbour electron follows from its charge",
        ),
        ("capacitance: 0 F/m^2", "capacitance = 0 is outside its range: > 0"),
        ("capacitance: 20 uF", "20 uF is a capacitance; capacitance needs a capacitance per area"),
        ("capacitence: 1 F/m^2", "Did you mean 'capacitance'"),
    ],
)
def test_what_is_refused(electron, message):
    with pytest.raises(InputError, match=message) as refused:
        surfacechem.load(case(electron)).model  # noqa: B018
    assert refused.value.place.line == 13
