"""A case file becomes a scene, a run and a reference."""

import pytest

from surfacechem.documents import document, mechanisms
from surfacechem.errors import InputError
from surfacechem.format import load, load_text

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


def test_it_assembles_and_every_parameter_path_can_be_overridden(everything):
    settable = (p for p in everything.system().parameters if not p.internal and not (p.load and p.field))
    values = {p.path: 0.99 * (p.value or 0.01) for p in settable if p.path != "phi_max"}
    changed = {p.path: p.value for p in load_text(TEXT, overrides=values).system().parameters}
    assert {path: changed[path] for path in values} == values


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


COLD = """
T_0: 300
interface: {temperature: T}
bodies: {lower: {temperature: T}, upper: {temperature: {ramp: {start: 20, rate: 1}}}}
initial: {T: 25}
"""


def test_a_temperature_without_a_unit_that_is_cold_in_kelvin_is_told():
    remarks = load_text(COLD).scene.interface.remarks
    told = "25 without a unit is 25 K, which is -248.15 degC; write `25 K`, or `25 degC` if that is meant"
    assert remarks[1] == f"initial.T: {told}"
    assert [text.partition(":")[0] for text in remarks] == ["bodies.upper.temperature.ramp.start", "initial.T"]
    meant = COLD.replace("20", "20 degC").replace("25", "25 K")
    assert load_text(meant).scene.interface.remarks == ()
