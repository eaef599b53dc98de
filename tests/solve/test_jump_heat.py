"""The heat of a jump goes where that of the same process goes if it takes some time, in every temperature."""

from dataclasses import replace

import numpy as np
import pytest
from sampling import every
from scipy.integrate import quad, solve_ivp

from surfacechem.format import load_text
from surfacechem.reactor import InterfaceReactor, ReactorNet
from surfacechem.runs.check import warnings
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.jump_heat import shared_heat

CASE = """
T_0: 300 K
bodies:
  slider: {{temperature: {T_1}, capacity: constant, C: {C_1} J/m^2/K{cells}}}
  base: {{temperature: {T_2}, capacity: constant, C: 700 J/m^2/K}}
interface:
{interface}
  friction: [coulomb: {{mu: 0.5{static}}}]
{heat}
mechanics: {{{mechanics}}}
loading: {{{loading}}}
initial: {{{initial}}}
run: {{until: 4 s, outputs: 5}}
"""


def paths(**ends):
    return "heat: [" + ", ".join(f"conductance: {{between: [{e}, interface], h: {h}}}" for e, h in ends.items()) + "]"


def apart(interface, heat="", **more):
    """Two bodies with temperatures of their own; ``interface`` is what is said of the interface first."""
    return {"T_1": "T_1", "T_2": "T_2", "interface": f"  {interface}", "heat": heat, **more}


AROUND = "surroundings: {temperature: 280 K}\n"
OUTWARD = AROUND + paths(slider=2, base=1, surroundings=5)
CELLS = ", conduction: {thickness: 1 mm, conductivity: 1 W/m/K, cells: 4}"
STORING = "temperature: T_c\n  potential: [constant-interface-capacity: {C_c: 20}]"
THERMAL = {
    "slider": apart("partition: {slider: 1, base: 0}"),
    "surroundings": apart("partition: {slider: 0.2, base: 0.5, surroundings: 0.3}", AROUND),
    "paths": apart("temperature: T_c", paths(slider=9, base=1)),
    "paths outward": apart("temperature: T_c", OUTWARD),
    "mean": apart("temperature: T_c", "heat: [conductance: {between: [slider, base], h: 3, closure: mean}]"),
    "stores": apart(STORING, paths(slider=9, base=1), initial="T_c: 300"),
    "perfect": apart("temperature: T", T_1="T", T_2="T"),
    "one-sided": apart("temperature: T_1"),
    "held": apart("partition: {slider: 0.3, base: 0.7}", T_2="310 K"),
    "cells": apart("partition: {slider: 0.8, base: 0.2}", cells=CELLS),
    "area": apart("temperature: T_c", OUTWARD, loading="J_c: 2"),
}
SPOTS = "pressure-conductance: {h_c: 1e5, H: 1 GPa, h_0: 5, between: [slider, interface]}"
SQUEEZED = "pressure-conductance: {h_c: 1e4, H: 1e8, q: 0.5, between: [base, interface]}"


def touching(h="20", more=""):
    return f"heat: [{SPOTS}, conductance: {{between: [base, interface], h: {h}}}{more}]"


CHANGING = {
    "spots": apart("temperature: T_c", touching()),
    "outward": apart(
        "temperature: T_c", AROUND + touching(more=", conductance: {between: [surroundings, interface], h: 30}")
    ),
    "both": apart("temperature: T_c", f"heat: [{SPOTS}, {SQUEEZED}]"),
    "warmer": apart("temperature: T_c", touching("{value: 20, times: [power: {of: T_2, exponent: 80}]}")),
    "spots over cells": apart("temperature: T_c", touching(), cells=CELLS),
    "spots of an area": apart("temperature: T_c", touching(), loading="J_c: 2"),
}
"""Conductances that change as loads jump."""
BARE = {"bare": apart("partition: 0.5")}


