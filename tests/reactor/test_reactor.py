"""The interface as a reactor: what a run computes, in a Cantera network."""

import gc
import math

import cantera as ct
import numpy as np
import pytest
from sampling import every

import surfacechem
from surfacechem.errors import InputError
from surfacechem.reactor import InterfaceReactor, InterfaceStopped, ReactorNet

pytestmark = pytest.mark.around

RTOL = 1e-9
LOOSE = 1e-6
"""Cantera's integrator misses its tolerance by some orders of magnitude."""


def network(*arguments, others=(), **options):
    interface = InterfaceReactor(*arguments, **options)
    net = ReactorNet([*others, interface])
    net.rtol = RTOL
    return interface, net


def states(solution):
    result = solution.trajectory.result
    return dict(zip((s.name for s in solution.trajectory.model.system.states), result.outputs.T, strict=True))


def compare(solution, dataset, tolerance=LOOSE):
    names = states(solution)
    for name, values in names.items():
        scale = np.abs(values).max()
        np.testing.assert_allclose(dataset[name].values, values, atol=tolerance * scale, rtol=0)


@pytest.mark.parametrize(
    ("entry", "arguments"),
    [
        (InterfaceReactor, ("exothermic", {"interface.kapa": 1.0})),
        (InterfaceReactor, ("exothermic", {"interface.potential.bond-energy.K_0": "300 J/m^3"})),
        (surfacechem.load, ("exothermic", {"interface.kapa": 1.0})),
    ],
)
def test_the_traceback_of_a_wrong_input_ends_at_the_call(entry, arguments):
    """One frame of ours is left, which raises."""
    with pytest.raises(InputError) as caught:
        entry(*arguments)
    assert [frame.name for frame in caught.traceback] == [
        "test_the_traceback_of_a_wrong_input_ends_at_the_call",
        "called",
    ]


@pytest.mark.parametrize("name", ["exothermic", "dna-adhesive", "three-temperatures-no-capacity", "lubricated-sliding"])
def test_same_trajectory_as_a_run(name):
    solution = surfacechem.run(name)
    interface, net = network(name)
    for t in solution.trajectory.result.times[1:]:
        net.advance(t)
    dataset = interface.dataset
    compare(solution, dataset)
    ours, theirs = set(dataset.variables), set(solution.dataset.variables)
    assert {n for n in ours ^ theirs if not n.endswith("_exact")} == set()
    assert dataset.attrs["energy_error"] < 1e-6
    assert dataset.attrs["reason"] == solution.reason
    assert interface.seconds_per_rate > 0


PULSE = """
bodies:
  lower: {temperature: T, C: 1 kJ/m^2/K, capacity: constant}
  upper: {temperature: T, C: 1 kJ/m^2/K, capacity: constant}
loading:
  Q_1: {table: {times: [0, 1, 1, 1.001, 1.001, 2], values: [0, 0, 1e6, 1e6, 0, 0]}}
T_0: 300
initial: {T: 300 K}
run: {until: 2 s}
"""


def test_creep_of_rate_and_state_friction():
    """Its velocity is searched for: CVODE, differentiating by 1e-27 m, is not to divide what searches differ by."""
    case = surfacechem.load("rate-and-state-stick-slip", {"run": {"until": "100 s", "outputs": 11, "rtol": 1e-10}})
    interface, net = network(case.case)
    for t in np.linspace(10.0, 100.0, 10):
        net.advance(t)
    compare(case.run(), interface.dataset)


@pytest.mark.parametrize("stepwise", [False, True])
def test_no_breakpoint_is_stepped_over(stepwise):
    interface, net = network(PULSE)
    if stepwise:
        while net.time < 2:
            net.step()
    else:
        net.advance(np.nextafter(1.0, 2.0))  # CVODE starts no step as short
        net.advance(2)
    assert {0.0, 1.0, 1.001} <= set(interface.dataset.time.values)
    assert interface["T"] == pytest.approx(300.5, rel=1e-10)


def test_an_ordinary_net_refuses_to_step_over_a_breakpoint():
    net = ct.ReactorNet([InterfaceReactor(PULSE)])
    with pytest.raises(ct.CanteraError, match=r"breakpoint at t = 1 s.*Use surfacechem\.reactor\.ReactorNet"):
        net.advance(2)


