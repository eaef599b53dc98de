"""Loads that begin, turn round or end at nothing: what is touched is not passed, what is not exchanged not lost."""

import numpy as np
import pytest

import surfacechem
from surfacechem.errors import InputError

CASE = """
T_0: 300 K
bodies:
  a: {temperature: T, C: 1 kJ/m^2/K}
  b: {temperature: T, C: 1 kJ/m^2/K}
interface:
  temperature: T
"""
PENALTY = CASE + "  potential: [penalty: {E_n: 1e12}]\n"
COULOMB = CASE + "  friction: [coulomb: {mu: 0.5}]\n"
END = "initial: {T: 300 K}\nrun: {until: 2 s, outputs: 41}\n"


@pytest.fixture
def solved(tmp_path):
    def run(text):
        path = tmp_path / "edge.yaml"
        path.write_text(text)
        return surfacechem.load(path).run(error="balances")

    return run


def events(solution):
    return [(jump.edge.name, jump.t) for jump in solution.trajectory.jumps]


@pytest.mark.parametrize(
    "history",
    [
        "{ramp: {rate: -1 MPa/s}}",
        "{table: {times: [0, 1, 2], values: [-1 MPa, 0, -1 MPa]}}",
        "{harmonic: {mean: -1 MPa, amplitude: 1 MPa, frequency: 1 Hz}}",
    ],
)
def test_a_weight_that_comes_to_nothing_rests_in_contact(solved, history):
    solution = solved(PENALTY + f"loading: {{F_n: {history}}}\n" + END)
    data = solution.dataset
    assert solution.status == "finished", solution.reason
    assert events(solution) == []
    np.testing.assert_allclose(data.g_n, data.F_n / 1e12, rtol=1e-11, atol=1e-16)


def test_a_weight_that_turns_into_a_pull_ends_the_run_as_it_does(solved):
    solution = solved(PENALTY + "loading: {F_n: {ramp: {start: -1 MPa, rate: 1 MPa/s}}}\n" + END)
    assert solution.status == "stopped"
    assert events(solution)[-1][1] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("phase", [0.0, 1.0])
def test_a_pressure_that_touches_nothing_goes_on(solved, size, phase):
    wave = f"{{mean: {size}, amplitude: {size}, frequency: 1 Hz, phase: {phase} rad}}"
    data = solved(COULOMB + f"loading: {{v: 1 mm/s, p: {{harmonic: {wave}}}}}\n" + END)
    assert data.status == "finished", data.reason
    # Two whole waves: the mean pressure alone heats, by quadratic energies.
    heat = 0.5 * size * 1e-3 * 2.0
    assert float(data.dataset["T"][-1]) == pytest.approx(np.sqrt(300.0**2 + heat * 600.0 / 2000.0), rel=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e6])
def test_a_pressure_that_passes_nothing_ends_the_run(solved, size):
    wave = f"{{mean: {size}, amplitude: {size * 1.0001!r}, frequency: 1 Hz}}"
    solution = solved(COULOMB + f"loading: {{v: 1 mm/s, p: {{harmonic: {wave}}}}}\n" + END)
    assert solution.status == "stopped"
    assert solution.trajectory.result.t == pytest.approx(0.75 - np.arccos(1 / 1.0001) / (2 * np.pi), abs=1e-7)


def test_a_balance_in_which_nothing_is_exchanged_is_closed(solved):
    mount = "mechanics: {normal: {k: 1e12}}\nloading: {w_n: 0, F_n: -5 MPa}\n"
    solution = solved(CASE + "  potential: [normal-stiffness: {E_n: 3e12}]\n" + mount + END)
    assert solution.warnings == ()
    assert solution.audit.energy_error < 1e-12
    assert solution.audit.entropy_error < 1e-12


def test_a_stage_waits_for_the_traction_along_the_interface(solved):
    stages = """
mechanics: {tangential: {k: 1e9}}
loading: {p: 1 MPa}
programme:
  - load: {w_t: 1 mm/s, until: {t_t: 0.3 MPa}}
  - back: {w_t: -1 mm/s, until: {t_t: {falls-to: -0.2 MPa}}}
  - rest: {for: 0.1 s}
"""
    solution = solved(COULOMB + stages + END)
    times = dict(events(solution))
    assert times["end of load"] == pytest.approx(0.3, rel=1e-12)
    assert times["end of back"] == pytest.approx(0.8, rel=1e-12)
    assert times["end of rest"] == pytest.approx(0.9, rel=1e-12)


def test_a_traction_needs_a_pressure(solved):
    stage = "programme:\n  - load: {w_t: 1 mm/s, until: {t_t: 1 mm}}\n"
    stage += "mechanics: {tangential: {k: 1e9}}\nloading: {p: 1 MPa}\n"
    with pytest.raises(InputError, match="t_t needs a pressure"):
        solved(COULOMB + stage + END)


@pytest.mark.parametrize(("axis", "way", "text"), [("n", "normal", PENALTY), ("t", "tangential", COULOMB)])
def test_a_spring_on_nothing_is_told_what_to_hold(solved, axis, way, text):
    mount = f"mechanics: {{{way}: {{k: 1e9}}}}\nprogramme:\n  - load: {{F_{axis}: -1 MPa/s, for: 1 s}}\n"
    mount += "loading: {p: 1 MPa}\n" if axis == "t" else ""
    with pytest.raises(InputError, match=f"Prescribe `w_{axis}` under `loading`"):
        solved(text + mount + END)


def test_a_gap_that_a_law_excludes_at_the_start_is_to_be_given(solved):
    law = "  potential: [van-der-waals-flat-flat: {A_H: 1e-19}, lennard-jones-flat-flat: {n_1: 2e19, n_2: 3e19, "
    law += "psi_0: 4e-21, g_0: 0.3 nm}]\n"
    mount = "mechanics: {normal: {k: 1e18}}\nloading: {w_n: {ramp: {start: 3 nm, rate: -0.1 nm/s}}}\n"
    with pytest.raises(InputError, match="Give `g_n` under `initial`"):
        solved(CASE + law + mount + END)
    given = END.replace("{T: 300 K}", "{T: 300 K, g_n: 3 nm}")
    assert solved(CASE + law + mount + given).status == "finished"


def test_friction_under_a_prescribed_gap_heats_while_it_is_closed(solved):
    """Three cycles of a gap that is closed for half of each, by quadratic energies."""
    gap = "loading: {v: 1 mm/s, g_n: {harmonic: {amplitude: 1 um, frequency: 1.5 Hz, phase: 0.5 rad}}}\n"
    solution = solved(PENALTY + "  friction: [coulomb: {mu: 0.5}]\n" + gap + END)
    heat = 0.5 * 1e6 * 1e-3 * 2 / (3 * np.pi) * 3
    assert float(solution.dataset["T"][-1]) == pytest.approx(np.sqrt(300.0**2 + heat * 600.0 / 2000.0), rel=1e-13)
    assert solution.audit.energy_error < 1e-9


def test_a_hundred_touches_of_a_prescribed_gap_keep_the_energy(solved):
    gap = "loading: {g_n: {harmonic: {amplitude: 1 um, frequency: 50 Hz}}}\n"
    assert solved(PENALTY + gap + END).audit.energy_error < 1e-9
