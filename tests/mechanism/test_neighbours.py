"""Surfaces beside gases, solids and electrodes: rates, heat and entropy are Cantera's, and the books close."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cantera as ct
import numpy as np
import pytest
from ruamel.yaml import YAML
from sampling import every
from test_mechanism_cantera import FOLDER, SURFACES

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.loading import Hold
from surfacechem.mechanism.thermo import word
from surfacechem.reactor import InterfaceReactor, InterfaceStopped, ReactingGas, ReactorNet
from surfacechem.runs import rerun
from surfacechem.tolerances import FRACTION_FLOOR

pytestmark = pytest.mark.around

AVOGADRO = 6.02214076e23
RTOL = 1e-9
METHANE = (
    "{gas: {pressure: 1 atm, composition: {CH4: 0.095, O2: 0.21, H2: 1e-3, H2O: 1e-3, CO: 1e-3, CO2: 1e-3, AR: 0.691}}}"
)
FUEL = "gas: {pressure: 1 atm, composition: {H2: 0.95, H2O: 0.05}}"
ELECTROLYTE = """electrolyte: {composition: {"C3H4O3[elyt]": 0.47901, "C4H6O3[elyt]": 0.37563, "Li+[elyt]": 0.07268,
      "PF6-[elyt]": 0.07268}}"""


@dataclass(frozen=True)
class Beside:
    """A surface of Cantera with its neighbours, the coverages it starts from, and a time in which it changes."""

    T: float
    neighbours: str
    coverages: str
    until: float


CASES = {
    ("ptcombust.yaml", "Pt_surf"): Beside(900, METHANE, "{PT(S): 0.5, H(S): 0.5}", 1e-6),
    ("methane_pox_on_pt.yaml", "Pt_surf"): Beside(900, METHANE, "{PT(S): 0.5, H(S): 0.5}", 1e-6),
    ("sofc.yaml", "metal_surface"): Beside(1073.15, f"{{{FUEL}}}", "{(m): 0.5, H(m): 0.5}", 1e-5),
    ("sofc.yaml", "oxide_surface"): Beside(
        1073.15,
        f"{{{FUEL}, oxide_bulk: {{composition: {{Ox: 0.95, VO**: 0.05}}}}}}",
        """{"O''(ox)": 0.8, (ox): 0.2}""",
        1e-6,
    ),
    ("diamond.yaml", "diamond_100"): Beside(
        1200,
        "{gas: {pressure: 20 torr, composition: {H: 0.002, H2: 0.9878, CH3: 0.0002, CH4: 0.01}}}",
        "{c6HH: 0.9, 'c6H*': 0.1}",
        0.01,
    ),
    ("SiF4_NH3_mec.yaml", "SI3N4"): Beside(
        1600,
        "{gas: {pressure: 2 torr, composition: {NH3: 0.6, SIF4: 0.3, HF: 0.1}}}",
        "{HN_SIF(S): 0.5, HN_NH2(S): 0.5}",
        1e-4,
    ),
    ("example_data/ammonia-Ru-Ba-YSZ-CSM-2019.yaml", "Ru_surface"): Beside(
        800, "{gas: {pressure: 1 atm, composition: {NH3: 0.98, H2: 0.01, N2: 0.01}}}", "{Ru(s): 1}", 1e-6
    ),
    ("lithium_ion_battery.yaml", "edge_anode_electrolyte"): Beside(
        300,
        f"""{{anode: {{composition: {{"Li[anode]": 0.5, "V[anode]": 0.5}}}}, {ELECTROLYTE},
      electron: {{electric-potential: -3.1 V}}}}""",
        "{(dummy): 1}",
        1.0,
    ),
    ("lithium_ion_battery.yaml", "edge_cathode_electrolyte"): Beside(
        300,
        f"""{{cathode: {{composition: {{"Li[cathode]": 0.6, "V[cathode]": 0.4}}}}, {ELECTROLYTE},
      electron: {{electric-potential: 0.9 V}}}}""",
        "{(dummy): 1}",
        1.0,
    ),
}

ISOTHERMAL = """
T_0: 298.15 K
bodies: {{lower: {{temperature: {T} K}}, upper: {{temperature: {T} K}}}}
interface:
  temperature: {T} K
  mechanism: {{file: {file}, phase: {phase}, neighbours: {neighbours}}}