RAMP = """
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface: {sites: 1e14 1/m^2, temperature: 300 K, bonding: [bell: {k_off: 0.1 1/s, x_off: 0.4 nm}]}
loading: {f: {ramp: {rate: 5 pN/s}}}
initial: {phi: 1}
run: {until: 4 s}
"""


def test_an_ordinary_net_tells_no_time():
    """What follows a history is not given for another moment than the one that is asked for."""
    interface = InterfaceReactor(RAMP)
    net = ct.ReactorNet([interface])
    assert interface["f"] == 0.0
    net.advance(2)
    assert interface["phi"] < 1
    with pytest.raises(InputError, match=r"at what time f is wanted.*interface\.record\(net\.time\)"):
        interface["f"]
    interface.record(net.time)
    assert interface["f"] == pytest.approx(10e-12, rel=1e-12)
    steady = InterfaceReactor("exothermic")
    net = ct.ReactorNet([steady])
    net.advance(0.1)
    assert steady["R_linear_affinity"] > 0


def test_the_time_is_known_before_a_network_with_a_wall_runs():
    interface = InterfaceReactor("stick-slip")
    interface.body("lower")
    assert interface["w_t"] == 0.0


def test_the_end_of_a_scene_is_found_and_said(capfd):
    solution = surfacechem.run("cooling-to-zero")
    interface, net = network("cooling-to-zero")
    with pytest.raises(InterfaceStopped, match="the temperature T reached zero near t = "):
        net.advance(surfacechem.load("cooling-to-zero").case.run.times[-1])
    assert interface.dataset.attrs["status"] == "stopped"
    assert interface.dataset.time.values[-1] == pytest.approx(solution.trajectory.result.t, rel=1e-5)
    assert interface.evaluations < 50_000
    assert capfd.readouterr().err == ""  # SUNDIALS would warn of steps that are none


@pytest.mark.parametrize("neighbour", [False, True], ids=["its own", "a neighbour's"])
def test_an_error_inside_stops_at_once_with_its_message(neighbour, warm, monkeypatch):
    """Also where a gas that stands for a body is the first to ask."""
    gas = stirred(350.0)
    interface, net = network(warm, bodies={"upper": gas}, others=[gas]) if neighbour else network("exothermic")
    net.advance(0.01)
    before = interface.evaluations

    def broken(t, x):
        raise ZeroDivisionError("the real message")

    monkeypatch.setattr(interface.scene, "rates", broken)
    with pytest.raises(ZeroDivisionError, match="the real message"):
        net.advance(1.0)
    assert interface.evaluations - before < 20


def test_components_have_names():
    interface, net = network("dna-adhesive")
    net.advance(1e-3)
    assert interface.n_vars == len(interface.names)
    assert interface.component_index("T_c") == interface.names.index("T_c")
    assert net.component_name(0) == f"interface: {interface.names[0]}"
    assert net.solver_stats["rhs_evals"] > 0
    with pytest.raises(InputError, match=r"interface has no component 'Tc'\. Did you mean 'T_c'"):
        net.global_component_index("Tc", 0)


def test_sensitivity_to_a_rate():
    """phi = 1 - exp(-m t / tau), so d ln phi / d ln m = (m t / tau) exp(-m t / tau) / phi."""
    interface, net = network("exothermic")
    interface.add_sensitivity_reaction(0)
    net.rtol_sensitivity = net.atol_sensitivity = 1e-7
    net.advance(0.4)
    rate = -math.log1p(-interface["phi"])
    assert net.sensitivity("phi", 0) == pytest.approx(rate * math.exp(-rate) / interface["phi"], rel=1e-4)
    assert net.sensitivity_parameter_name(0) == "interface: open => linear_affinity"


def test_indices_are_those_of_the_reactors_as_given():
    """A sensitivity to a reaction of the second gas is that of the gases alone."""
    gas = ct.Solution("h2o2.yaml")

    def found(kind, *others):
        gases = []
        for T in (1000.0, 1300.0):
            gas.TPX = T, 1e5, "H2:2, O2:1, AR:5"
            gases.append(ct.IdealGasReactor(gas, clone=True))
        reactors = [*gases, *others]
        net = kind(reactors)
        gases[1].add_sensitivity_reaction(2)
        net.advance(1e-5)
        assert all(one is other for one, other in zip(net.reactors, reactors, strict=True))
        assert net.get_state()[net.global_component_index("temperature", 1)] == gases[1].T
        return net.sensitivity("H", 0, 1)

    assert found(ReactorNet, InterfaceReactor("dna-adhesive")) == pytest.approx(found(ct.ReactorNet), rel=1e-4)


