"""Errors of the assembly come with the line of the section that they speak of."""

import pytest

from surfacechem.errors import InputError
from surfacechem.format import load_text

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
RESERVOIRS = BODIES.replace("T_1, C: 1 kJ/m^2/K", "300 K").replace("T_2, C: 1 kJ/m^2/K", "310 K")

MISTAKES = [
    (
        BODIES.replace("T_0: 300 K\n", "") + RUN,
        "case.yaml:2: bodies.lower: the body lower reads the reference temperature T_0,",
    ),
    (RESERVOIRS + "run: {until: 5 s}\n", "case.yaml:2: bodies: there is nothing to solve: everything is prescribed."),
    (
        BODIES + "interface: {temperature: T_c}\nloading: {Q_c: 1 W/m^2}\n" + RUN,
        "case.yaml:5: interface.temperature: nothing determines the interface temperature T_c: it has no capacity",
    ),
    (
        BODIES + "heat:\n  - film: {between: [lower, interface]}\n" + RUN,
        "case.yaml:6: heat.film.between: the interface has no temperature. Add `interface.temperature`.",
    ),
    (
        BODIES
        + "interface:\n  temperature: T_1\n  medium: {density: 1000, heat-capacity: 4000}\n"
        + "  potential: [film-capacity]\nloading: {g_n: 1 um}\n"
        + RUN,
        "case.yaml:7: interface.medium: a film that stores heat needs a thickness. Add `thickness`.",
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
    (
        BODIES + "interface:\n  friction: [coulomb: {mu: 0.3}]\nloading: {p: 1 Pa}\n" + RUN,
        "case.yaml:6: interface.friction.coulomb: the law coulomb reads the direction of sliding, but nothing evolves",
    ),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES, ids=range(len(MISTAKES)))
def test_the_line_of_the_section(text, message):
    with pytest.raises(InputError) as error:
        load_text(text).system()
    assert str(error.value).startswith(message)
