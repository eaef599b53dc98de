"""Errors of the assembly carry their path in the case; the reader gives it file and line."""

import ast
from pathlib import Path

import pytest

import surfacechem
from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.solve.run import Model

BODIES = """\
T_0: 300 K
bodies:
  lower: {temperature: T_1, C: 1 kJ/m^2/K}
  upper: {temperature: T_2, C: 1 kJ/m^2/K}
"""
RUN = """\
initial: {T_1: 300 K, T_2: 310 K}
run: {until: 5 s}
"""

MISTAKES = [
    (BODIES.replace("T_0: 300 K\n", "") + RUN, "case.yaml:2: bodies.lower: the body lower reads the reference tempera"),
    (BODIES + "interface: {temperature: T_c}\nloading: {Q_c: 1 W/m^2}\n" + RUN, "case.yaml:5: interface.temperature:"),
    (BODIES + "heat:\n  - film: {between: [lower, interface]}\n" + RUN, "case.yaml:6: heat.film.between: the interfac"),
    (
        BODIES
        + "interface:\n  temperature: T_1\n  medium: {density: 1000, heat-capacity: 4000}\n"
        + "  potential: [film-capacity]\nloading: {g_n: 1 um}\n"
        + RUN,
        "case.yaml:7: interface.medium: a film that stores heat needs a thickness. Add `thickness`.",
    ),
    (
        BODIES
        + "interface:\n  temperature: T_1\n  medium: {growth: [film-wear: {L: 1 m}]}\n"
        + "  potential: [film-capacity]\nloading: {v: 1 m/s}\n"
        + RUN.replace("T_2: 310 K", "T_2: 310 K, d_m: 1 nm"),
        "case.yaml:7: interface.medium.growth: the heat that a growing film stores is neglected",
    ),
    (
        BODIES + "interface:\n  potential:\n    - penalty: {E_n: 1e12}\nloading: {p: 1 Pa, g_n: 0}\n" + RUN,
        "case.yaml:8: loading.p: p has two roles: ",
    ),
    (
        BODIES
        + "interface:\n  sites: 1e18\n  limits: [tensile-strength: {t_max: 1 MPa}]\n"
        + "  potential: [linear-enthalpy: {H_r: 1}]\n  bonding: [relaxation: {tau: 1}]\nloading: {F_n: 1 Pa}\n"
        + RUN.replace("T_2: 310 K", "T_2: 310 K, phi: 1"),
        "case.yaml:10: loading.F_n: a rigid interface under dead load has no opening. Give the mounting a stiffness k.",
    ),
    (
        BODIES
        + "loading: {p: 1 Pa}\ninterface:\n  potential:\n    - penalty: {E_n: 1e12}\n"
        + "programme:\n  - hold: {for: 1 s}\n  - press: {w_n: -1 nm/s, for: 1 s}\n  - hold: {for: 1 s}\n"
        + RUN,
        "case.yaml:12: programme.hold[2]: two stages are called 'hold'. Give each a name of its own.",
    ),
    (BODIES + "interface:\n  friction: [coulomb: {mu: 0.3}]\nloading: {p: 1 Pa}\n" + RUN, "case.yaml:6: interface.fri"),
    (
        BODIES + "interface: {sites: 1e18, bonding: [relaxation: {tau: 1}]}\n" + RUN.replace("K}", "K, phi: 2}", 1),
        "case.yaml:6: initial.phi: ",
    ),
    (BODIES.replace("T_1, C: 1 kJ/m^2/K", "T_1") + RUN, "case.yaml:3: bodies.lower: nothing evolves or prescribes T_1"),
    (BODIES + "run: {until: 5 s}\n", "case.yaml:1: T_1 evolves but has no initial value. Add `T_1:` under `initial`."),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES, ids=range(len(MISTAKES)))
def test_the_line_of_the_section(text, message):
    with pytest.raises(InputError) as error:
        load_text(text).system()
    assert str(error.value).startswith(message)


def test_an_initial_state_that_no_law_allows():
    """What only the start of a run finds out, by the path of the margin that does not hold."""
    bonds = "interface:\n  temperature: T\n  sites: 1e18\n  potential: [bond-energy: {K_0: 1, K_2: 1e7}]\n"
    case = load_text(
        BODIES.replace("T_1", "T").replace("T_2", "T")
        + bonds
        + "  bonding: [relaxation: {tau: 1}]\ninitial: {T: 300, phi: 0}\nrun: {until: 5 s}\n"
    )
    model = Model(case.system())
    with pytest.raises(InputError) as error:
        model.problem(case.run, model.values())
    assert str(case.located(error.value)).startswith("case.yaml:5: interface: at the start the heat capacity at T was")


def test_a_start_beyond_the_end_of_a_law():
    with pytest.raises(
        InputError, match=r"sliding-dry\.yaml:\d+: interface\.friction\.coulomb: at the start p fell below"
    ):
        surfacechem.run("sliding-dry", {"loading.p": "-1 kPa", "reference": ""})


def test_a_start_below_the_least_temperature_tells_it():
    told = r"T > 0 does not hold: -1e-09\). Below 1e-09 K it counts as zero\.$"
    with pytest.raises(InputError, match=told):
        surfacechem.run("exothermic", {"initial.T": 1e-300})


def test_every_error_of_the_model_carries_a_path():
    """So that rewording a message never moves it to another line."""
    folder = Path(surfacechem.__file__).parent / "model"
    found = [
        f"{file.name}:{node.lineno}"
        for file in folder.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "InputError"
        if len(node.args) + len(node.keywords) < 2
    ]
    assert found == []
