"""Gases of a network beside a surface: what reactions take they lose, and the books of both close."""

from pathlib import Path

import cantera as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from surfacechem import load
from surfacechem.errors import InputError
from surfacechem.laws.friction import Coulomb
from surfacechem.quantities import MOLECULAR
from surfacechem.reactor import (
    InterfaceReactor,
    InterfaceStopped,
    ReactingGas,
    ReactingGasAtPressure,
    ReactingSolid,
    ReactorNet,
)

pytestmark = pytest.mark.around

AREA = 0.1
FUEL = "H2:0.5, O2:0.1, H2O:0.4"
CASE = """
T_0: 298.15 K
bodies:
  wall: {{temperature: {T}{C}}}
  core: {{temperature: {T}{C}}}
interface:
  temperature: {T}
  mechanism:
    file: sofc.yaml
    phase: metal_surface
    neighbours: {{gas: {{pressure: 1 atm, composition: {{H2: 0.5, O2: 0.1}}, rest: H2O}}}}
initial: {{{start}coverages: {{(m): 1}}}}
run: {{until: 1 s, solver: cantera}}
"""
WARM = CASE.format(T="T", C=", C: 100 J/m^2/K, capacity: constant", start="T: 900 K, ")
HELD = CASE.format(T="1000 K", C="", start="")


def fuel(kind=ReactingGas, **options):
    gas = ct.Solution("sofc.yaml", "gas")
    gas.TPX = 1000, ct.one_atm, FUEL
    return kind(gas, clone=True, volume=1e-4, **options)


def network(*reactors):
    net = ReactorNet(reactors)
    net.rtol, net.atol = 1e-11, 1e-18
    return net


@pytest.mark.parametrize(("kind", "held"), [(ReactingGas, "int_energy"), (ReactingGasAtPressure, "enthalpy")])
def test_mass_elements_and_energy_stay_what_they_are(kind, held):
    """A closed box, or a balloon: what the gas loses the surface and the bodies have."""
    gas = fuel(kind)
    interface = InterfaceReactor(WARM, neighbours={"gas": gas}, area=AREA)
    net, surface = network(gas, interface), ct.Interface("sofc.yaml", "metal_surface")

    def books():
        kmol = gas.mass / gas.phase.mean_molecular_weight * gas.phase.X
        sites = AREA * surface.site_density * np.array([interface[name] for name in interface.scene.states[:-1]])
        atoms = np.array([[gas.phase.n_atoms(s, x) for s in gas.phase.species_names] for x in ("H", "O")])
        own = np.array([[surface.n_atoms(s, x) for s in surface.species_names] for x in ("H", "O")])
        energy = gas.mass * getattr(gas.phase, f"{held}_mass")
        mass = sites @ surface.molecular_weights
        return np.array([gas.mass, energy]), np.array([mass, AREA * interface["E_total"]]), atoms @ kmol + own @ sites

    net.advance(1e-12)
    gas_before, surface_before, elements = books()
    for t in (1e-7, 1e-5, 1e-3):
        net.advance(t)
    gas_after, surface_after, elements_after = books()
    given, taken = gas_before - gas_after, surface_after - surface_before
    assert given[1] > 10  # J
    np.testing.assert_allclose(taken, given, rtol=1e-9)
    np.testing.assert_allclose(elements_after, elements, rtol=1e-12)
    data = interface.dataset
    assert max(data.attrs[f"{kind}_error"] for kind in ("energy", "site")) < 1e-9
    # Outputs of the past are those of the gas as it was then.
    assert data["x_gas_H2O"].values[0] == pytest.approx(0.4, rel=1e-6)
    assert float(data["x_gas_H2O"][-1]) == pytest.approx(gas.phase["H2O"].X[0], rel=1e-12)
    made = np.gradient(data["made_H2O"].values, data["time"].values)
    assert data["production_H2O"].values[0] == pytest.approx(made[0], rel=1e-2)