def text(thermal, loading, mechanics, potential="", static="", **more):
    given = {"cells": "", "heat": "", "C_1": 1000, "static": static, "initial": ""}
    given |= (THERMAL | CHANGING | BARE)[thermal] | more
    interface = given["interface"]
    if potential:
        interface = (
            interface.replace("potential: [", f"potential: [{potential}, ")
            if "potential" in interface
            else f"{interface}\n  potential: [{potential}]"
        )
    temperatures = {given[name] for name in ("T_1", "T_2") if given[name].startswith("T")}
    initial = ", ".join([*(f"{name}: 300" for name in sorted(temperatures)), given["initial"]]).rstrip(", ")
    loading = ", ".join(filter(None, (loading, given.pop("loading", ""))))
    return CASE.format(**{**given, "interface": interface, "initial": initial}, loading=loading, mechanics=mechanics)


def initial(thermal, gaps):
    return ", ".join(filter(None, (gaps, THERMAL[thermal].get("initial"))))


def solved(case):
    solution = Simulation(load_text(case)).run(error="balances")
    assert solution.trajectory.status == "finished", solution.trajectory.reason
    assert solution.audit.energy_error < 1e-9
    assert solution.audit.violations == ()
    return solution


def temperatures(solution):
    system = solution.trajectory.model.system
    found = dict(zip((s.name for s in system.states), solution.trajectory.result.y, strict=True))
    return {name: T for name, T in found.items() if name.startswith("T")}


def same(one, other, exact):
    assert one.keys() == other.keys()
    for name, value in one.items():
        assert value == pytest.approx(other[name], rel=0, abs=exact), name


def table(name, levels, unit, jump):
    """A level from 0 to 2 s and another one until 4 s, with a jump or a steep ramp between."""
    return f"{name}: {{table: {{times: [0, 2, {2 + jump}, 4], values: [{', '.join(f'{x} {unit}' for x in levels)}]}}}}"


SLIDER = {
    "rigid": ("tangential: {k: 1e9, beta_1: 0.9}", ""),
    "elastic": ("tangential: {k: 1e9, beta_1: 0.9}", "tangential-stiffness: {E_t: 4e9}"),
    "pressed": ("normal: {k: 1e12, beta_1: 0}, tangential: {k: 1e9, beta_1: 0.9}", "penalty: {E_n: 1e15}"),
}


SCENES = [(thermal, "rigid") for thermal in ("surroundings", "paths outward", "mean", "held", "cells")]
SCENES += [("stores", "elastic")]


def pressure_falls(thermal, slider, jump):
    mechanics, potential = SLIDER[slider]
    normal = table("p", [2, 2, 0.2, 0.2], "MPa", jump)
    if slider == "pressed":
        normal = "w_n: -2 um, " + table("F_n", [0, 0, 1.8, 1.8], "MPa", jump)
    return text(thermal, f"{normal}, w_t: {{ramp: {{rate: 0.4 mm/s}}}}", mechanics, potential)


@pytest.mark.parametrize(("thermal", "slider"), every(2, SCENES))
def test_a_pressure_that_jumps_is_one_that_falls_fast(thermal, slider):
    jumped, swift = (solved(pressure_falls(thermal, slider, jump)) for jump in (0, 1e-6))
    assert max(jump.released for jump in jumped.trajectory.jumps) > 100
    same(temperatures(jumped), temperatures(swift), 1e-5)


def test_libraries_and_sweeps_heat_the_same():
    case = load_text(pressure_falls("paths outward", "rigid", 0).replace("outputs: 5", "outputs: 5, rtol: 1e-9"))
    simulation = Simulation(case)
    run = simulation.run(error="balances").dataset
    other = Simulation(replace(case, own_run=replace(case.run, solver="lsoda"))).run(error="balances").dataset
    np.testing.assert_allclose(other["T_1"], run["T_1"], atol=1e-6)
    partition = Simulation(load_text(pressure_falls("slider", "rigid", 0)))
    swept = partition.sweep({"interface.partition": [1.0, 0.75, 0.0]}).dataset
    rise, other = (swept[name].isel(time=-1).values - 300 for name in ("T_1", "T_2"))
    np.testing.assert_allclose(rise / rise[0], [1, 0.75, 0], atol=1e-12)
    np.testing.assert_allclose(1000 * rise + 700 * other, 1000 * rise[0], rtol=1e-12)


