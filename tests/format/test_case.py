"""A case file becomes a scene, a run and a reference."""

import numpy as np
import pytest

from surfacechem.contracts.terms import Varying
from surfacechem.documents import cases, document, mechanisms
from surfacechem.errors import InputError
from surfacechem.format import load, load_text
from surfacechem.laws.factors import Linear, Power
from surfacechem.laws.free_energy import BondEnergy
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.kinetics import LinearAffinity
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.scene import Sites
from surfacechem.solve.run import Run

TEXT = """\
title: Everything
T_0: 300 K
bodies:
  lower: {temperature: T_1, C: 1 kJ/m^2/K}
  upper: {temperature: T_2, C: 2 kJ/m^2/K, capacity: constant}
interface:
  temperature: T_c
  sites: {lower: 2e18 1/m^2, upper: 1e18 1/m^2, reference: upper}
  potential:
    - bond-energy: {K_0: 300 J/m^2}
    - interface-capacity: {C_c: 50 J/m^2/K}
    - bond-energy: {K_0: 1 J/m^2}
  friction:
    - coulomb:
        mu:
          value: 30 %
          times:
            - power: {exponent: -1}
            - linear: {of: v, slope: 0.1 s/mm, about: 10 mm/s}
  bonding:
    - linear-affinity: {c_r: 3.3e12 1/J/s}
heat:
  - conductance: {between: [lower, interface], h: 2.5 kW/m^2/K}
  - conductance: {between: [interface, upper], h: 2.5 kW/m^2/K}
  - conductance: {between: [upper, surroundings], h: 12}
surroundings: {temperature: 25 degC}
loading:
  v: 20 mm/s
  p: {ramp: {start: 0 Pa, rate: 1 kPa/s}}
  Q_1: {harmonic: {mean: 1 W/m^2, amplitude: 2 W/m^2, frequency: 0.5 Hz, phase: 90 deg}}
  Q_2: {table: {times: [0 s, 1 min], values: [1, 2 kW/m^2]}}
initial: {phi: 0.1, T_1: 300, T_2: 310 K, T_c: 26.85 degC}
run: {until: 5 s, outputs: 11, accuracy: 1e-8, solver: radau, max-steps: 1000, max-seconds: 1 min}
reference: sliding
"""


@pytest.fixture(scope="module")
def everything():
    return load_text(TEXT, "everything")


def test_scene(everything):
    scene, interface = everything.scene, everything.scene.interface
    lower, upper = scene.bodies
    assert (lower.name, lower.temperature, lower.energy.name(), lower.energy.C) == ("lower", "T_1", "quadratic", 1e3)
    assert (upper.name, upper.temperature, upper.energy.name(), upper.energy.C) == ("upper", "T_2", "constant", 2e3)
    assert (interface.temperature, interface.sites) == ("T_c", Sites(2e18, 1e18, 2))
    assert [(type(law), law.place.path, law.place.line) for law in interface.potentials[::2]] == [
        (BondEnergy, "interface.potential.bond-energy", 10),
        (BondEnergy, "interface.potential.bond-energy[2]", 12),
    ]
    (bonding,) = interface.reactions
    assert (type(bonding), bonding.c_r) == (LinearAffinity, 3.3e12)
    assert [(law.between, law.h) for law in scene.heat][::2] == [
        (("lower", "interface"), 2500.0),
        (("upper", "surroundings"), 12.0),
    ]
    assert scene.initial == {"phi": 0.1, "T_1": 300.0, "T_2": 310.0, "T_c": 300.0}
    assert scene.T_0 == 300.0


def test_a_parameter_that_varies(everything):
    (friction,) = everything.scene.interface.frictions
    assert isinstance(friction, Coulomb)
    assert isinstance(friction.mu, Varying)
    power, linear = friction.mu.factors
    assert (friction.mu.value, type(power), power.of, power.exponent) == (0.3, Power, "T_c", -1.0)
    assert (type(linear), linear.of, linear.slope, linear.about) == (Linear, "v", pytest.approx(100.0), 0.01)
    assert (linear.place.path, linear.place.line) == ("interface.friction.coulomb.mu.times.linear", 19)


def test_loading(everything):
    loads = everything.scene.loading
    kinds = [type(load) for load in (everything.scene.surroundings, *loads.values())]
    assert kinds == [Hold, Hold, Ramp, Harmonic, Table]
    assert everything.scene.surroundings.level == 298.15
    assert (loads["v"].level, loads["v"].path) == (0.02, "loading.v")
    assert (loads["p"].start, loads["p"].rate, loads["p"].path) == (0.0, 1e3, "loading.p.ramp")
    assert loads["Q_1"].phase == pytest.approx(np.pi / 2, rel=1e-15)
    assert (loads["Q_2"].times, loads["Q_2"].values) == ((0.0, 60.0), (1.0, 2000.0))


def test_run(everything):
    run = everything.run
    assert run.times == tuple(np.linspace(0, 5, 11))
    assert (run.accuracy, run.rtol, run.atol, run.solver) == (1e-8, 1e-10, None, "radau")
    assert (run.max_steps, run.max_seconds) == (1000, 60.0)


