"""Scenes that jump in a reactor network: the compiled path's events, states and books."""

from itertools import pairwise

import cantera as ct
import numpy as np
import pytest

import surfacechem
from surfacechem.errors import InputError
from surfacechem.reactor import InterfaceReactor, InterfaceStopped, ReactorNet

pytestmark = pytest.mark.around

CASES = {"debonding": 1e-12, "stick-slip": 1e-7}
"""How closely Cantera's integrator meets events and states at its tolerance, relative to their largest."""


def network(case, **bodies) -> tuple[InterfaceReactor, ReactorNet]:
    interface = InterfaceReactor(case, **bodies)
    net = ReactorNet([*interface.bodies.values(), interface])
    net.rtol, net.atol = 1e-10, 1e-16
    return interface, net


def compare(interface, solution, within):
    ours, theirs = interface.scene.events.instant.jumps, solution.trajectory.jumps
    assert [jump.edge.name for jump in ours] == [jump.edge.name for jump in theirs]
    end = solution.trajectory.run.times[-1]
    np.testing.assert_allclose([j.t for j in ours], [j.t for j in theirs], atol=within * end, rtol=0)
    for state in interface.scene.states:
        column = solution.dataset[state].values
        assert interface[state] == pytest.approx(column[-1], abs=within * np.abs(column).max(), rel=0)


GAS = """
phases: [{name: gas, thermo: ideal-gas, species: [N2], state: {T: 300 K, P: 1 atm}}]
species: [{name: N2, composition: {N: 2}, thermo: {model: constant-cp, cp0: 30 J/mol/K}}]
"""
CLOCK = """
title: A plate that is heated at a constant power
T_0: 300 K
bodies:
  plate: {temperature: T, C: 1 J/m^2/K, capacity: constant}
  block: {temperature: T, C: 1 J/m^2/K, capacity: constant}
interface: {temperature: T}
loading: {Q_1: 2 W/m^2}
initial: {T: 300 K}
run: {until: 1 s}
"""


@pytest.mark.parametrize("beside", [[], [GAS]])
def test_events_that_depend_on_another_interface(beside):
    """Its state is that of the time at which a guard is wanted, and its step may be short after a jump of the other."""
    block, clock = InterfaceReactor("stick-slip"), InterfaceReactor(CLOCK)
    block.load("p", lambda _: 1e5 * (clock["T"] - 299.5))
    net = ReactorNet([clock, *(ct.IdealGasReactor(ct.Solution(yaml=gas), clone=True) for gas in beside), block])
    net.rtol, net.atol = 1e-10, 1e-14
    net.advance(0.9)
    data = block.dataset  # the spring pulls with 1e5 t, and the static friction is 0.6 p
    assert list(data["event_name"].values) == ["slip forward", "stop"]
    assert float(data["event_time"][0]) == pytest.approx(0.75, rel=1e-9)


@pytest.mark.parametrize(("name", "end", "within"), [("stick-slip", 1.2, 1e-7), ("dna-adhesive", 10.0, 1e-8)])
def test_balances_of_an_interface_with_a_load_from_the_network(name, end, within):
    """The integrator steps over the work at rest, and its first steps are too long for the entropy of first bonds."""
    interface = InterfaceReactor(name)
    interface.load("Q_1", 0.0)
    net = ReactorNet([interface])
    net.rtol = 1e-9
    net.advance(end)
    assert max(interface.dataset.attrs[f"{kind}_error"] for kind in ("energy", "entropy", "site")) < within


@pytest.mark.parametrize("name", CASES)
def test_events_and_states_of_the_compiled_path(name):
    end = {"stick-slip": "1.2 s"}.get(name, "10 s")
    solution = surfacechem.load(name, {"run.outputs": 11, "run.until": end}).run()
    interface, net = network(name)
    for t in solution.dataset["time"].values[1:]:
        net.advance(float(t))
    compare(interface, solution, CASES[name])


def test_the_books_hold_what_jumps_release():
    name = "debonding"
    solution = surfacechem.load(name).run()
    interface, net = network(name)
    net.advance(solution.trajectory.run.times[-1])
    history, data = interface.dataset, solution.dataset
    for account in ("released", "entropy_events"):
        size = max(abs(float(data[account][-1])), 1e-3 * float(np.abs(data["E_total"]).max()))
        assert float(history[account][-1]) == pytest.approx(float(data[account][-1]), abs=1e-5 * size)
    assert history.attrs["energy_error"] < 1e-7
    table = [str(name) for name in history["event_name"].values]
    assert table == [jump.edge.name for jump in solution.trajectory.jumps]