def test_names_that_occur_twice_get_numbers():
    interfaces = [InterfaceReactor("exothermic") for _ in range(3)]
    ReactorNet([*interfaces, InterfaceReactor("exothermic", name="glue")])
    assert [interface.name for interface in interfaces] == ["interface", "interface_2", "interface_3"]


@pytest.mark.parametrize("beside", ["exothermic", "debonding"])
def test_what_a_script_changes_takes_effect_at_once(beside):
    """The integrator has been beyond the present time, with what was before; in another way where a scene jumps."""
    interface, net = network("exothermic", others=[InterfaceReactor(beside)])
    net.advance(0.05)
    before = interface["phi"]
    interface.phase.set_multiplier(0.0)
    net.advance(0.2)
    assert interface["phi"] == pytest.approx(before, rel=1e-12)


@pytest.fixture
def warm(tmp_path):
    """The plates of DNA bonds, one of them cold and kept so."""
    path = tmp_path / "warm.yaml"
    changes = {"bodies.upper": {"temperature": "300 K"}, "initial.T_2": None}
    path.write_text(surfacechem.load("dna-adhesive", changes).case.text)
    return path


def stirred(temperature, **options):
    gas = ct.Solution("air.yaml")
    gas.TPX = temperature, ct.one_atm, "N2: 1"
    return ct.IdealGasReactor(gas, clone=True, **options)


CHANGES = [
    lambda at: setattr(at["feed"], "mass_flow_rate", lambda t: 1e-6 * t),
    lambda at: setattr(at["feed"], "mass_flow_rate", 1e-4),
    lambda at: setattr(at["wall"], "heat_flux", 1.0),
    lambda at: setattr(at["wall"], "heat_transfer_coeff", 1e3),
    lambda at: (setattr(at["source"].phase, "TPX", (500.0, ct.one_atm, "O2: 1")), at["source"].syncState()),
    lambda at: (setattr(at["oven"].phase, "TP", (500.0, ct.one_atm)), at["oven"].syncState()),
    lambda at: (at["wall"].__setattr__("area", 10.0), setattr(at["gas"], "energy_enabled", False)),
    lambda at: setattr(at["wall"], "area", 10.0),
]


@pytest.mark.parametrize("change", every(2, CHANGES))
def test_what_a_script_changes_around_a_gas_takes_effect_at_once(change):
    """As after ``reinitialize``; without a change nothing starts anew."""
    found = []
    for anew in (False, True):
        gas = stirred(300.0, volume=1e-5)
        source, oven, outside = (ct.Reservoir(stirred(T).phase, clone=True) for T in (300.0, 400.0, 300.0))
        feed = ct.MassFlowController(source, gas, mdot=1e-7)
        ct.PressureController(gas, outside, primary=feed, K=1e-7)
        wall = ct.Wall(gas, oven, A=1e-4, U=1.0)
        net = ReactorNet([gas, InterfaceReactor("exothermic")])
        net.advance(0.5)
        steps = net.solver_stats["steps"]
        net.advance(0.51)
        assert net.solver_stats["steps"] >= steps
        before = gas.phase.T, *gas.phase["N2", "O2"].X
        change({"gas": gas, "source": source, "oven": oven, "feed": feed, "wall": wall})
        if anew:
            net.reinitialize()
        net.advance(1.5)
        found.append((gas.phase.T, *gas.phase["N2", "O2"].X))
    assert found[0] == pytest.approx(found[1], rel=1e-8)
    assert found[0] != pytest.approx(before, rel=1e-5) or not gas.energy_enabled


def energy(gas):
    return gas.mass * gas.phase.int_energy_mass


def test_a_stirred_gas_as_the_second_body(warm):
    """What the scene loses the gas receives, to the accuracy of the run."""
    gas = stirred(350.0, volume=3.0)
    interface, net = network(warm, area=0.7, bodies={"upper": gas}, others=[gas])
    before = interface["E_total"] * interface.area + energy(gas)
    warmth = energy(gas)
    for t in np.linspace(0.1, 5, 20):
        net.advance(t)
    after = interface["E_total"] * interface.area + energy(gas)
    exchanged = abs(energy(gas) - warmth)
    assert exchanged > 1e4
    assert after == pytest.approx(before, abs=1e-7 * exchanged)
    assert gas.T < 349
    dataset = interface.dataset
    np.testing.assert_allclose(dataset["T_2"][-1], gas.T)
    assert dataset.attrs["energy_error"] < 1e-7
    assert dataset.attrs["case"] == ""


