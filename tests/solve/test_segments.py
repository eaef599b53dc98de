"""Loads that begin, turn round or end at nothing: what is touched is not passed, what is not exchanged not lost."""

import math

import numpy as np
import pytest
from scenes import bodies

import surfacechem
from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.laws.friction import Coulomb, MohrCoulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.laws.longrange import VanDerWaalsFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.results.event_table import event_columns
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

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


# -- kinks that fall on breakpoints of the loading are events like any other, once each -------------------------------


def times(scene, solver="radau", rtol=1e-11):
    run = Run(np.linspace(0.0, 4.0, 9).tolist(), rtol, solver=solver)
    columns = {column.name: column.values for column in event_columns([Model(assemble(scene)).solve(run)])}
    return columns["event_time"][columns["event_name"] == "v"]


@pytest.mark.parametrize("solver", ["radau", "lsoda"])
@pytest.mark.parametrize("breaks", [[], [1.0], [1.0, 2.5], [0.7, 2.0, 3.0]])
def test_a_velocity_reverses_at_breakpoints_of_another_load(breaks, solver):
    pressure = Table(times=[0.0, *breaks, 4.0], values=[1e5 * (1 + k % 2) for k in range(2 + len(breaks))])
    loading = {"p": pressure, "v": Harmonic(amplitude=1e-3, frequency=0.5)}
    scene = Scene(bodies("T", "T"), Interface("T", [], [Coulomb(mu=0.3)]), (), loading, None, 300.0, {"T": 300.0})
    for rtol in (1e-9, 1e-11):
        np.testing.assert_allclose(times(scene, solver, rtol), [1.0, 2.0, 3.0], rtol=0, atol=1e-13)


def test_so_it_does_in_a_scene_with_transitions():
    """The stretches of such a run end at the breakpoints, too."""
    push = Table(times=[0.0, 1.0, 4.0], values=[-1e-6, -2e-6, -1e-6])
    loading = {"w_n": push, "v": Harmonic(amplitude=1e-3, frequency=0.5)}
    rubbing, mount = Interface("T", [], [Coulomb(mu=0.3)]), Mounting(k=1e11)
    scene = Scene(bodies("T", "T"), rubbing, (), loading, None, 300.0, {"T": 300.0}, normal=mount)
    assert assemble(scene).edges
    np.testing.assert_allclose(times(scene), [1.0, 2.0, 3.0], rtol=0, atol=1e-13)


def test_a_step_ends_where_a_given_gap_closes():
    """The traction bends at touch; the work on the gap is the change of the energy, whatever felt the gap."""
    law, g = VanDerWaalsFlatFlat(A_H=1e-12, D_0=4e-8), Ramp(start=7e-8, rate=-3e-8)
    scene = Scene(bodies("T", "T"), Interface("T", [law]), (), {"g_n": g}, None, 300.0, {"T": 300.0})
    trajectory = Model(assemble(scene)).solve(Run([0.0, 4.0], 1e-9))
    accounts = [account.quantity.name for account in trajectory.model.system.ledger]
    work = law.energy(g_n=-5e-8) - law.energy(g_n=7e-8)
    assert trajectory.result.ledger[accounts.index("W_g_n")] == pytest.approx(work, rel=1e-10)
    (closes,) = trajectory.result.events.t
    assert closes == pytest.approx(7 / 3, rel=1e-14)


def test_kinks_at_one_moment_are_events_once_each():
    """Both components of a velocity reverse together."""
    swing = {"amplitude": 1e-3, "frequency": 0.37, "phase": 0.3}
    loading = {"p": Hold(level=1e5), "v": Harmonic(**swing), "v_2": Harmonic(**swing)}
    scene = Scene(bodies("T", "T"), Interface("T", [], [Coulomb(mu=0.3)]), (), loading, None, 300.0, {"T": 300.0})
    trajectory = Model(assemble(scene)).solve(Run([0.0, 6.0], 1e-11))
    columns = {column.name: column.values for column in event_columns([trajectory])}
    turns = [(k * math.pi - 0.3) / (2 * math.pi * 0.37) for k in range(1, 5)]
    for name in ("v", "v_2"):
        np.testing.assert_allclose(columns["event_time"][columns["event_name"] == name], turns, rtol=1e-13)


def test_a_run_ends_where_tension_reaches_the_strength():
    """Friction of Mohr and Coulomb falls with the pressure to p = -t_n_max, beyond which no contact bears it."""
    law = MohrCoulomb(mu=0.3, t_n_max=5e4)
    loading = {"p": Ramp(start=1e5, rate=-1e5), "v": Hold(level=1e-3)}
    scene = Scene(bodies("T", "T"), Interface("T", [], [law]), (), loading, None, 300.0, {"T": 300.0})
    trajectory = Model(assemble(scene)).solve(Run([0.0, 4.0], 1e-9))
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith("p fell below -t_n_max, where the law mohr-coulomb ends")
    assert trajectory.result.t == pytest.approx(1.5, rel=1e-9)
    accounts = [account.quantity.name for account in trajectory.model.system.ledger]
    work = trajectory.result.ledger[accounts.index("W_mohr_coulomb")]
    assert work == pytest.approx(0.3 * 1e-3 * 1.5e5 * 1.5 / 2, rel=1e-10)


# -- sliding that begins and ends where large loads cancel: rounding of the loads is no error of the step -------------

DAMPED = """\
T_0: 300 K
bodies:
  lower: {temperature: 300 K}
  upper: {temperature: 300 K}
interface:
  temperature: 300 K
  friction:
    - coulomb: {mu: 0.4}
    - viscous: {eta: 0.1 Pa s}
mechanics:
  tangential: {k: 1e8 Pa/m, c_b: 1e6 Pa s/m, c_g: 1e5 Pa s/m}
loading:
  p: 1e5 Pa
  g_n: 1e-6 m
  w_t: {harmonic: {amplitude: 2 mm, frequency: 1 Hz}}
run: {until: 3 s}
"""


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13])
def test_a_damped_slider_that_turns_six_times(rtol):
    """It starts with velocities of 1e-17 m/s, from tractions of 4e4 Pa that cancel."""
    model = Model(load_text(DAMPED, "damped").system())
    trajectory = model.solve(Run(times=(0.0, 3.0), rtol=rtol))
    assert trajectory.status == "finished", trajectory.reason
    assert [jump.edge.name for jump in trajectory.jumps].count("stop") == 6
    assert audit(trajectory).energy_error < max(100 * rtol, 1e-9)