def test_endless_rebounds_end_in_a_network_too():
    """It does not follow as many of them as the compiled path."""
    interface, net = network("bouncing-plate", overrides=["mechanics.normal.e=0.1"])
    net.advance(1.0)
    jumps = interface.scene.events.instant.jumps
    assert [jump.edge.name for jump in jumps] == (len(jumps) - 1) * ["impact"] + ["rest"]
    fall = (2 * 1.0 / 9.81) ** 0.5
    assert jumps[-1].t == pytest.approx(fall * (1 + 2 * 0.1 / (1 - 0.1)), rel=1e-6)
    assert (interface["g_n"], interface["v_n"]) == (0.0, 0.0)


def test_single_steps_end_at_the_event():
    interface, net = network("stick-slip")
    times = []
    while net.time < 0.7:
        times.append(net.step())
    assert [jump.edge.name for jump in interface.scene.events.instant.jumps][:2] == ["slip forward", "stop"]
    for jump in interface.scene.events.instant.jumps:
        assert min(abs(t - jump.t) for t in times) < 1e-15
    assert all(later > before for before, later in pairwise(times))


CHAMBER = """
bodies:
  block: {{temperature: T_1, C: 500 J/m^2/K, capacity: constant}}
  chamber: {chamber}
interface:
  temperature: T_1
  friction: [coulomb: {{mu: 0.4, mu_s: 0.6}}]
mechanics: {{tangential: {{k: 100 MPa/m, m: 10 kg/m^2}}}}
heat: [conductance: {{between: [block, chamber], h: 200 W/m^2/K}}]
loading: {{p: 0.1 MPa, w_t: {{ramp: {{rate: 1 mm/s}}}}}}
T_0: 300 K
initial: {{T_1: 310 K{also}}}
run: {{until: 1.2 s, outputs: 5}}
"""


def test_beside_a_closed_chamber():
    """A gas of constant heat capacity in a closed chamber is a body with that capacity."""
    chamber = ct.IdealGasReactor(ct.Solution(yaml=GAS), clone=True, volume=2.0)
    capacity = chamber.mass * chamber.phase.cv_mass / 0.5
    body = f"{{temperature: T_2, C: {capacity:.17g}, capacity: constant}}"
    solution = surfacechem.load(CHAMBER.format(chamber=body, also=", T_2: 300 K")).run(error="balances")
    alone = CHAMBER.format(chamber="{temperature: 300 K}", also="")
    interface, net = network(alone, area=0.5, bodies={"chamber": chamber})
    net.advance(1.2)
    compare(interface, solution, 1e-7)
    assert pytest.approx(float(solution.dataset["T_2"][-1]), rel=1e-8) == chamber.T
    assert float(solution.dataset["T_2"][-1]) > 300.05


HEATED = """
bodies: {plate: {temperature: 300 K}, chamber: {temperature: 300 K}}
interface:
  temperature: T_c
  friction: [coulomb: {mu: {value: 0.5, times: [linear: {of: T_c, slope: -0.002, about: 300}]}}]
heat: [conductance: {between: [plate, interface], h: 1e7}, conductance: {between: [chamber, interface], h: 1e7}]
mechanics: {tangential: {k: 1 MPa/mm, c_b: 1e6 Pa s/m}}
loading: {p: 1 MPa, w_t: 0.4 mm}
initial: {T_c: 300 K}
run: {until: 3 s}
"""


def test_a_slip_begins_where_a_gas_has_warmed_the_contact_enough():
    """The temperature of the gas inside a step is that of the step, not that of the last evaluation."""
    chamber, around = (ct.IdealGasReactor(ct.Solution(yaml=GAS), clone=True) for _ in range(2))
    around.phase.TP = 600, ct.one_atm
    around.syncState()
    ct.Wall(chamber, ct.Reservoir(around.phase, clone=True), U=chamber.mass * chamber.phase.cv_mass)
    interface, net = network(HEATED, area=1e-14, bodies={"chamber": chamber})
    net.rtol = 1e-6
    net.advance(3.0)
    # Friction has fallen to the force of the spring at 400 K, between 300 K and a chamber at 500 K.
    assert [jump.edge.name for jump in interface.scene.events.instant.jumps] == ["slip forward"]
    assert interface.scene.events.instant.jumps[0].t == pytest.approx(np.log(3.0), abs=1e-4)
    _, net = network(HEATED, bodies={"chamber": ct.Reactor(ct.Solution(yaml=GAS), clone=True)})
    with pytest.raises(InputError, match=r"of which only the energy is known inside a step\. Let it"):
        net.advance(3.0)