def test_heat_through_a_wall():
    """A body and a gas of constant capacity behind a wall: the difference decays exponentially."""
    case = (
        "bodies:\n"
        "  lower: {temperature: T_1, C: 1 kJ/m^2/K, capacity: constant}\n"
        "  upper: {temperature: T_2, C: 1 kJ/m^2/K, capacity: constant}\n"
        "heat: [conductance: {between: [lower, upper], h: 10 W/m^2/K}]\n"
        "T_0: 300 K\ninitial: {T_1: 400 K, T_2: 300 K}\nrun: {until: 1 s}\n"
    )
    other, _ = network(case, overrides=["initial.T_2=350 K"])
    interface = InterfaceReactor(case, area=2.0)
    ct.Wall(other.body("upper"), interface.body("upper"), A=3.0, U=40.0)
    other.area = 2.0
    net = ReactorNet([interface, other])
    net.rtol = RTOL
    before = interface["E_total"] + other["E_total"]
    net.advance(20.0)
    rate = np.zeros((4, 4))  # T_1, T_2 of each, by hand
    for i, j, h in ((0, 1, 10.0), (2, 3, 10.0), (1, 3, 3.0 * 40.0 / 2.0)):
        rate[i, i] -= h / 1e3
        rate[j, j] -= h / 1e3
        rate[i, j] += h / 1e3
        rate[j, i] += h / 1e3
    values, vectors = np.linalg.eigh(rate)
    exact = vectors @ (np.exp(20.0 * values) * (vectors.T @ [400.0, 300.0, 400.0, 350.0]))
    found = [interface["T_1"], interface["T_2"], other["T_1"], other["T_2"]]
    np.testing.assert_allclose(found, exact, rtol=1e-8)
    assert interface["E_total"] + other["E_total"] == pytest.approx(before, abs=1e-6)


def test_an_area_has_its_unit():
    interface = InterfaceReactor("exothermic", area="2 cm^2")
    assert interface.area == pytest.approx(2e-4, rel=1e-15)
    interface.area = "3 cm^2"
    assert interface.area == pytest.approx(3e-4, rel=1e-15)


def test_a_chamber_may_be_a_reservoir():
    held = InterfaceReactor(PLATE, bodies={"chamber": ct.Reservoir(stirred(300.0).phase, clone=True)})
    net = ReactorNet([held])
    net.advance(1e6)
    assert held["T_1"] == pytest.approx(300.0, rel=1e-9)


@pytest.mark.parametrize(("kind", "error"), [(ReactorNet, InputError), (ct.ReactorNet, ct.CanteraError)])
def test_an_interface_that_is_not_in_the_network(kind, error):
    """A chamber, and a gas that presses, would go on at the rates of the start."""
    chamber, gas = (stirred(300.0, volume=1.0) for _ in range(2))
    lost = InterfaceReactor(PLATE, bodies={"chamber": chamber})
    pressed = InterfaceReactor(PISTON, area=0.01)
    pressed.press(gas, ct.Reservoir(gas.phase, clone=True))
    for interface, reactor in ((lost, chamber), (pressed, gas)):
        with pytest.raises(error, match=r"the interface interface to which .* is not in the network"):
            kind([reactor]).advance(1.0)
        kind([reactor, interface]).advance(0.1)


PLATE = """
bodies:
  plate: {temperature: T_1, C: 2 kJ/m^2/K, capacity: constant}
  chamber: {temperature: 298.15 K}
interface: {}
heat: [conductance: {between: [plate, chamber], h: 100 W/m^2/K}]
T_0: 300 K
initial: {T_1: 350 K}
run: {until: 100 s}
"""


def test_an_interface_is_no_sequence():
    """Python would ask it for the quantities 0, 1, 2."""
    with pytest.raises(TypeError, match="'InterfaceReactor' object is not iterable"):
        ReactorNet(InterfaceReactor("exothermic"))


def test_what_cantera_holds_stays_alive():
    """Cantera's part is made before the reactor is, and must not be collected in between."""
    threshold = gc.get_threshold()
    gc.set_threshold(50)
    try:
        interfaces = [network("exothermic")[0] for _ in range(3)]
        gc.collect()
        assert [interface.phase.multiplier(0) for interface in interfaces] == [1.0] * 3
    finally:
        gc.set_threshold(*threshold)