@pytest.mark.parametrize(("kind", "error"), [(ReactorNet, InputError), (ct.ReactorNet, ct.CanteraError)])
def test_a_gas_that_asks_before_rates_are_varied(kind, error):
    gas = fuel()
    interface = InterfaceReactor(HELD, neighbours={"gas": gas}, area=AREA)
    net = kind([gas, interface])
    interface.add_sensitivity_reaction(1)
    with pytest.raises(error, match="Give interface to the network before the reactors that take from it"):
        net.advance(1e-6)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("h0: -241.8", "h0: -241.9", "steam in the reactor of the neighbour gas has another enthalpy at 300 K than in"),
        ("s0: 188.8", "s0: 188.9", "steam in .* another entropy at 300 K"),
        ("cp0: 33.6", "cp0: 33.7", "steam in .* another enthalpy at 1500 K"),
        ("H: 2, O: 1", "D: 2, O: 1", "steam in .* another composition"),
        ("molar: 0", "molar: 1", ""),
    ],
)
def test_a_gas_of_other_atoms_or_thermo_under_the_same_names(old, new, message, tmp_path, monkeypatch):
    """What it receives would not be what the surface gives."""
    phases = "\n".join(
        (
            "units: {quantity: mol, energy: kJ}",
            "phases:",
            "- {name: gas, thermo: ideal-gas, species: [steam, rest], state: {T: 300 K, P: 1 atm, X: {rest: 1}}}",
            "- {name: wall, thermo: ideal-surface, species: [free(s), wet(s)], kinetics: surface, reactions: all,",
            "   adjacent-phases: [gas], site-density: 1e-5 mol/m^2, state: {T: 300 K, coverages: {free(s): 1}}}",
            "species:",
            "- {name: steam, composition: {H: 2, O: 1},",
            "   thermo: {model: constant-cp, T0: 300, h0: -241.8, s0: 188.8 J/mol/K, cp0: 33.6 J/mol/K}} # molar: 0",
            "- {name: rest, composition: {Ar: 1}, thermo: {model: constant-cp}}",
            "- {name: free(s), composition: {}, thermo: {model: constant-cp}}",
            "- {name: wet(s), composition: {H: 2, O: 1}, thermo: {model: constant-cp, h0: -300}}",
            "reactions: [{equation: steam + free(s) => wet(s), rate-constant: {A: 1 m^3/mol/s, b: 0, Ea: 0}}]",
        )
    )
    monkeypatch.chdir(tmp_path)
    Path("phases.yaml").write_text(phases)
    assert old in phases
    gas = ReactingGas(ct.Solution(yaml=phases.replace(old, new), name="gas"), clone=True)
    case = """
bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}
interface:
  temperature: 300 K
  mechanism:
    file: phases.yaml
    phase: wall
    neighbours: {gas: {pressure: 1 atm, composition: {steam: 0.5}, rest: rest}}
initial: {coverages: {free(s): 1}}
run: {until: 1 s, solver: cantera}
"""
    if message:
        with pytest.raises(InputError, match=message):
            InterfaceReactor(case, neighbours={"gas": gas})
    else:
        InterfaceReactor(case, neighbours={"gas": gas})


ELECTRODE = """
bodies: {particle: {temperature: 300 K}, cell: {temperature: 300 K}}
interface:
  temperature: 300 K
  mechanism:
    file: lithium_ion_battery.yaml
    phase: edge_anode_electrolyte
    neighbours:
      anode: {composition: {"Li[anode]": 0.1}, rest: "V[anode]"}
      electrolyte: {composition: {"C3H4O3[elyt]": 0.5, "C4H6O3[elyt]": 0.3, "Li+[elyt]": 0.1}, rest: "PF6-[elyt]"}
      electron: {electric-potential: -3.2 V}
initial: {coverages: {(dummy): 1}}
run: {until: 40 s, solver: cantera}
"""