@pytest.mark.parametrize(("thermal", "levels"), [("stores", [2, 2, 0.2, 0.2]), ("spots", [0.2, 0.2, 2, 2])])
def test_a_network_jumps_and_heats_the_same(thermal, levels):
    """What sticks slips where the pressure falls, and what slides sticks where it rises."""
    loading = f"{table('p', levels, 'MPa', 0)}, w_t: {{ramp: {{rate: 0.4 mm/s}}}}"
    case = text(thermal, loading, *SLIDER["rigid"])
    solution, interface = solved(case), InterfaceReactor(load_text(case))
    net = ReactorNet([interface])
    net.rtol, net.atol = 1e-10, 1e-16
    net.advance(4.0)
    ours, theirs = interface.scene.events.instant.jumps, solution.trajectory.jumps
    assert [jump.edge.name for jump in ours] == [jump.edge.name for jump in theirs]
    assert [jump.released for jump in ours] == pytest.approx([jump.released for jump in theirs], abs=1e-6)
    assert interface["u_t"] == pytest.approx(float(solution.dataset["u_t"][-1]), rel=1e-9)
    assert interface.dataset.attrs["energy_error"] < 1e-6
    for name, T in temperatures(solution).items():
        assert interface[name] == pytest.approx(T, abs=1e-5)


# -- heat that is shared by the moment: conductances change along the way of the loads

SLIDER["both"] = (SLIDER["pressed"][0], f"{SLIDER['pressed'][1]}, {SLIDER['elastic'][1]}")
PRESSING = {
    "p": lambda jump, low: table("p", [2, 2, low, low], "MPa", jump),
    "F_n": lambda jump, low: "w_n: -2 um, " + table("F_n", [0, 0, 2 - low, 2 - low], "MPa", jump),
    "w_n": lambda jump, low: table("w_n", [-2, -2, -low, -low], "um", jump),
}
VARIED = [
    ("both", "elastic", "p", -0.4, ""),
    ("spots over cells", "rigid", "p", 0.4, ""),
    ("spots of an area", "rigid", "p", 0.4, ", mu_s: 0.6"),
    ("spots", "both", "F_n", 0.7, ""),
    ("spots", "pressed", "w_n", 0.7, ""),
]


def limit_of_ramps(case, durations=(1e-4, 1e-5)):
    """Temperatures at the end as a ramp takes no time; their error is in proportion to its duration."""
    slow, swift = (temperatures(solved(case(duration))) for duration in durations)
    ratio = durations[0] / durations[1]
    return {name: (ratio * swift[name] - slow[name]) / (ratio - 1) for name in swift}


def pressing(thermal, slider, load, rate, static, jump, low=0.2):
    loads = f"{PRESSING[load](jump, low)}, w_t: {{ramp: {{rate: {rate} mm/s}}}}"
    return text(thermal, loads, *SLIDER[slider], static)


@pytest.mark.parametrize(("thermal", "slider", "load", "rate", "static"), every(2, VARIED))
def test_friction_heats_by_the_conductances_of_each_moment_of_a_jump(thermal, slider, load, rate, static):
    """The normal gap, where there is one, follows a jump by more work than a ramp: its heat of 2 mJ is known."""
    jumped = solved(pressing(thermal, slider, load, rate, static, 0))
    limit = limit_of_ramps(lambda jump: pressing(thermal, slider, load, rate, static, jump))
    found = temperatures(jumped)
    assert found.pop("T_c") == pytest.approx(limit.pop("T_c"), abs=1e-5)
    if load != "p":
        found["T_2"] -= (1.8e6) ** 2 / (2 * 1.001e15) / 700
    same(found, limit, 1e-7 if load != "p" else 1e-9)


def test_the_heat_of_a_jump_by_hand():
    """By quadrature: the slider has the traction mu p, and takes h / (h + 20) of the heat, at each pressure p."""
    mechanics = SLIDER["rigid"][0]
    loads = f"{table('p', [2, 2, 0.2, 0.2], 'MPa', 0)}, w_t: {{ramp: {{rate: 0.4 mm/s}}}}"
    trajectory = solved(text("spots", loads, mechanics)).trajectory
    (jump,) = trajectory.jumps
    k = 1e9
    first = min(2e6, k * 0.8e-3 / 0.5)

    def heat(p):
        return 0.5 * p * 0.5 / k

    def share(p):
        h = 5 + 1e5 * (p / 1e9) ** 0.95
        return h / (h + 20)

    whole = quad(heat, 0.2e6, first)[0]
    slider = quad(lambda p: share(p) * heat(p), 0.2e6, first, epsabs=1e-10, epsrel=1e-12)[0]
    names = [state.name for state in trajectory.model.system.states]
    rises = dict(zip(names, jump.after.y - jump.before.y, strict=True))
    assert jump.released == pytest.approx(whole, rel=1e-10)
    assert 1000 * rises["T_1"] == pytest.approx(slider, rel=1e-10)
    assert 700 * rises["T_2"] == pytest.approx(whole - slider, rel=1e-10)