# -- what Cantera's own reactors offer ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("connect", "message"),
    [
        (lambda gas, interface: ct.Wall(gas, interface, U=10.0), r"Put it on one of them: interface.body\('lower'\)"),
        (lambda gas, interface: ct.MassFlowController(gas, interface, mdot=1e-3), "no volume to fill"),
        (lambda gas, interface: ct.MassFlowController(interface, gas, mdot=1e-3), "no volume to come from"),
        (lambda gas, interface: ct.Wall(gas, interface.body("upper"), velocity=1e-3), "moves, and its work"),
        (lambda gas, interface: ct.Wall(interface.body("upper"), gas, K=1e-3), "moves, and its work"),
        (lambda gas, interface: ct.MassFlowController(gas, interface.body("upper"), mdot=1e-3), "not mass"),
        (lambda gas, interface: ct.Valve(interface.body("upper"), gas, K=1.0), "not mass"),
        (lambda gas, interface: interface.add_sensitivity_species_enthalpy(0), "add_sensitivity_reaction"),
    ],
)
def test_connectors_that_would_lose_something_are_refused_and_carry_nothing(connect, message):
    gas, interface = stirred(300.0), InterfaceReactor("dna-adhesive", area=0.01)
    with pytest.raises(InputError, match=message):
        connect(gas, interface)
    before = gas.mass, gas.phase.int_energy_mass
    ReactorNet([gas, interface]).advance(0.05)
    assert (gas.mass, gas.phase.int_energy_mass) == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("kind", [ReactorNet, ct.ReactorNet])
def test_advance_limits_count_from_where_the_user_starts(kind):
    variable, limit = "T", 5.0
    interface = InterfaceReactor("exothermic")
    net = kind([interface])
    net.rtol = RTOL
    interface.set_advance_limit(variable, limit)
    values = [interface[variable]]
    for _ in range(3):
        assert net.advance(2.0) < 2.0
        values.append(interface[variable])
    changes = np.abs(np.diff(values))
    assert np.all(changes <= limit * (1 + LOOSE))
    assert np.all(changes > 0.4 * limit)


@pytest.mark.parametrize("kind", [ReactorNet, ct.ReactorNet])
def test_a_network_may_begin_at_any_time(kind):
    later, at_once = (InterfaceReactor("exothermic") for _ in range(2))
    for interface, start in ((later, 5.0), (at_once, 0.0)):
        net = kind([interface])
        net.rtol, net.initial_time = RTOL, start
        net.advance(start + 0.8)
    assert later.x == pytest.approx(at_once.x, rel=LOOSE)


@pytest.mark.parametrize("kind", [ReactorNet, ct.ReactorNet])
@pytest.mark.parametrize("case", ["exothermic", "stick-slip"])
def test_no_network_goes_back(kind, case):
    """Ours takes what is within rounding of the present for it."""
    net = kind([InterfaceReactor(case)])
    net.advance(0.1)
    with pytest.raises(ct.CanteraError, match="Cannot integrate backwards in time"):
        net.advance(0.05)
    if kind is ReactorNet:
        assert net.advance(math.nextafter(0.1, 0.0)) == net.advance(0.1) == 0.1
        assert net.advance(0.2) == 0.2


@pytest.mark.parametrize("t", [math.inf, math.nan, "1 s", None])
def test_a_time_that_is_no_finite_number_is_refused(t):
    with pytest.raises(InputError, match=f"advances to a finite time in s, not to {t!r}"):
        ReactorNet([InterfaceReactor("exothermic")]).advance(t)


def test_steady_states():
    case = "dna-adhesive"
    interface, net = network(case)
    residuals = net.advance_to_steady_state(return_residuals=True)
    assert residuals[-1] < 10 * RTOL
    end = surfacechem.run(case, ["run.until=1000"]).dataset.isel(time=-1)
    assert interface["phi"] == pytest.approx(float(end["phi"]), rel=LOOSE)
    with pytest.raises(InputError, match="Use advance_to_steady_state"):
        net.solve_steady()


# -- loads from the network --------------------------------------------------------------------------------------------


