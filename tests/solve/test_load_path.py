"""Loads that jump: where gaps without inertia come to rest, whether what slides sticks, what works and what is heat."""

import numpy as np
import pytest

from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

OWN, LIBRARY = "radau", "lsoda"

NORMAL = """
T_0: 300 K
bodies:
  a: {{temperature: T, capacity: constant, C: 10 J/m^2/K}}
  b: {{temperature: T, capacity: constant, C: 10 J/m^2/K}}
interface:
  temperature: T
  potential:
    - {potential}
mechanics: {{normal: {{{mount}}}}}
loading: {{{loading}}}
initial: {{T: 300 K{initial}}}
run: {{until: 4 s, outputs: 9, solver: {solver}}}
"""
STEP = "F_n: {table: {times: [0, 1, 1, 2, 4], values: [0, 1 MPa, 5 MPa, 5 MPa, -1 MPa]}}"
ELASTIC = "normal-stiffness: {E_n: 3e12 Pa/m}"

SLIDER = """
T_0: 300 K
bodies:
  a: {{temperature: T, C: 1000 J/m^2/K}}
  b: {{temperature: T, C: 1000 J/m^2/K}}
interface:
  temperature: T
{potential}
  friction:
    - coulomb: {{mu: 0.5{static}}}
mechanics: {{tangential: {{k: 1e9 Pa/m}}}}
loading: {{{loading}}}
initial: {{T: 300 K}}
run: {{until: 6 s, outputs: {outputs}, solver: {solver}}}
"""
SPRING = "  potential: [tangential-stiffness: {E_t: %s Pa/m}]"
PULLED = "w_t: {ramp: {rate: 0.25 mm/s}}"


def normal_text(loading, potential=ELASTIC, mount="k: 1e12", initial=", g_n: 0", solver=OWN):
    return NORMAL.format(potential=potential, mount=mount, loading=loading, initial=initial, solver=solver)


def normal(*args, **rest):
    return solved(normal_text(*args, **rest))


def slider(loading, potential="", static="", outputs=25, solver=OWN):
    return solved(
        SLIDER.format(loading=loading, potential=potential, static=static, outputs=outputs, solver=solver),
        exact=1e-9 if solver == OWN else 1e-7,
    )


def solved(text, exact=1e-9):
    solution = Simulation(load_text(text)).run(error="balances")
    assert solution.trajectory.status == "finished", solution.trajectory.reason
    assert solution.audit.energy_error < exact
    assert solution.audit.violations == ()
    assert solution.warnings == ()
    return solution


def pressure(times, values):
    return f"p: {{table: {{times: {times}, values: [{', '.join(f'{value} MPa' for value in values)}]}}}}"


def at(solution, name, t):
    return float(solution.dataset[name].sel(time=t, method="nearest", tolerance=1e-9))


def events(solution):
    return [(jump.edge.name, jump.t) for jump in solution.trajectory.jumps]


def released(solution, name="load"):
    return [jump.released for jump in solution.trajectory.jumps if jump.edge.name == name]


# -- normal gap


def test_a_traction_beyond_the_strength_ends_the_run_where_it_jumps():
    zone = "exponential-cohesive-zone: {t_max: 3 MPa, g_0: 1 um, E_n: 3e13 Pa/m}"
    text = normal_text(STEP, zone, "k: 0").replace("mechanics: {normal: {k: 0}}\n", "")
    trajectory = Simulation(load_text(text)).run(error="balances").trajectory
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith("F_n jumps, which is impossible: no gap follows")
    assert trajectory.result.t == 1.0


JUMPS = "w_n: {table: {times: [0, 1, 1, 4], values: [0, 1 um, 5 um, 5 um]}}"


@pytest.mark.parametrize("F", [1e6, -9e6])
def test_an_open_rigid_gap_follows_a_jump_or_closes(F):
    """It has no traction, so that all the work is heat but what bends the spring."""
    loading = f"{JUMPS}, F_n: {{table: {{times: [0, 1, 1, 2], values: [0, 0, {F}, {F}]}}}}"
    solution = solved(normal_text(loading, "", initial="").replace("  potential:\n    - \n", ""))
    after = max(5e-6 + F / 1e12, 0.0)
    assert at(solution, "g_n", 0.5) == pytest.approx(0.5e-6, rel=1e-12)
    assert at(solution, "g_n", 4.0) == pytest.approx(after, rel=1e-12)
    assert events(solution) == [("open", 0.0), ("load", 1.0)]
    heat = 1e12 / 2 * 4e-6**2 + F * (after - 1e-6) - 1e12 / 2 * (5e-6 - after) ** 2
    assert released(solution) == pytest.approx([heat], rel=1e-11)


def test_a_damper_bears_no_jump_of_the_displacement():
    with pytest.raises(InputError, match="w_n cannot jump"):
        normal(JUMPS, mount="k: 1e12, c_b: 1e12")


# -- friction

RISES = pressure([0, 3, 3, 10], [1, 1, 2, 2])