def test_the_heat_of_a_jump_of_friction_that_weakens_by_hand():
    """An initial value problem over the pressure: k (w - u) = mu p, mu falls with T_2, and h_2 grows with it."""
    case = pressing("warmer", "rigid", "p", 0.4, "", 0)
    trajectory = solved(
        case.replace("mu: 0.5", "mu: {value: 0.5, times: [power: {of: T_2, exponent: -40}]}")
    ).trajectory
    (jump,) = trajectory.jumps

    def rates(part, y):
        p, T_2 = 2e6 - 1.8e6 * part, y[1]
        mu, h_1, h_2 = 0.5 * (T_2 / 300) ** -40, 5 + 1e5 * (p / 1e9) ** 0.95, 20 * (T_2 / 300) ** 80
        s = h_1 / (h_1 + h_2)
        # du = -d(mu p) / k, and the heat mu p du warms the base by its share, which changes mu.
        weakens = -40 * mu / T_2
        way = mu * 1.8e6 / 1e9 / (1 + p * weakens * (1 - s) * mu * p / 700 / 1e9)
        return [s * mu * p * way / 1000, (1 - s) * mu * p * way / 700]

    begins = (2e6 - 0.8e6 / 0.5) / 1.8e6
    end = solve_ivp(rates, (begins, 1.0), [300.0, 300.0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    names = [state.name for state in trajectory.model.system.states]
    after = dict(zip(names, jump.after.y, strict=True))
    assert [after["T_1"], after["T_2"]] == pytest.approx(end.tolist(), abs=1e-9)


@pytest.mark.parametrize("feeds_back", [False, True])
def test_heat_is_shared_along_a_way_within_the_tolerance(feeds_back):
    def moments(ways, taken):
        share = 1 / (1 + taken[:, 0]) if feeds_back else np.where(ways < 0.3, 0.2, 1 / (1 + ways))
        return ways**2, np.array([share, 1 - share]).T

    # The square root of 3, less 1, where it feeds back: (1 + Q) dQ = dH.
    exact = 3**0.5 - 1 if feeds_back else 0.2 * 0.09 + 2 * (0.7 - np.log(2 / 1.3))
    for small in (1e-4, 1e-8, 1e-12):
        one, other = shared_heat(moments, 2, small, feeds_back=feeds_back)
        assert abs(one - exact) <= small
        assert one + other == pytest.approx(1, rel=1e-13)


# -- what gives way by itself


FRICTION = "  friction: [coulomb: {mu: 0.5}]"
ZONE = "exponential-cohesive-zone: {t_max: 10 MPa, g_0: 1 um, E_n: 1e15 Pa/m}"
SOFTENING = "bond-stiffness: {E_b: 1e13, E_n: 1e15}, linear-enthalpy: {H_r: 1}"
TEARING = "  sites: 1e18\n  bonding: [compliant-debonding: {t_max: 10 MPa, E_b: 1e13, g_f: 4 um}]"


@pytest.mark.parametrize(("thermal", "law"), [("paths", "snap"), ("held", "tear")])
def test_a_snap_heats_as_the_interface_would_in_a_little_time(thermal, law):
    """A faint damper in parallel with the interface turns the same energy into heat there."""
    potential, laws = (ZONE, "") if law == "snap" else (SOFTENING, TEARING)
    ends = []
    for damper in ("", ", c_g: 1e6"):
        mechanics = f"normal: {{k: 1e12, beta_1: 0.9{damper}}}"
        started = initial(thermal, "g_n: 0, phi: 1" if laws else "g_n: 0")
        given = text(thermal, "w_n: {ramp: {rate: 5 um/s}}", mechanics, potential, initial=started)
        ends.append(solved(given.replace(FRICTION, laws)))
    snapped, moved = ends
    (jump,) = (jump for jump in snapped.trajectory.jumps if jump.edge.name == law)
    assert jump.released > 1
    same(temperatures(snapped), temperatures(moved), 1e-3 * max(jump.after.y - jump.before.y))


# -- what the supports dissipate


@pytest.mark.parametrize(("thermal", "axis"), [("paths", "n"), ("stores", "t")])
def test_what_follows_a_traction_that_jumps_is_damped_by_its_own_support(thermal, axis):
    potential, support = "penalty: {E_n: 1e15}, tangential-stiffness: {E_t: 3e9}", "k: 1e9, beta_1: 0.25"
    loads = table(f"F_{axis}", [0, 0, 3, 3], "MPa", 0) + f", w_{axis}: 0, "
    loads += "w_t: 0" if axis == "n" else "w_n: -10 um"
    ends = []
    for damper in ("", ", c_b: 1e5"):
        if axis == "n":
            mechanics = f"normal: {{{support}{damper}}}, tangential: {{k: 1e9, beta_1: 0.9}}"
            laws = potential.replace("penalty: {E_n: 1e15}", "normal-stiffness: {E_n: 3e9}")
        else:
            mechanics, laws = f"normal: {{k: 1e12, beta_1: 0.9}}, tangential: {{{support}{damper}}}", potential
        started = {"initial": initial(thermal, "g_n: 0")} if axis == "n" else {}
        given = text(thermal, loads, mechanics, laws, **started)
        ends.append(solved(given if axis == "t" else given.replace(FRICTION, "")))
    jumped, moved = ends
    assert sum(jump.released for jump in jumped.trajectory.jumps) == pytest.approx(9e12 / 8e9, rel=1e-9)
    same(temperatures(jumped), temperatures(moved), 1e-3)


@pytest.mark.parametrize("jumps", [True, False])
def test_check_says_that_the_parts_of_a_support_matter_only_where_it_makes_heat(jumps):
    """A support without a damper makes heat only as the gap follows a load that jumps."""
    loads = table("F_n", [-2, -2, -1, -1], "MPa", 0 if jumps else 1) + ", w_n: 0, w_t: {ramp: {rate: 0.25 mm/s}}"
    moved = []
    for part in (1, 0):
        mechanics = f"normal: {{k: 1e9 Pa/m, beta_1: {part}}}, tangential: {{k: 1e9 Pa/m}}"
        case = text("bare", loads, mechanics, "penalty: {E_n: 1e13 Pa/m}", ", mu_s: 0.6")
        simulation = Simulation(load_text(case))
        moved.append(float(simulation.run(error="balances").dataset.T_2[-1]))
        idle = [said for said in warnings(simulation.model.system) if f"beta_1 = {part} has no effect" in said]
        assert bool(idle) != jumps
    assert (abs(moved[0] - moved[1]) > 1e-6) == jumps


def test_where_a_way_has_no_numbers_nothing_is_shared():
    found = shared_heat(lambda ways, _: (ways, np.full((len(ways), 2), np.nan)), 2, 1e-9, feeds_back=False)
    assert np.all(np.isnan(found))


def test_what_a_pressure_stops_does_not_cool_the_interface_first():
    """The limit rises faster than the spring pulls: sliding stops, as if the pressure had jumped."""
    runs = []
    for rise in (0, 1e-3):
        loads = f"p: {{table: {{times: [0, 3, {3 + rise}, 4], values: [0.5e6, 0.5e6, 2e6, 2e6]}}}}"
        given = text("paths", f"{loads}, w_t: {{ramp: {{rate: 0.25 mm/s}}}}", "tangential: {k: 1e9 Pa/m}")
        runs.append(Simulation(load_text(given)).run(error="balances"))
    assert [run.status for run in runs] == ["finished", "finished"]
    assert runs[1].dataset.event_name.values.tolist() == ["slip forward", "stop"]
    for name in ("u_t", "T_1", "T_2", "T_c"):
        np.testing.assert_allclose(runs[1].dataset[name][-1], runs[0].dataset[name][-1], rtol=1e-8)