PISTON = """
title: A plate held by bonds over a chamber
T_0: 300 K
bodies:
  floor: {temperature: 300 K}
  plate: {temperature: 300 K, stiffness: 1e6 Pa/m}
interface:
  temperature: 300 K
  potential:
    - exponential-cohesive-zone: {t_max: 50 kPa, g_0: 1 mm, E_n: 1e9 Pa/m}
mechanics:
  normal: {c_g: 1e4 Pa s/m}
loading: {F_n: 0 Pa, w_n: 0 m}
initial: {g_n: 0 m}
run: {until: 1 s}
"""


def test_a_load_given_as_a_function_acts_like_a_history():
    expected, net = network("stick-slip", overrides=["loading.p={ramp: {start: 1e5 Pa, rate: 1e4 Pa/s}}"])
    net.advance(0.8)
    found, net = network("stick-slip")
    found.load("p", lambda t: 1e5 + 1e4 * t)
    net.advance(0.8)
    np.testing.assert_allclose(found.x, expected.x, rtol=LOOSE, atol=LOOSE * np.abs(expected.x).max())


def test_loads_may_read_states_of_their_own_and_of_one_another():
    """A conductance between two interfaces; what follows from loads depends on them."""
    first, second = (InterfaceReactor("dna-adhesive", [f"initial.T_1={T} K"]) for T in (290, 330))
    first.load("Q_1", lambda _: 100 * (second["T_1"] - first["T_1"]))
    second.load("Q_1", lambda _: 100 * (first["T_1"] - second["T_1"]))
    before = first["E_total"] + second["E_total"]
    ReactorNet([first, second]).advance(1.0)
    assert first["E_total"] + second["E_total"] == pytest.approx(before, rel=1e-12)
    assert 0 < second["T_1"] - first["T_1"] < 40
    looped = InterfaceReactor("dna-adhesive")
    looped.load("Q_1", lambda _: looped["q_1"])
    with pytest.raises(InputError, match="a load asks for what follows from the loads"):
        ReactorNet([looped]).advance(1.0)


@pytest.mark.parametrize("first", ["press", "load"])
def test_a_load_is_given_once(first):
    interface, gas, outside = InterfaceReactor(PISTON), stirred(300.0), stirred(300.0)
    ways = {"press": lambda: interface.press(gas, outside), "load": lambda: interface.load("F_n", 0.0)}
    ways[first]()
    for again in ways.values():
        with pytest.raises(InputError, match="the load F_n of interface is given already"):
            again()
    assert len(gas.walls) == (first == "press")


def test_what_a_gas_loses_on_a_piston_is_work_on_the_interface_and_outside():
    air = ct.Solution("air.yaml")
    air.TP = 300.0, 1.2e5
    gas = ct.IdealGasReactor(air, clone=True, volume=2e-4)
    air.TP = 300.0, 1.0e5
    outside = ct.Reservoir(air, clone=True)
    interface = InterfaceReactor(PISTON, area=0.03)
    interface.press(gas, outside)
    interface.area = 0.01
    net = ReactorNet([gas, interface])
    net.rtol = RTOL

    def books():
        """Energy of the gas [J], and gap [m]."""
        return energy(gas), interface["g_n"]

    net.advance(1e-9)
    before, closed = books()
    net.advance(1.0)
    after, opened = books()
    assert opened > 1e-4
    data = interface.dataset
    work = interface.area * (float(data["work_n"][-1]) + outside.phase.P * (opened - closed))
    assert before - after == pytest.approx(work, rel=1e-5)
    assert pytest.approx(interface["F_n"], rel=1e-9) == gas.phase.P - outside.phase.P
    assert data.attrs["energy_error"] < 1e-6


# -- what is refused -----------------------------------------------------------------------------------------------


def run(*reactors):
    ReactorNet(list(reactors)).advance(1.0)


def pressed(gas):
    interface = InterfaceReactor(PISTON)
    interface.press(gas, gas)
    return interface