def test_a_particle_and_its_electrolyte_at_a_held_potential():
    """What the anode takes the electrolyte loses; beside SciPy along Cantera's rates."""

    def phase(name, *parts):
        found = ct.Solution("lithium_ion_battery.yaml", name)
        found.TPX = 300, ct.one_atm, parts
        return found

    anode = ReactingSolid(phase("anode", 0.5, 0.5), mass=0.02)
    electrolyte = ReactingSolid(phase("electrolyte", 0.48, 0.37, 0.08, 0.07), mass=0.1, name="electrolyte")
    cell = InterfaceReactor(ELECTRODE, neighbours={"anode": anode, "electrolyte": electrolyte})
    net, before, lithium = network(anode, electrolyte, cell), anode.mass, anode.amounts[0] + electrolyte.amounts[2]
    start = np.concatenate((anode.x, electrolyte.x))
    net.advance(40.0)
    assert anode.amounts[0] + electrolyte.amounts[2] == pytest.approx(lithium, rel=1e-12)
    full, empty = anode.phase.molecular_weights
    gained = float(cell.dataset["made_Li_anode"][-1]) / MOLECULAR * (full - empty)
    assert anode.mass - before == pytest.approx(gained, rel=1e-9)

    edge = ct.Interface("lithium_ion_battery.yaml", "edge_anode_electrolyte")
    edge.TP = 300, ct.one_atm
    edge.adjacent["electron"].electric_potential = -3.2

    def rates(_, x):
        edge.adjacent["anode"].TPX = 300, ct.one_atm, x[:2]
        edge.adjacent["electrolyte"].TPX = 300, ct.one_atm, x[2:]
        made = edge.get_net_production_rates("anode"), edge.get_net_production_rates("electrolyte")
        return np.concatenate((made[0] / anode.whole, made[1] / electrolyte.whole))

    known = solve_ivp(rates, (0, 40), start, method="LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(np.concatenate((anode.x, electrolyte.x)), known, atol=1e-7)
    assert anode.x[0] > 0.7


BRIEF = """
units: {quantity: kmol, energy: J}
phases:
- {name: gas, thermo: ideal-gas, species: [A2, rest], state: {T: 660 K, P: 0.1 atm, X: {A2: 0.5, rest: 0.5}}}
- {name: wall, thermo: ideal-surface, species: [free(s), A(s), A2(s)], kinetics: surface, reactions: all,
   adjacent-phases: [gas], site-density: 4e-9, state: {T: 660 K, coverages: {free(s): 1}}}
species:
- {name: A2, composition: {H: 2}, thermo: {model: constant-cp}}
- {name: rest, composition: {Ar: 1}, thermo: {model: constant-cp}}
- {name: free(s), composition: {}, thermo: {model: constant-cp}}
- {name: A(s), composition: {H: 1}, thermo: {model: constant-cp}}
- {name: A2(s), composition: {H: 2}, sites: 2, thermo: {model: constant-cp, h0: 2.1e+8}}
reactions:
- {equation: A2 + 2 free(s) <=> A2(s), rate-constant: {A: 8e+16, b: 0, Ea: 0}}
- {equation: A2 + 2 free(s) => 2 A(s), rate-constant: {A: 4e+15, b: 0, Ea: 0}}
"""


def test_a_state_that_lives_a_yoctosecond(tmp_path, monkeypatch):
    """The roundoff of derivatives that the integrator took at its first steps would hide what it must correct."""
    monkeypatch.chdir(tmp_path)
    Path("wall.yaml").write_text(BRIEF, encoding="utf-8")
    case = (
        HELD.replace("1000", "660").replace("sofc", "wall").replace("metal_surface", "wall").replace("(m)", "free(s)")
    )
    case = case.replace(
        "1 atm, composition: {H2: 0.5, O2: 0.1}, rest: H2O", "0.1 atm, composition: {A2: 0.5}, rest: rest"
    )
    case = case.replace("until: 1 s", "until: 1.4e-7 s, rtol: 1e-8")
    gas = ReactingGas(ct.Solution("wall.yaml", "gas"), clone=True, volume=1.0, energy="off")
    interface = InterfaceReactor(case, neighbours={"gas": gas}, area=AREA)
    net = ReactorNet([gas, interface])
    net.rtol, net.atol = 1e-8, 1e-15
    net.advance(1.4e-7)
    alone = load(case).run()
    assert max(alone.audit.site_error, alone.audit.energy_error) < 1e-12
    coverages = [interface[name] for name in interface.scene.states]
    assert sum(coverages) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(
        coverages, [float(alone.dataset[name][-1]) for name in interface.scene.states], rtol=1e-6
    )


def graphite(x=0.5, **options):
    phase = ct.Solution("lithium_ion_battery.yaml", "anode")
    phase.TPX = 300, ct.one_atm, (x, 1 - x)
    return phase, ReactingSolid(phase, **options)


@pytest.mark.parametrize(("kind", "error"), [(ReactorNet, InputError), (ct.ReactorNet, ct.CanteraError)])
@pytest.mark.parametrize("ran", [False, True])
def test_an_interface_that_is_not_in_the_network(kind, error, ran):
    """Nor is it when another one has replaced it; it would give at the rates of the start. It may be given later.

    A clock that begins before what a ReactorNet has recorded would leave its records out.
    """
    gas = fuel(energy="off")
    first = InterfaceReactor(HELD, neighbours={"gas": gas}, area=AREA, name="first")
    if ran:
        kind([gas, first]).advance(1e-9)
    second = InterfaceReactor(HELD, neighbours={"gas": gas}, area=AREA, name="second")
    for reactors in ([gas, second], [second, gas], [gas]):
        net = kind(reactors)
        for _ in range(2):
            with pytest.raises(error, match=r"the interface first to which .* is not in the network, so what it gives"):
                net.advance(1e-3)
    net = kind([gas, first, second])
    if ran and kind is ReactorNet:
        with pytest.raises(
            InputError, match=r"is at t = 0 s, but has been recorded up to t = 1e-09 s. Set `initial_time`"
        ):
            net.advance(2e-9)
        net = kind([gas, first, second])
        net.initial_time = 1e-9
    net.advance(2e-9)


@pytest.mark.parametrize(("volts", "rest"), [(-2.0, (0, 1)), (-3.6, (1, 0))])
def test_a_particle_is_used_up(volts, rest):
    """The tabulated thermo of graphite is no number where one of its species is missing."""
    _, solid = graphite(mass="1 mg")
    cell = InterfaceReactor(ELECTRODE.replace("-3.2 V", f"{volts} V"), neighbours={"anode": solid})
    network(solid, cell).advance(10.0)
    np.testing.assert_allclose(solid.x, rest, atol=1e-12)


CHARGED = ELECTRODE.replace("-3.2 V", "-2.9 V, capacitance: 20 uF/cm^2")


def test_particles_of_one_phase_have_each_their_own():
    phase, large = graphite(0.1, mass="20 g")
    small = ReactingSolid(phase, mass=0.002)
    assert large.mass == pytest.approx(0.02, rel=1e-12)
    assert large.volume == pytest.approx(0.02 / phase.density, rel=1e-12)
    cells = [InterfaceReactor(ELECTRODE, neighbours={"anode": solid}) for solid in (large, small)]
    network(large, small, *cells).advance(1.0)
    np.testing.assert_allclose(phase.X, [0.1, 0.9], rtol=1e-12)
    assert (small.x[0] - 0.1) > 5 * (large.x[0] - 0.1) > 0
    assert small.name == "solid_2"
    assert ReactingSolid(phase, mass=1.0, clone=False).phase is phase


def air():
    return ct.Reservoir(ct.Solution("air.yaml"), clone=True)


def run(*reactors):
    ReactorNet(list(reactors)).advance(1.0)


def beside(case=WARM, **neighbours):
    return InterfaceReactor(case, neighbours=neighbours)


REFUSED = [
    (lambda _: beside(gas=fuel(ct.IdealGasReactor)), "gas must be a ReactingGas or a ReactingSolid, as IdealGasReacto"),
    (lambda _: beside(gass=fuel()), "surface metal_surface has a neighbour 'gass'. Did you mean 'gas'"),
    (lambda _: ReactingGas(ct.Solution("graphite.yaml"), clone=True), "phase graphite is fixed-stoichiometry. A so"),
    (lambda _: beside(gas=ReactingGas(ct.Solution("h2o2.yaml"), clone=True)), "gas has other species than the mechan"),
    (lambda solid: (beside(ELECTRODE, anode=solid), run(solid)), "the interface interface to which .* is not in the n"),
    (lambda _: run(beside(gas=fuel())), "the neighbour gas of interface is not in the network"),
    (lambda _: beside("exothermic", gas=fuel()), "no reaction of the scene has a neighbour"),
    (lambda _: graphite(mass=-1), "mass = -1 is outside"),
    (lambda _: graphite(mass=0), "mass = 0 is outside"),
    (lambda _: graphite(mass="20 m"), "20 m is a length; mass needs a mass"),
    (lambda solid: ct.MassFlowController(air(), solid, mdot=1e-2), "a flow into solid would be lost"),
    (lambda solid: ct.Valve(solid, air(), K=1.0), "a flow out of solid has no source"),
    (lambda solid: ct.Wall(air(), solid, U=100.0), "temperature and pressure are held"),
    (lambda solid: setattr(solid, "chemistry_enabled", False), "chemistry_enabled of solid is always True"),
    (lambda solid: setattr(solid, "energy_enabled", True), "energy_enabled of solid is always False"),
    (lambda _: InterfaceReactor(CHARGED).load("j_electron", "1 A"), "1 A is an electric current; j_electron needs"),
]


@pytest.mark.parametrize(("use", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_a_surface_or_a_solid_would_not_feel_is_refused(use, message):
    with pytest.raises(InputError, match=message):
        use(graphite(mass=0.02)[1])


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_a_gas_that_flows_out_names_itself_where_its_mass_ends(start):
    gas = fuel(ReactingGasAtPressure, energy="off", name="bag")
    ct.MassFlowController(gas, ct.Reservoir(gas.phase, clone=True), mdot=gas.mass / 1e-6)
    net = network(gas, InterfaceReactor(HELD, neighbours={"gas": gas}, area=AREA))
    net.initial_time = start
    clock = r"\. Times are resolved to 2e-16 s there: let `initial_time` be nearer to zero" if start else ""
    with pytest.raises(InterfaceStopped, match=rf"where bag: mass changes by \S+ of itself a second{clock}$"):
        net.advance(start + 1e-5)


def test_a_jump_that_a_gas_decides_comes_in_its_time(monkeypatch):
    """A block begins to slide at 0.9 of its friction, which falls with the pressure of a gas and its hydrogen."""

    def traction(self, p, direction, p_gas, x_gas_H2):
        return self.mu * p * direction * (2.5 - p_gas / ct.one_atm - x_gas_H2)

    for method in ("limit", "traction"):
        monkeypatch.setattr(Coulomb, method, traction)
    rubs = HELD.replace("  mechanism:", "  friction: [{coulomb: {mu: 0.3}}]\n  mechanism:")
    rubs = rubs.replace("initial: {", "initial: {u_t: 0, v: 0, ")
    mounted = f"{rubs}mechanics: {{tangential: {{m: 1, k: 1e9, c_g: 1e5}}}}\nloading: {{p: 1 MPa, w_t: 0.27 mm}}\n"
    gas, source = fuel(energy="off"), ct.Solution("sofc.yaml", "gas")
    source.TPX = 1000, ct.one_atm, "H2:1"
    lighter = source.mean_molecular_weight / gas.phase.mean_molecular_weight
    _flow = ct.MassFlowController(ct.Reservoir(source, clone=True), gas, mdot=gas.mass * lighter)
    block = InterfaceReactor(mounted, neighbours={"gas": gas}, area=1e-12)
    net = network(gas, block)
    net.rtol = 1e-9
    net.advance(0.0682)
    (slip,) = block.scene.events.instant.jumps
    # The amount of gas is 1 + t and that of hydrogen 0.5 + t: 2.5 - (1 + t) - (0.5 + t) / (1 + t) = 0.9.
    assert (slip.edge.name, slip.t) == ("slip forward", pytest.approx(np.sqrt(0.59) - 0.7, rel=1e-6))
