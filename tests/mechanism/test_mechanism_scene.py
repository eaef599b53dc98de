"""A mechanism in a scene: the assembled equations are Cantera's production rates and enthalpies."""

from dataclasses import replace

import cantera as ct
import numpy as np
import pytest
import symengine
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import bodies, path
from scipy.linalg import expm

import surfacechem
from mechanisms import KMOL, mechanism_texts, pulled, states
from surfacechem.documents import mechanisms
from surfacechem.errors import InputError
from surfacechem.laws.free_energy import Constant, ConstantInterfaceCapacity
from surfacechem.laws.loading import Hold
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.thermo import IdealMixture
from surfacechem.model.assemble import assemble
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Interface, Scene


def scene(mechanism, initial, capacity=None, T_c=None, stretch=None, loading=None):
    """Two bodies and a mechanism between them, whose interface may store heat, be stretched or be kept at T_c."""
    interface = Interface(
        T_c or "T_c",
        [*mechanism.potentials, *([ConstantInterfaceCapacity(C_c=capacity)] if capacity else [])],
        reactions=mechanism.reactions,
        variables=mechanism.variables,
        bonds=mechanism.bonds,
        sites=mechanism.sites,
    )
    return Scene(
        bodies(energy=Constant, C_1=2000.0, C_2=1000.0),
        interface,
        heat=[path("lower", "interface", 2500.0), path("upper", "interface", 700.0)],
        loading={**(loading or {}), **({"J_c": Hold(level=stretch)} if stretch else {})},
        T_0=298.15,
        initial={"T_1": 298.15, "T_2": 310.0, "T_c": 302.0, **initial},
    )


def numbers(system, expressions, point):
    """Values of expressions at a point; what it does not name has its initial or nominal value."""
    full = {parameter.symbol: parameter.at(0.0) for parameter in system.parameters} | {system.t: 0.0}
    full |= {state.symbol: state.initial for state in system.states} | {state.dot: 0.0 for state in system.states}
    full |= {symengine.Symbol(name): value for name, value in point.items()}
    expanded = [system.expand(expression) for expression in expressions]
    return np.array(symengine.Lambdify(list(full), expanded)([float(value) for value in full.values()]))


def compare(mechanism, system, T, coverages, stretch=1.0, gap=0.0, force=0.0):
    """d theta / dt and the heat that the reactions release, beside Cantera's."""
    surface = pulled(mechanism, T, gap, force)
    surface.site_density = surface.site_density / stretch
    surface.coverages = coverages
    names = [variable.name for variable in mechanism.variables]
    point = dict(zip(names, surface.coverages, strict=True)) | {"T_c": T}
    rates = -numbers(system, [system.rows[name] for name in names], point)  # the rows at zero derivatives
    density = np.array([variable.density for variable in mechanism.variables]) / stretch / KMOL
    gross = (surface.creation_rates + surface.destruction_rates) / density + 1e-300
    assert np.all(abs(rates - surface.net_production_rates / density) <= 1e-12 * gross)
    heat = -numbers(
        system, [heat_row(system, names)], point | dict(zip([f"d{n}_dt" for n in names], rates, strict=True))
    )
    h = surface.partial_molar_enthalpies
    size = abs(surface.creation_rates + surface.destruction_rates) @ (
        abs(h) + ct.gas_constant * T * (1 + abs(np.log(surface.coverages)))
    )
    assert abs(heat[0] + stretch * (h @ surface.net_production_rates)) <= 1e-12 * stretch * size + 1e-300


def heat_row(system, names):
    """Part of the interface's energy balance that the coverages' derivatives bring."""
    row = system.expand(system.rows["T_c"])
    return row - row.subs({symengine.Symbol(f"d{name}_dt"): 0 for name in names})


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("mechanisms") / "random.yaml"


@given(data=st.data(), stretch=st.sampled_from([1.0, 1.25]))
@settings(max_examples=8)
def test_random_mechanisms_in_a_scene(file, data, stretch):
    """Also on a stretched surface, where all densities are the current ones."""
    ct.suppress_thermo_warnings(True)
    file.write_text(data.draw(mechanism_texts()), encoding="utf-8")
    mechanism = load_mechanism(file)
    T, coverages = data.draw(states(len(mechanism.variables)))
    initial = {variable.name: theta for variable, theta in zip(mechanism.variables, coverages, strict=True)}
    compare(mechanism, assemble(scene(mechanism, initial, 1e6, stretch=stretch)), T, coverages, stretch)


FILM = """
T_0: 298.15 K
bodies: {lower: {temperature: T, C: 2 kJ/m^2/K}, upper: {temperature: T, C: 1 kJ/m^2/K}}
interface: {temperature: T, mechanism: {file: dna-film.yaml, bonds: [AB(s)]}}
initial: {T: 298.15 K, coverages: {A(s): 0.5, B(s): 0.5}}
run: {until: 1 ms, outputs: 21}
"""