def test_a_load_that_reads_a_gas_decides_no_jump():
    """Its value inside a step is not known; that of a time would be."""
    chamber, outside = (ct.IdealGasReactor(ct.Solution(yaml=GAS), clone=True) for _ in range(2))
    ct.Wall(chamber, outside, Q=lambda t: 1e3 * t)
    block, message = InterfaceReactor("stick-slip"), "depends on the load p, which reads a reactor that cannot be set"
    block.load("p", lambda _: chamber.phase.P)
    net = ReactorNet([chamber, outside, block])
    with pytest.raises(InputError, match=message):
        net.advance(0.6)


def test_accounts_beside_a_gas_are_those_beside_a_body():
    """The first bonds produce entropy that the integrator's steps do not resolve; what the gas receives is its sum."""
    chamber = ct.IdealGasReactor(ct.Solution(yaml=GAS), clone=True, volume=2.0)
    body = {"temperature": "T_2", "C": chamber.mass * chamber.phase.cv_mass / 0.5, "capacity": "constant"}
    changes = {"bodies.upper": body, "initial.T_2": "300 K", "run.until": "10 s", "run.rtol": 1e-12}
    known = surfacechem.load("dna-adhesive", changes).run(error="balances").dataset
    held = {"bodies.upper": {"temperature": "300 K"}, "initial.T_2": None}
    interface = InterfaceReactor("dna-adhesive", held, area=0.5, bodies={"upper": chamber})
    net = ReactorNet([chamber, interface])
    net.rtol = 1e-9
    before = chamber.mass * chamber.phase.int_energy_mass
    net.advance(10.0)
    data = interface.dataset
    for account in ("entropy_R1", "heat_R1", "entropy_q_1c", "entropy_q_2c", "heat_into_1"):
        assert float(data[account][-1]) == pytest.approx(float(known[account][-1]), rel=1e-5)
    assert max(data.attrs[f"{kind}_error"] for kind in ("energy", "entropy", "site")) < 1e-6
    gained = chamber.mass * chamber.phase.int_energy_mass - before
    assert 0.5 * float(data["heat_into_2"][-1]) == pytest.approx(gained, rel=1e-5)


def test_a_reactor_takes_no_heat_at_once():
    pulled = [
        "bodies.upper={temperature: 300 K, stiffness: 2e13 Pa/m}",
        "heat=[{conductance: {between: [lower, upper], h: 10}}]",
    ]
    chamber = ct.IdealGasReactor(ct.Solution(yaml=GAS), clone=True)
    _, net = network("debonding", bodies={"upper": chamber}, overrides=pulled)
    with pytest.raises(InputError, match=r"a reactor takes heat in time only. Give the body a heat capacity"):
        net.advance(10.0)


def test_an_ordinary_network_is_refused_where_it_would_go_on_beyond_a_jump():
    interface = InterfaceReactor("debonding")
    net = ct.ReactorNet([interface])
    net.advance(1.0)
    with pytest.raises(Exception, match=r"the scene jumps \(.*Use surfacechem\.reactor\.ReactorNet"):
        net.advance(10.0)


def test_what_a_jump_refuses_ends_the_scene():
    _, net = network("debonding-cooling", overrides=["interface.limits.tensile-strength.violation=refuse"])
    with pytest.raises(InterfaceStopped, match=r"which destroys entropy at t = 3.87298335 s"):
        net.advance(10.0)


def test_quasi_static_folds_are_refused():
    with pytest.raises(InputError, match=r"may lose its quasi-static equilibrium.* Give the gap a damper or a mass"):
        InterfaceReactor("snap-in")


def test_sensitivities_end_at_an_event():
    interface = InterfaceReactor("stick-slip-rebonding")
    net = ReactorNet([interface])
    interface.add_sensitivity_reaction(0)
    with pytest.raises(InputError, match="sensitivities end at"):
        net.advance(10.0)