initial: {{coverages: {coverages}}}
run: {{until: {until}, outputs: 6, solver: cantera, rtol: {rtol}}}
"""


def written(folder: Path, surface: tuple[str, str], text: str = ISOTHERMAL, **changes: object) -> Path:
    """A case with one of Cantera's surfaces beside it."""
    file, phase = surface
    shutil.copy(FOLDER / file, folder)
    case = folder / "case.yaml"
    case.write_text(text.format(file=Path(file).name, phase=phase, rtol=RTOL, **{**vars(CASES[surface]), **changes}))
    return case


def alone(surface: tuple[str, str]) -> ct.Interface:
    """The same surface and neighbours in Cantera."""
    case = CASES[surface]
    made = ct.Interface(str(FOLDER / surface[0]), surface[1])
    pressures = {"1 atm": ct.one_atm, "20 torr": ct.one_atm * 20 / 760, "2 torr": ct.one_atm * 2 / 760}
    given = YAML(typ="safe").load(case.neighbours)
    for name, phase in made.adjacent.items():
        state = given.get(name, {})
        if "composition" in state:
            phase.X = state["composition"]
            phase.X = np.maximum(phase.X, FRACTION_FLOOR)  # what is absent counts as this: its rates are not zero
        phase.TP = case.T, pressures.get(state.get("pressure"), phase.P)
        phase.electric_potential = float(state.get("electric-potential", "0 V").split()[0])
    made.TP = case.T, None
    coverages = YAML(typ="safe").load(case.coverages)
    made.set_unnormalized_coverages([coverages.get(name, 0.0) for name in made.species_names])
    return made


def coverages(dataset, surface: ct.Interface) -> np.ndarray:
    found = [name for name in dataset if name.startswith("theta_")]
    assert len(found) == surface.n_species
    return np.array([dataset[name].values for name in found]).T