def test_it_assembles_and_every_parameter_path_can_be_overridden(everything):
    settable = (p for p in everything.system().parameters if not p.internal and not (p.load and p.field))
    values = {p.path: 0.99 * (p.value or 0.01) for p in settable if p.path != "phi_max"}
    changed = {p.path: p.value for p in load_text(TEXT, overrides=values).system().parameters}
    assert {path: changed[path] for path in values} == values


def run_of(section):
    return load("endothermic", {"run": section}).run


def test_logarithmic_times():
    times = run_of({"until": "1 s", "outputs": 5, "spacing": "logarithmic", "first": "1 ms"}).times
    assert times == pytest.approx((0.0, 1e-3, 1e-2, 1e-1, 1.0))
    assert times[-1] == 1.0


@pytest.mark.parametrize("times", [["0 s", "1 ms", 2], ["1 ms", 2]])
def test_listed_times(times):
    assert run_of({"times": times}).times == (0.0, 1e-3, 2.0)


@pytest.mark.parametrize(
    ("section", "rtol"),
    [({}, Run.rtol), ({"accuracy": 1e-20}, 1e-13), ({"accuracy": 1}, 1e-3), ({"rtol": 1e-5}, 1e-5)],
)
def test_tolerance(section, rtol):
    assert run_of({"until": 1, **section}).rtol == pytest.approx(rtol)


def test_reference_with_parameters():
    given = load("sliding-dry", {"reference": {"name": "sliding", "D": "1 kW/m^2"}}).reference
    assert (given.name, given.options) == ("sliding", {"D": 1000.0})


def test_a_number_for_a_parameter_that_varies_keeps_its_factors():
    changed = load("endothermic", ["interface.bonding.linear-affinity.c_r=7e15 1/J/s"])
    (law,) = changed.scene.interface.reactions
    assert (law.c_r.value, len(law.c_r.factors)) == (7e15, 1)


@pytest.mark.parametrize("nothing", ["", "null", None])
def test_an_override_without_a_value_removes_its_key_or_law(nothing):
    paths = ["initial.T_2", "bodies.upper.C", "bodies.upper.capacity", "heat.conductance[2]"]
    case = load("dna-adhesive", {"bodies.upper.temperature": "300 K", **dict.fromkeys(paths, nothing)})
    assert "T_2" not in case.scene.initial
    assert case.scene.bodies[1].energy is None
    assert [path.between for path in case.scene.heat] == [("lower", "interface")]
    assert load_text(case.text, base=mechanisms()).scene.initial == case.scene.initial


def test_overrides_come_in_order_and_make_what_is_missing():
    assert load("cooling-to-zero", "run.until=1 s").run.times[-1] == 1.0
    changed = load("cooling-to-zero", ["run.until=1 s", "run.until=2 s", "interface.partition=0.25", "run.outputs=3"])
    assert changed.run.times == (0.0, 1.0, 2.0)
    assert changed.scene.interface.partition == 0.25


@pytest.mark.parametrize("overrides", [[], ["run.until=1.25 s", "bodies.lower.C=3 J/m^2/K"]])
def test_a_case_can_be_read_again_from_its_text(overrides):
    first = load("endothermic", overrides)
    again = load_text(first.text, first.name)
    assert (again.text, again.run) == (first.text, first.run)
    assert [str(p) for p in again.system().parameters] == [str(p) for p in first.system().parameters]
    if not overrides:
        assert first.text == (cases() / "endothermic.yaml").read_text(encoding="utf-8")


def test_a_mechanism_is_read_again_from_its_text(tmp_path):
    with_mechanism = load("dna-adhesive")
    again = load_text(with_mechanism.text, base=tmp_path, mechanism_text=with_mechanism.mechanism_text)
    assert again.scene.interface.variables == with_mechanism.scene.interface.variables
    assert again.scene.initial == with_mechanism.scene.initial


def test_a_mechanism_beside_the_case_comes_first(tmp_path):
    original = load("dna-adhesive")
    name = document.parse(original.text).plain()["interface"]["mechanism"]
    name = name["file"] if isinstance(name, dict) else name
    content = original.mechanism_text + "# ours\n"
    (tmp_path / (name if name.endswith(".yaml") else f"{name}.yaml")).write_text(content, encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(original.text, encoding="utf-8")
    assert load(tmp_path / "mine.yaml").mechanism_text == content


def test_aliases_are_values():
    text = TEXT.replace("{temperature: T_1, C: 1 kJ/m^2/K}", "{temperature: T_1, C: &C 1 kJ/m^2/K}")
    text = text.replace("C: 2 kJ/m^2/K", "C: *C")
    assert load_text(text).scene.bodies[1].energy.C == 1000.0


def test_an_override_that_cannot_be_assembled_is_named_as_one():
    with pytest.raises(InputError, match=r"^override: initial: T evolves but has no initial value\. Add `T:` un"):
        load("endothermic", {"initial": {"phi": 0}}).system()