def test_the_site_density_is_one_parameter_of_all_species(tmp_path):
    (tmp_path / "case.yaml").write_text(FILM)
    text = (mechanisms() / "dna-film.yaml").read_text(encoding="utf-8")
    (tmp_path / "dna-film.yaml").write_text(text)
    simulation = surfacechem.load(tmp_path / "case.yaml")
    (tmp_path / "dna-film.yaml").write_text(text.replace("site-density: 1.0e-4", "site-density: 3.0e-4"))
    expected = surfacechem.load(tmp_path / "case.yaml").run().dataset
    sites = simulation.model.values()["interface.sites"]
    found = simulation.run({"interface.sites": 3 * sites})
    for name in ("theta_AB_s", "theta_A_s", "T", "phi"):
        np.testing.assert_allclose(found.dataset[name], expected[name], rtol=1e-9, atol=1e-12)
    assert found.audit.site_error < 1e-9
    assert abs(float(found.dataset["theta_AB_s"][-1]) - float(simulation.run().dataset["theta_AB_s"][-1])) > 0.005


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"initial.theta_AB_s": 0.3}, "the coverages sum to more than one"),
        ({"initial.theta_A_s": 0.2}, "the coverages sum to less than one"),
    ],
)
def test_coverages_that_are_changed_sum_to_one(changes, words):
    simulation = surfacechem.load(FILM)
    with pytest.raises(InputError, match=words):
        simulation.run(changes)
    with pytest.raises(InputError, match=words):
        simulation.sweep({path: [0.0, value] for path, value in changes.items()}, combine="zip")
    whole = simulation.run({"initial.theta_AB_s": 0.3, "initial.theta_A_s": 0.35, "initial.theta_B_s": 0.35})
    assert whole.status == "finished"
    with pytest.raises(InputError, match=r"theta_AB_s is a coverage; give it in `coverages: \{AB\(s\): \.\.\.\}`"):
        surfacechem.load(FILM, "initial.theta_AB_s=0.3")


def test_a_run_that_leaves_the_range_of_the_thermodynamic_data_says_so():
    case = surfacechem.load("dna-adhesive", {"run.until": "1 s"}).case
    interface = case.scene.interface
    narrow = [
        replace(law, temperatures=(300.0, 320.0)) if isinstance(law, IdealMixture) else law
        for law in interface.potentials
    ]
    changed = replace(case, scene=replace(case.scene, interface=replace(interface, potentials=narrow)))
    inside, outside = (Simulation(c).run() for c in (case, changed))
    assert inside.warnings == ()
    assert "ideal mixture is an extrapolation: T_c ran from" in outside.warnings[0]
    assert outside.attributes["warnings"] == outside.warnings[0]


def test_what_cantera_warns_of_is_a_warning_of_the_run(tmp_path):
    """Polynomials that do not meet make the heat content jump."""
    text = (mechanisms() / "selectin.yaml").read_text()
    constant = next(line for line in text.splitlines() if "model: constant-cp" in line and "h0: 0 kJ/mol" in line)
    data = "[[2.5, 0, 0, 0, 0, -100, 1], [2.6, 0, 0, 0, 0, -100, 1]]"
    broken = f"  thermo: {{model: NASA7, temperature-ranges: [200, 310, 1000], data: {data}}}"
    (tmp_path / "broken.yaml").write_text(text.replace(constant, broken, 1))
    ct.suppress_thermo_warnings(False)
    mechanism = load_mechanism(tmp_path / "broken.yaml")
    assert len(mechanism.remarks) == 3
    assert all("broken.yaml: Cantera: NasaPoly2::validate: For species" in remark for remark in mechanism.remarks)


def test_forty_species_follow_the_exponential_of_their_matrix(tmp_path):
    # From thirty variables on the stepper exchanges columns and passes over zeros.
    n, draw = 40, np.random.default_rng(3)
    pairs = [(i, (i + 1) % n) for i in range(n)] + [(i, (i + draw.integers(2, n)) % n) for i in range(n)]
    rates = 10 ** draw.uniform(-2, 4, len(pairs))
    entries = [
        f"- {{equation: A{i} => A{j}, rate-constant: {{A: {k:.17g}, b: 0, Ea: 0}}}}"
        for (i, j), k in zip(pairs, rates, strict=True)
    ]
    species = [f"- {{name: A{i}, composition: {{H: 1}}, thermo: {{model: constant-cp}}}}" for i in range(n)]
    names = ", ".join(f"A{i}" for i in range(n))
    phase = f"- {{name: s, thermo: ideal-surface, site-density: 1e-5 mol/m^2, kinetics: surface, species: [{names}]}}"
    text = ["phases:", phase, "species:", *species, "reactions:", *entries]
    (tmp_path / "many.yaml").write_text("\n".join(text))
    (tmp_path / "case.yaml").write_text(
        "bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}\n"
        "interface: {temperature: 300 K, mechanism: {file: many.yaml}}\n"
        "initial: {coverages: {A0: 1}}\nrun: {until: 0.1 s, outputs: 2, rtol: 1e-10}\n"
    )
    matrix = np.zeros((n, n))
    for (i, j), k in zip(pairs, rates, strict=True):
        matrix[i, i] -= k
        matrix[j, i] += k
    end = surfacechem.load(tmp_path / "case.yaml").run(error="balances").trajectory.result.y
    np.testing.assert_allclose(end[:n], expm(0.1 * matrix)[:, 0], rtol=1e-9, atol=1e-14)