def reactions(surface: ct.Interface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Net rates [1/(m^2 s)], and enthalpy and Gibbs energy of each reaction [J], those of charges included."""
    rates = surface.net_rates_of_progress * 1e3 * AVOGADRO
    change = surface.product_stoich_coeffs - surface.reactant_stoich_coeffs
    phases = [surface, *surface.adjacent.values()]
    rows = [surface.kinetics_species_index(name) for phase in phases for name in phase.species_names]
    electric = np.concatenate([ct.faraday * phase.electric_potential * phase.charges for phase in phases])
    h = np.concatenate([phase.partial_molar_enthalpies for phase in phases]) + electric
    g = np.concatenate([phase.chemical_potentials for phase in phases]) + electric
    return rates, change[rows].T @ h / (1e3 * AVOGADRO), change[rows].T @ g / (1e3 * AVOGADRO)


def test_every_surface_of_cantera_runs():
    assert set(CASES) == set(SURFACES)


QUICK = ("metal_surface", "diamond_100", "edge_anode_electrolyte")
"""Beside a gas, a gas and a solid, an electrode and an electrolyte."""


@pytest.mark.parametrize(
    "which", [pytest.param(which, marks=[] if which[1] in QUICK else [pytest.mark.slow]) for which in CASES]
)
def test_at_constant_temperature_as_in_cantera(which, tmp_path):
    solution = surfacechem.load(written(tmp_path, which)).run(error="balances")
    assert solution.status == "finished"
    data, surface = solution.dataset, alone(which)
    theirs = [surface.coverages]
    for t in np.diff(data["time"].values):
        surface.advance_coverages(t, rtol=1e-11, atol=1e-18, max_steps=100000)
        theirs.append(surface.coverages)
    np.testing.assert_allclose(coverages(data, surface), theirs, atol=2e-8, rtol=0)

    surface.set_unnormalized_coverages(coverages(data, surface)[-1])
    rates, h, g = reactions(surface)
    ours = np.array([data[f"R_R{i + 1}"].values[-1] for i in range(len(rates))])
    both_ways = (surface.forward_rates_of_progress + surface.reverse_rates_of_progress) * 1e3 * AVOGADRO
    assert np.all(np.abs(ours - rates) <= 1e-10 * both_ways)
    produced = sum(float(data[name][-1]) for name in data if name.startswith("sigma_"))
    size = 1e-9 * np.sum(both_ways * np.abs(h))
    assert produced == pytest.approx(-np.sum(rates * g) / CASES[which].T, rel=1e-7, abs=size / CASES[which].T)
    assert float(data["Q_T_c"][-1]) == pytest.approx(np.sum(rates * h), rel=1e-7, abs=size)
    # The books are a quadrature along the steps of Cantera's integrator, of which each may err by the tolerance.
    books = solution.trajectory.result.counters.steps * RTOL
    assert solution.audit.energy_error < books
    assert solution.audit.entropy_error < books
    assert solution.audit.site_error < books


def test_a_run_again_from_its_file(tmp_path):
    case = written(tmp_path, ("sofc.yaml", "oxide_surface"), until=1e-8)
    record = rerun.read(surfacechem.run(case).write(tmp_path / "run.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []


@dataclass(frozen=True)
class Changing:
    """Neighbours whose state is a history, and what it is at a time."""

    neighbours: str
    state: Callable[[ct.Interface, float], None]


def fuel_at(surface: ct.Interface, t: float) -> None:
    surface.adjacent["gas"].TPX = surface.T, 1e5 + 2e9 * t, {"H2O": 0.05 + 1e4 * t, "H2": 0.95 - 1e4 * t}


def anode_at(surface: ct.Interface, t: float) -> None:
    surface.adjacent["electron"].electric_potential = -3.1 + 0.2 * t


CHANGING = {
    ("sofc.yaml", "metal_surface"): Changing(
        """{gas: {pressure: {ramp: {start: 1e5 Pa, rate: 2e9 Pa/s}},
      composition: {H2O: {ramp: {start: 0.05, rate: 1e4 1/s}}}, rest: H2}}""",
        fuel_at,
    ),
    ("lithium_ion_battery.yaml", "edge_anode_electrolyte"): Changing(
        CASES["lithium_ion_battery.yaml", "edge_anode_electrolyte"].neighbours.replace(
            "-3.1 V", "{ramp: {start: -3.1 V, rate: 0.2 V/s}}"
        ),
        anode_at,
    ),
}


@pytest.mark.parametrize("which", CHANGING)
def test_what_reactions_make_while_neighbours_change_is_cantera_s_at_every_time(which, tmp_path):
    changing = CHANGING[which]
    data = surfacechem.load(written(tmp_path, which, neighbours=changing.neighbours)).run(error="balances").dataset
    surface, own = alone(which), coverages(data, alone(which))
    for k, t in enumerate(data["time"].values):
        changing.state(surface, t)
        surface.set_unnormalized_coverages(own[k])
        current = {}
        both = (surface.forward_rates_of_progress + surface.reverse_rates_of_progress).sum() * 1e3 * AVOGADRO
        for phase in surface.adjacent.values():
            made = dict(zip(phase.species_names, surface.get_net_production_rates(phase) * 1e3 * AVOGADRO, strict=True))
            current[word(phase.name)] = ct.electron_charge * float(phase.charges @ [*made.values()])
            for name, rate in made.items():
                if rate:
                    assert float(data[f"production_{word(name)}"][k]) == pytest.approx(rate, rel=1e-9, abs=1e-10 * both)
        for name in (name for name in data if name.startswith("i_")):
            assert float(data[name][k]) == pytest.approx(current[name[2:]], rel=1e-9, abs=1e-29 * both)
    # What was made is the integral of the rate.
    for name in (name for name in data if name.startswith("made_")):
        rates = data[name.replace("made_", "production_")].values
        assert rates.min() * data["time"].values[-1] <= float(data[name][-1]) <= rates.max() * data["time"].values[-1]


def test_neighbours_are_swept_without_compiling_again(tmp_path):
    """A parameter like any other; fractions that add up to more than one are refused."""
    which = "sofc.yaml", "metal_surface"
    file = written(tmp_path, which, neighbours=f"{{{FUEL}}}".replace("H2: 0.95, ", "").replace("}}", "}, rest: H2}"))
    path = "interface.mechanism.neighbours.gas.composition.H2O.level"
    model, run = surfacechem.load(file).model, surfacechem.load(file).case.run
    again = surfacechem.load(file, {path.removesuffix(".level"): 0.2})
    changed = model.solve(run, {path: 0.2}).result.outputs
    assert np.array_equal(changed, again.model.solve(again.case.run).result.outputs)
    with pytest.raises(InputError, match=r"the mole fractions given in gas add up to more than one"):
        model.solve(run, {path: 1.2})


FUELLED = f"{{{FUEL}}}"
STATES = [
    ("{}", "the neighbour gas has no `pressure`: give `neighbours: {gas: {pressure: 1 atm, composition: {H2: 1}}}`"),
    ("{gas: {pressure: 1 atm}}", "the neighbour gas has no `composition`"),
    ("{gass: {pressure: 1 atm}}", "has no neighbour 'gass'. Did you mean 'gas'"),
    (FUELLED.replace("H2O", "HH2O"), "the neighbour gas has no species 'HH2O'. Did you mean 'H2O'"),
    (FUELLED.replace("0.95", "0.9"), "mole fractions of the neighbour gas sum to 0.95, not to 1"),
    (FUELLED.replace("0.95", "1.95"), "H2 = 1.95 in the neighbour gas is outside its range"),
    (FUELLED.replace("1 atm", "0 Pa"), "the pressure of the neighbour gas is 0 Pa, not above zero"),
    (FUELLED.replace("}}", "}, rest: H2}"), "the mole fraction of H2 in the neighbour gas has two roles"),
    (FUELLED.replace("}}", "}, rest: HH}"), "the neighbour gas has no species 'HH'. Known: H2, H2O, N2, O2."),
    (FUELLED.replace("pressure", "presure"), "unknown key 'presure'"),
]


IN_PLATINUM = [
    ("sticking-coefficient: {A: 1.0,", "sticking-coefficient: {B: 1.0,", "sticking-coefficient: unknown key 'B'"),
    ("sticking-coefficient: {A: 1.0,", "sticking-coeficient: {A: 1.0,", "unknown key 'sticking-coeficient'"),
    ("orders: {PT(S): 1}", "type: Bell\n  x-beta: 1 nm", "a rate of type 'Bell' belongs to surface"),
    ("equation: H + PT(S) => H(S)", "equation: H + Pt(s) => H(S)", "reaction H + Pt(s) => H(S)"),
    ("equation: H + PT(S) => H(S)", "equation: H + Pt(s) => H(S)", "Write 'PT(S)'"),
]


def refusal(case):
    with pytest.raises(InputError) as caught:
        surfacechem.load(case)
    return str(caught.value)


@pytest.mark.parametrize(("neighbours", "message"), STATES, ids=range(len(STATES)))
def test_states_of_neighbours_are_checked(neighbours, message, tmp_path):
    told = refusal(written(tmp_path, ("sofc.yaml", "metal_surface"), neighbours=neighbours))
    assert message in told
    assert "case.yaml:" in told


@pytest.mark.parametrize(("old", "new", "message"), IN_PLATINUM, ids=range(len(IN_PLATINUM)))
def test_reactions_with_neighbours_are_checked(old, new, message, tmp_path):
    case = written(tmp_path, ("ptcombust.yaml", "Pt_surf"))
    file = tmp_path / "ptcombust.yaml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    told = refusal(case)
    assert message in told
    assert "ptcombust.yaml:" in told


def test_what_a_reversible_reaction_may_give_back_is_told(tmp_path):
    system = surfacechem.load(written(tmp_path, ("sofc.yaml", "metal_surface"))).system
    assert any("the neighbours hold no O2, which reactions make" in text for text in system.warnings)


SMALL = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
phases:
- name: surf
  thermo: ideal-surface
  kinetics: surface
  adjacent-phases: [gas]
  elements: [C, O, N]
  species: [a(s), CO(s)]
  site-density: 2e-5 mol/m^2
- name: gas
  thermo: ideal-gas
  elements: [C, O, N]
  species: [{gri30.yaml/species: [CO, O2, N2]}]
- name: gas2
  thermo: ideal-gas
  elements: [C, O, N]
  species: [{gri30.yaml/species: [N2, CO]}]
species:
- {name: a(s), composition: {}, thermo: {model: constant-cp}}
- {name: CO(s), composition: {C: 1, O: 1}, thermo: {model: constant-cp, h0: -220 kJ/mol, s0: 80 J/mol/K}}
reactions:
- {equation: CO + a(s) <=> CO(s), rate-constant: {A: 1e3 m^3/mol/s, b: 0, Ea: 5}}
"""
SMALL_CASE = """
bodies: {lower: {temperature: 600 K}, upper: {temperature: 600 K}}
interface:
  temperature: 600 K
  mechanism:
    file: small.yaml
    phase: surf
    neighbours: {gas: {pressure: 1 bar, composition: {CO: 0.01, O2: 0.2}, rest: N2}}
initial: {coverages: {a(s): 0.6, CO(s): 0.4}}
run: {until: 1 us, solver: cantera}
"""


def small(folder: Path, changes: dict[str, str]) -> Path:
    """A case with a small mechanism, and with changes of either text."""
    text, case = SMALL, SMALL_CASE
    for old, new in changes.items():
        assert old in text + case
        text, case = text.replace(old, new), case.replace(old, new)
    (folder / "small.yaml").write_text(text)
    (folder / "case.yaml").write_text(case)
    return folder / "case.yaml"


def small_alone(folder: Path, T: float = 600, p: float = 1e5, x: str = "CO:0.01, O2:0.2, N2:0.79") -> ct.Interface:
    surface = ct.Interface(str(folder / "small.yaml"), "surf")
    surface.adjacent["gas"].TPX, surface.TP = (T, p, x), (T, p)
    surface.coverages = [0.6, 0.4]
    return surface


@pytest.mark.parametrize(
    ("old", "new", "last"),
    [
        ("1 bar", "{ramp: {start: 1 bar, rate: 1e11 Pa/s}}", {"p": 2e5}),
        ("O2: 0.2", "O2: {ramp: {start: 0.2, rate: 2e5 1/s}}", {"x": "CO:0.01, O2:0.4, N2:0.59"}),
    ],
)
def test_a_neighbour_that_a_rate_reads_only_by_an_order_is_held_too(old, new, last, tmp_path):
    reaction = """{equation: CO(s) => a(s), rate-constant: {A: 1e-2, b: 0, Ea: 5}, orders: {O2: 0.5},
  nonreactant-orders: true}"""
    changes = {SMALL.partition("reactions:\n- ")[2]: reaction, "{C: 1, O: 1}": "{}"}
    data = surfacechem.run(small(tmp_path, {**changes, old: new})).dataset
    for k, state in ((0, {}), (-1, last)):
        surface = small_alone(tmp_path, **state)
        surface.set_unnormalized_coverages(coverages(data, surface)[k])
        assert float(data["R_R1"][k]) == pytest.approx(surface.net_rates_of_progress[0] * 1e3 * AVOGADRO, rel=1e-9)


def test_engines_that_share_a_surface_read_their_own_neighbours(tmp_path):
    """The same numbers are of other species."""
    engine = surfacechem.load(small(tmp_path, {})).case.scene.interface.engine
    values, swapped = [600.0, 6e18, 0.6, 0.4, 1e5, 0.5, 0.2], {"O2": Hold(level=0.5), "CO": Hold(level=0.2)}
    rate = engine(values)[0]
    other = engine.with_neighbours({"gas": engine.held[0].given._replace(composition=swapped)})
    assert other(values)[0] != rate == engine(values)[0]


@pytest.mark.parametrize("beside", ["[gas2, gas]", "[gas]"])
def test_phases_may_hold_species_of_one_name(beside, tmp_path):
    """What an equation names is on the surface, else in the first phase that has it; it counts there, once."""
    both = {"rest: N2}": "rest: N2}, gas2: {pressure: 2 bar, composition: {CO: 0.5}, rest: N2}"}
    alike = {"CO(s)": "O2"}
    data = surfacechem.run(small(tmp_path, {"[gas]": beside, **(both if "gas2" in beside else alike)})).dataset
    surface = small_alone(tmp_path)
    if "gas2" in beside:
        surface.adjacent["gas2"].TPX = 600, 2e5, "CO:0.5, N2:0.5"
    rates, made = surface.net_rates_of_progress, [(x, surface.get_net_production_rates(x)) for x in surface.adjacent]
    taken = -sum(rate @ surface.adjacent[name].partial_molar_enthalpies for name, rate in made)
    assert float(data["q_n"][0]) == pytest.approx(taken, rel=1e-9)
    assert float(data["sigma_R1"][0]) == pytest.approx(-rates[0] * surface.delta_gibbs[0] / 600, rel=1e-9)
    # In a network the gas that the equation means loses it, and no other does.
    gases = {}
    for name, phase in surface.adjacent.items():
        gases[name] = ReactingGas(phase, clone=True, volume=1e-6, energy="off")
    before = {name: gas.mass for name, gas in gases.items()}
    net = ReactorNet([*gases.values(), InterfaceReactor(tmp_path / "case.yaml", area=1e-3, neighbours=gases)])
    net.rtol, net.atol = 1e-9, 1e-18
    net.advance(1e-6)
    changed = [name for name, gas in gases.items() if abs(gas.mass / before[name] - 1) > 1e-9]
    assert changed == [beside.strip("[]").split(", ")[0]]


CONSTANT = "rate-constant: {A: 1e3 m^3/mol/s, b: 0, Ea: 5}"
MASEL = "type: Blowers-Masel, rate-constant: {A: 1e3 m^3/mol/s, b: 0, Ea0: 5, w: 400}"
STUCK = "sticking-coefficient: {A: 0.3, b: 0, Ea: 5}"


PLACE = "small.yaml:23: reaction CO + a(s) <=> CO(s): "
BARE = {"units: {length: m, quantity: mol, activation-energy: kJ/mol}": "units: {length: m}"}
TOO_MUCH = "Ea: 5 kJ is an energy of 3.01107e+27 J/mol, which no bond has; write"
REFUSED = [
    ({CONSTANT: f"{MASEL}, coverage-dependancies: {{}}"}, "'coverage-dependancies'. Did you mean 'coverage-dependen"),
    ({CONSTANT: f"{MASEL}, ordres: {{}}"}, "unknown key 'ordres'. Did you mean 'orders'?"),
    ({CONSTANT: "type: falloff, low-P-rate-constant: {A: 1}"}, "rate type 'falloff' depends on pressure, which belon"),
    ({CONSTANT: MASEL.replace("w:", "W:")}, "rate-constant: unknown key 'W'"),
    ({CONSTANT: CONSTANT.replace("Ea: 5", "Ea: 5 kJ")}, TOO_MUCH),
    ({CONSTANT: STUCK.replace("Ea: 5", "Ea: 5 kJ")}, TOO_MUCH),
    ({CONSTANT: MASEL.replace("Ea0:", "Ea:")}, "rate-constant: unknown key 'Ea'. Did you mean 'Ea0'?"),
    ({CONSTANT: CONSTANT.replace(" m^3/mol/s", ""), **BARE}, "A: 1000 without a unit counts in"),
    (BARE, "Ea: 5 without a unit counts in J/kmol"),
    ({CONSTANT: STUCK, **BARE}, "Ea: 5 without a unit counts in J/kmol"),
    ({CONSTANT: MASEL, **BARE}, "Ea0: 5 without a unit counts in J/kmol"),
    ({CONSTANT: MASEL.replace("Ea0: 5", "Ea0: 5 kJ/mol"), **BARE}, "w: 400 without a unit counts in J/kmol"),
]
LOOPS = [
    ({"[gas]": "[gas, surf]"}, ":7: phase surf: adjacent-phases: the phase names itself; remove that."),
    ({"[gas]": "[{phases: [surf]}]"}, ":7: phase surf: adjacent-phases: the phase names itself"),
    ({"- name: gas\n": "- name: gas\n  adjacent-phases: [surf]\n"}, "phase gas: adjacent-phases: the phase names surf"),
]
"""Cantera calls itself until the stack ends, and the process with it."""


@pytest.mark.parametrize(
    ("changes", "words"), [*((changes, (PLACE, message)) for changes, message in REFUSED), *LOOPS], ids=str
)
def test_what_cantera_would_evaluate_is_checked(changes, words, tmp_path):
    told = refusal(small(tmp_path, changes))
    assert all(part in told for part in (words if isinstance(words, tuple) else [words]))


def test_a_temperature_out_of_the_range_of_a_gas_is_told(tmp_path):
    """The surface's own species hold anywhere, the data of the gas above 300 K."""
    cold, warm = (surfacechem.run(small(tmp_path, {"600 K": T})).dataset for T in ("250 K", "310 K"))
    assert "T_c ran from 250 to 250, its range is 300 to 3500" in cold.attrs["warnings"]
    assert "extrapolation" not in warm.attrs["warnings"]


def test_a_pressure_that_falls_to_zero_ends_the_run_there(tmp_path):
    changes = {"1 bar": "{ramp: {start: 1 Pa, rate: -1000 Pa/s}}", "1 us": "2 ms"}
    solution = surfacechem.run(small(tmp_path, changes))
    assert (solution.status, solution.trajectory.result.t) == ("stopped", pytest.approx(1e-3, rel=1e-12))
    assert "the pressure of gas reached zero" in solution.reason


@pytest.mark.parametrize("A", every(2, [1e25, 1e3]))
def test_a_surface_empties_whose_sites_are_made_of_nothing(A, tmp_path):
    """Where what has a mass is used up, a step tries less than nothing of it: Cantera knows no such surface."""
    leaves = f"{{equation: CO(s) => CO + a(s), rate-constant: {{A: {A} 1/s, b: 0, Ea: 0}}}}"
    changes = {SMALL.partition("reactions:\n- ")[2]: leaves, "until: 1 us": f"until: {1e3 / A} s, outputs: 101"}
    solution = surfacechem.run(small(tmp_path, changes), ["run.rtol=1e-9"])
    assert solution.status == "finished"
    exact = 0.4 * np.exp(-A * solution.dataset["time"].values)
    np.testing.assert_allclose(solution.dataset["theta_CO_s"], exact, atol=1e-7)
    long = surfacechem.run(small(tmp_path, {**changes, "until: 1 us": "until: 1 s"})).dataset
    assert float(long["theta_a_s"][-1]) == pytest.approx(1, rel=1e-9)


OXIDATION = """- {equation: CO + a(s) <=> CO(s), sticking-coefficient: {A: 0.9, b: 0, Ea: 0}}
- {equation: O2 + 2 a(s) => 2 O(s), sticking-coefficient: {A: 0.02, b: 0, Ea: 0}}
- {equation: CO(s) + O(s) => CO2 + 2 a(s), rate-constant: {A: 1e19 m^2/mol/s, b: 0, Ea: 90}}
"""


def test_a_surface_comes_to_rest_whose_sites_drift_over_years(tmp_path):
    """By less than the tolerance, but by more than that of what hardly covers it; Newton's method tells the rest."""
    oxygen = "- {name: O(s), composition: {O: 1}, thermo: {model: constant-cp, h0: -150 kJ/mol, s0: 30 J/mol/K}}"
    changes = {
        SMALL.partition("reactions:\n")[2]: OXIDATION,
        "reactions:\n": f"{oxygen}\nreactions:\n",
        "[a(s), CO(s)]": "[a(s), CO(s), O(s)]",
        "[CO, O2, N2]": "[CO, O2, N2, CO2]",
        "600 K": "500 K",
        "1 bar": "10 mbar",
        "CO: 0.01": "CO: 0.2",
    }
    case = small(tmp_path, changes)
    solution = surfacechem.run(case, ["run.until=steady"])
    assert "came to rest" in solution.reason
    rest = surfacechem.steady(case, ["production_CO2"])
    assert float(solution.dataset["production_CO2"][-1]) == pytest.approx(rest.rates["production_CO2"], rel=1e-7)


@pytest.mark.parametrize(
    "rate", [CONSTANT.replace("Ea: 5", "Ea: -5000"), "Motz-Wise: true, sticking-coefficient: {A: 9, b: 0, Ea: 5}"]
)
def test_a_rate_beyond_all_numbers_is_named(rate, tmp_path):
    """It was said of algebraic variables, of which there are none; and a rate whose sign Motz and Wise turn ran on."""
    case = small(tmp_path, {CONSTANT: rate})
    solution = surfacechem.run(case)
    assert (solution.status, solution.reason) == ("stopped", "R_R1 is no finite number near t = 0 s")
    with pytest.raises(InterfaceStopped, match="R_R1 is no finite number at t = 0 s"):
        ReactorNet([InterfaceReactor(case)]).advance(1e-6)