REFUSED = [
    # what is done with a gas and an interface, and the words
    (lambda gas, _: InterfaceReactor("exothermic", bodies={"uper": gas}), "no body 'uper'. Did you mean 'upper'"),
    (lambda gas, _: InterfaceReactor("exothermic", bodies={"interface": gas}), "not of the interface"),
    (lambda gas, _: InterfaceReactor("exothermic", bodies={"upper": gas}), "must not give it a heat capacity"),
    (lambda *_: InterfaceReactor("reservoir-exchange").body("reservoir"), "reservoir has no temperature that evolves"),
    (lambda *_: InterfaceReactor("three-temperatures-no-capacity").body("interface"), "T_c stores no heat"),
    (lambda _, i: (run(i), i.body("interface")), "a wall on interface comes too late"),
    (lambda gas, i: (ct.Wall(gas, i.body("upper"), U=10.0), run(i)), "a wall to upper of interface is not in the net"),
    (lambda gas, i: (ct.Wall(i.body("lower"), gas, Q=lambda t: t), run(gas, i)), "a wall on lower has a heat flux of"),
    (lambda gas, i: (setattr(ct.Wall(gas, i.body("upper")), "velocity", 1), run(gas, i)), "its work would be lost"),
    (lambda _, i: (ct.ReactorSurface(i.phase, i, clone=False), run(i)), "Put it on the reactor of the gas"),
    (lambda gas, _: run(InterfaceReactor(PLATE, bodies={"chamber": gas})), "body chamber of interface is not in the n"),
    (lambda gas, _: run(pressed(gas)), "the reactor that presses on the gap of interface is not in the network"),
    (lambda _, i: InterfaceReactor("exothermic", area=0), "area = 0 is outside its range"),
    (lambda _, i: InterfaceReactor("exothermic", area="2 cm"), r"2 cm is a length; area needs an area \[m\^2\]"),
    (lambda _, i: setattr(i, "area", -1), "area = -1 is outside its range"),
    (lambda _, i: setattr(i, "chemistry_enabled", False), r"always True\. Reactions stop with `phase\.set_multiplier"),
    (lambda _, i: setattr(i, "energy_enabled", False), r"energy_enabled of interface is always True\. Hold temp"),
    (lambda _, i: i.mass, "interface has no mass, volume or composition"),
    (lambda _, i: i.Y, "interface has no mass, volume or composition"),
    (lambda _, i: setattr(i.phase, "TP", (350.0, 1e5)), "its reactions and their multipliers only"),
    (lambda _, i: setattr(i.phase, "f", 1e-12), "its reactions and their multipliers only"),
    (lambda _, i: i.phase.coverages, "its reactions and their multipliers only"),
    (lambda _, i: i.phase.set_unnormalized_coverages([0.3, 0.7]), "set it under `initial`"),
    (lambda _, i: i["Tc"], r"no quantity 'Tc'\. Did you mean 'T_c'"),
    (lambda _, i: i.component_index("Tc"), r"interface has no component 'Tc'\. Did you mean 'T_c'"),
    (lambda _, i: i.set_advance_limit("Tc", 1.0), r"interface has no component 'Tc'\. Did you mean 'T_c'"),
    (lambda *_: InterfaceReactor(surfacechem.load("exothermic"), ["T_0=9"]), "a case that is read already takes no ov"),
    (lambda *_: InterfaceReactor("slow-passage").load("w_n", lambda t: t), "prescribe its history under `loading`"),
    (lambda *_: InterfaceReactor("slow-passage").load("F_m", lambda t: t), "'F_m' is no load that a network can give"),
    (lambda *_: InterfaceReactor("slow-passage").load("F_m", 1.0), "network can give. Did you mean 'F_n'"),
    (lambda *_: InterfaceReactor("slow-passage").load("F_t2", 1.0), "nothing of the scene reads the load F_t2"),
    (lambda *_: InterfaceReactor(PISTON).load("F_n", None), "F_n needs a pressure"),
    (
        lambda *_: InterfaceReactor(PISTON).load("F_n", lambda t: None),
        "F_n is a number in SI at each time; .* it is None",
    ),
    (lambda *_: InterfaceReactor(PISTON).load("F_n", lambda t: "1 Pa"), "at t = 0 s it is '1 Pa'"),
    (lambda *_: InterfaceReactor(PISTON).load("F_n", lambda t: math.nan), "the load F_n is nan at the start"),
    (lambda _, i: run(i, i), "interface stands 2 times in the list of reactors"),
    (lambda _, i: (net := ReactorNet([i]), net.advance(0.1), setattr(net, "initial_time", 0.2)), "with new ones"),
    (lambda gas, _: InterfaceReactor("exothermic").press(gas, gas), "a gap that has a rate of its own"),
]


@pytest.mark.parametrize(("use", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_would_be_lost_ignored_or_of_nothing_is_refused(use, message):
    with pytest.raises(InputError, match=message):
        use(stirred(300.0), InterfaceReactor("dna-adhesive", area=0.01))