@pytest.mark.parametrize(
    ("static", "start", "again", "solver"), [("", 2.0, 5.0, OWN), (", mu_s: 0.6", 2.4, 5.8, LIBRARY)]
)
def test_what_slides_sticks_where_the_pressure_jumps_up(static, start, again, solver):
    """k = 1 GPa/m at 0.25 mm/s: the traction grows by 0.25 MPa/s, the limit jumps from 0.5 to 1 MPa."""
    solution = slider(f"{RISES}, {PULLED}", static=static, solver=solver)
    assert [name for name, _ in events(solution)] == ["slip forward", "load", "slip forward"]
    assert [t for _, t in events(solution)] == pytest.approx([start, 3.0, again], rel=1e-9)
    for t, u in ((1.0, 0.0), (2.5, 0.125e-3), (3.5, 0.25e-3), (4.75, 0.25e-3), (6.0, 0.5e-3)):
        assert at(solution, "u_t", t) == pytest.approx(u, rel=1e-9, abs=1e-16)
        assert at(solution, "t_t", t) == pytest.approx(1e9 * (0.25e-3 * t - u), rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_random_steps_of_the_loads(seed):
    """Rate-independent friction against its own rule: the traction is brought back to the limit, and no further."""
    draw = np.random.default_rng(seed)
    k, E = 1e9, 2e9 * seed
    p, w, F = draw.uniform(0.5, 2, 6), draw.uniform(-2, 2, 6), draw.uniform(-1, 1, 6)

    def steps(values, unit):
        times = [t for j in range(6) for t in (j, j + 1)]
        return (
            f"{{table: {{times: {times}, values: [{', '.join(f'{x!r} {unit}' for x in values.repeat(2).tolist())}]}}}}"
        )

    loading = f"p: {steps(p, 'MPa')}, w_t: {steps(w, 'mm')}, F_t: {steps(F, 'MPa')}"
    solution = slider(loading, SPRING % E if E else "", outputs=13)
    slipped, share = 0.0, E / (k + E) if E else 1.0
    for j in range(6):
        needed = share * (k * (w[j] * 1e-3 - slipped) + F[j] * 1e6)
        limit = 0.5e6 * p[j]
        slipped += np.sign(needed) * max(abs(needed) - limit, 0.0) / (share * k)
        t = share * (k * (w[j] * 1e-3 - slipped) + F[j] * 1e6)
        assert at(solution, "t_t", j + 0.5) == pytest.approx(t, rel=1e-9, abs=1e-6)
        u = slipped + (t / E if E else 0.0)
        assert at(solution, "u_t", j + 0.5) == pytest.approx(u, rel=1e-9, abs=1e-15)
    assert all(jump.entropy >= -1e-12 for jump in solution.trajectory.jumps)


def test_an_elastic_gap_on_a_given_displacement_slips_where_the_pressure_falls():
    """The displacement is held at 0.5 mm from 2 s on; the limit falls to 0.25 MPa at 3 s and rises again at 4 s."""
    text = SLIDER.format(
        loading=f"{pressure([0, 3, 3, 4, 4, 6], [3, 3, 0.5, 0.5, 2, 2])}, "
        "u_t: {table: {times: [0, 2, 6], values: [0, 0.5 mm, 0.5 mm]}}",
        potential=SPRING % "4e9",
        static="",
        outputs=13,
        solver=OWN,
    )
    solution = solved(text.replace("mechanics: {tangential: {k: 1e9 Pa/m}}\n", ""))
    held = 1.5 / 4 * 1e-3
    for t, g in ((2.5, held), (3.5, 0.0625e-3), (6.0, 0.0625e-3)):
        assert at(solution, "g_t", t) == pytest.approx(g, rel=1e-9)
    heat = 4e9 / 2 * (held**2 - 0.0625e-3**2)
    assert sum(jump.released for jump in solution.trajectory.jumps) == pytest.approx(heat, rel=1e-9)


# -- what creeps, and what is late ------------------------------------------------------------------------------------


def test_a_gap_that_snaps_off_does_not_pull_back_what_is_dragged():
    text = """
T_0: 300 K
bodies:
  a: {temperature: T, capacity: constant, C: 10 J/m^2/K, stiffness: 4e16 Pa/m}
  b: {temperature: T, capacity: constant, C: 10 J/m^2/K}
interface:
  temperature: T
  potential:
    - van-der-waals-flat-flat: {A_H: 1.2e-19 J}
    - penalty: {E_n: 8e19 Pa/m}
  friction:
    - mohr-coulomb: {mu: 0.3, t_n_max: 50 MPa, c: 1 kPa}
mechanics: {tangential: {k: 1e13 Pa/m}}
loading: {w_n: {table: {times: [0, 5, 12], values: [10 nm, 0.5 nm, 80 nm]}}, w_t: {ramp: {rate: 1 um/s}}}
initial: {T: 300 K, g_n: 10 nm}
run: {until: 12 s}
"""
    solution = solved(text, exact=1e-8)
    states = [state.name for state in solution.trajectory.model.system.states]
    for jump in solution.trajectory.jumps:
        assert jump.after.y[states.index("u_t")] >= jump.before.y[states.index("u_t")] * (1 - 1e-9)
        assert jump.verdict == "admissible"
