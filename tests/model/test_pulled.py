"""The work of a prescribed force belongs to the affinity of pairs of rates, as their distances define it."""

import math
from dataclasses import replace

import numpy as np
import pytest

import surfacechem
from surfacechem.contracts.terms import RateLaw
from surfacechem.errors import InputError
from surfacechem.laws import laws
from surfacechem.quantities import BOLTZMANN

KT = BOLTZMANN * 298.15
LENGTH = 3.8e-9  # 0.4 nm + 3.4 nm

MECHANISM = """
units: {{length: m, quantity: mol, activation-energy: kJ/mol}}
phases:
- {{name: clutch, thermo: ideal-surface, kinetics: surface, species: [free, a, b, c], reactions: all,
   site-density: 1e-10 mol/m^2}}
species:
- {{name: free, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: a, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: b, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: c, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
reactions:
{reactions}
"""
STEP = "- {{equation: {0} => {1}, type: Bell, rate-constant: {{A: {2}, b: 0, Ea: 0}}, x-beta: {3} nm}}\n"
CASE = """
bodies:
  lower: {{temperature: 298.15 K}}
  upper: {{temperature: 298.15 K}}
interface: {{temperature: 298.15 K, mechanism: {{file: bonds.yaml, bonds: [a, b, c]}}}}
loading: {{f: {force}}}
initial: {{coverages: {{a: 1}}}}
run: {{until: 1 s}}
"""


def pairs(folder, *steps, force="10 pN", reversible="", duplicate=False):
    """A case of pairs of rates: species, species, rates at no force, distances [nm]."""
    mark = ", duplicate: true}" if duplicate else "}"
    lines = [STEP.format(a, b, f"{k} 1/s", x).replace(" nm}", " nm" + mark) for a, b, k, x in steps]
    (folder / "bonds.yaml").write_text(MECHANISM.format(reactions="".join(lines) + reversible))
    path = folder / "case.yaml"
    path.write_text(CASE.format(force=force))
    return surfacechem.load(path)


def both(a, b, x_f, x_r, k_f=1.0, k_r=1.0):
    return (a, b, k_f, x_f), (b, a, k_r, x_r)


@pytest.mark.parametrize("force", ["0 pN", "30 pN"])
def test_vinculin_keeps_detailed_balance_under_any_force(force):
    solution = surfacechem.load("vinculin-catch-bond", {"loading.f": force}).run(error="balances")
    data = solution.dataset
    np.testing.assert_allclose(data["departure_R3_R4"], math.log(6.1 / 43) + 16.24 / 8.314462618, atol=1e-10)
    assert solution.audit.violations == ()
    assert all(verdict.consistent for verdict in solution.verdicts)


def test_the_force_works_along_the_distances():
    data = surfacechem.load("vinculin-catch-bond", {"run.outputs": 4001}).run(error="balances").dataset
    data = data.isel(time=slice(1, None))
    rate = data["R_R3"] - data["R_R4"]
    f, T = 8e-12, 298.15
    entropy = -16.24 / 6.02214076e23
    affinity = f * LENGTH - (-T * entropy + KT * np.log(data["theta_strong_s"] / data["theta_weak_s"]))
    np.testing.assert_allclose(data["sigma_R3_R4"], rate * affinity / T, rtol=1e-9)
    work = np.trapezoid(f * LENGTH * rate, data["time"])
    assert float(data["W_f"][-1] - data["W_f"][0]) == pytest.approx(float(work), rel=1e-4)


def test_around_a_cycle_distances_have_to_close(tmp_path):
    """Three pairs of 1, 1 and -2 nm close; of 1, 1 and 1 nm they do not, by 3 nm that the three share."""
    closed = [*both("a", "b", 0.4, -0.6), *both("b", "c", 0.5, -0.5), *both("c", "a", -1.0, 1.0)]
    open_ones = [*closed[:4], *both("c", "a", 0.5, -0.5)]
    for steps, expected in ((closed, 0.0), (open_ones, 1e-9 * 10e-12 / KT)):
        data = pairs(tmp_path, *steps).run(error="balances").dataset
        for label in ("R1_R2", "R3_R4", "R5_R6"):
            np.testing.assert_allclose(data[f"departure_{label}"], expected, atol=1e-10)


def test_a_reaction_whose_reverse_knows_no_force_keeps_its_equilibrium(tmp_path):
    """Between a and b one reversible reaction says that no length changes, so a pair that says otherwise departs."""
    reversible = "- {equation: a <=> b, duplicate: true, rate-constant: {A: 2 1/s, b: 0, Ea: 0}}\n"
    case = pairs(tmp_path, *both("a", "b", 0.4, -0.6), reversible=reversible, duplicate=True)
    data = case.run(error="balances").dataset
    np.testing.assert_allclose(data["departure_R1_R2"], 1e-9 * 10e-12 / KT, atol=1e-10)


# -- laws of one kind of bond -----------------------------------------------------------------------------------------

EPSILON = 4e-21
HELD = """
title: bonds under a prescribed load
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  sites: 1e16 1/m^2
  potential: [{{lattice-gas: {{epsilon: 4e-21 J}}}}{springs}]
  bonding: [{laws}]
{load}
initial: {{phi: 0.6}}
run: {{until: {until}}}
"""
RATIO = math.exp(EPSILON / (BOLTZMANN * 300.0))
ELL = -0.7e-9
BELL = f"{{bell: {{k_off: 1 1/s, x_off: 0.4 nm, k_on: {RATIO!r} 1/s, x_on: -0.3 nm}}}}"
REVERSIBLE = "{reversible-bell: {k_off: 1 1/s, x_off: 0.4 nm, x_on: -0.3 nm}}"
BESIDE = f"{REVERSIBLE}, {{linear-affinity: {{c_r: 1e20 1/J/s}}}}"


PROGRAMME = "programme: [{{pull: {{f: 1 pN/s, for: {0}.5 s}}}}]"


def held(folder, laws, load="loading: {f: 5 pN}", until="60 s", springs=""):
    path = folder / "held.yaml"
    path.write_text(HELD.format(laws=laws, load=load, until=until, springs=springs))
    return surfacechem.load(path)


def test_every_law_that_says_a_length_is_tried_below():
    """A new law that a force drives to another equilibrium joins the list."""
    assert {law.name() for law in laws(RateLaw).values() if "length" in vars(law)} == {"bell", "reversible-bell"}


LOADS = ["loading: {{f: {0} pN}}", "loading: {{t_n: {0} kPa}}", PROGRAMME]


@pytest.mark.parametrize(("law", "load"), list(zip([BELL, REVERSIBLE, BESIDE], LOADS, strict=True)))
def test_the_equilibrium_feels_the_work_of_the_force(law, load, tmp_path):
    """d ln(phi / (1 - phi)) / df = l / k_B T, with the force or the share of a traction that each bond bears."""
    found = []
    for level in (0, 10):
        solution = held(tmp_path, law, load.format(level), "90 s").run(error="balances")
        last = solution.dataset.isel(time=-1)
        force = float(last["f"])
        found.append((force, math.log(last["phi"] / (1 - last["phi"]))))
        assert solution.audit.violations == ()
        assert solution.audit.energy_error < 1e-9
    for force, log_ratio in found:
        assert log_ratio == pytest.approx((EPSILON + force * ELL) / (BOLTZMANN * 300.0), abs=1e-7)
    assert found[1][0] > 0


def test_bells_rates_depart_from_no_equilibrium_under_a_force(tmp_path):
    data = held(tmp_path, BELL, "loading: {f: {ramp: {rate: 1 pN/s}}}", "10 s").run(error="balances").dataset
    np.testing.assert_allclose(data["departure_bell"], 0.0, atol=1e-12)
    rate, force = data["R_bell"], data["f"]
    work = np.trapezoid(rate * force * ELL, data["time"])
    assert float(data["W_f"][-1]) == pytest.approx(float(work), rel=1e-3)


def test_without_a_length_a_prescribed_force_is_refused(tmp_path):
    law = "{reversible-bell: {k_off: 1 1/s, x_off: 0.4 nm}}"
    for load in ("loading: {f: 1 pN}", "loading: {f: {ramp: {rate: 0}}}", "loading: {t_n: 1 kPa}"):
        with pytest.raises(
            InputError, match=r"held.yaml:8: .* same equilibrium under any prescribed force.* Give `x_on`"
        ):
            held(tmp_path, law, load).run()


def test_a_force_that_a_case_holds_at_zero_needs_no_length(tmp_path):
    """It does no work, so that the equilibrium is that of the potential; another force is refused all the same."""
    law = "{reversible-bell: {k_off: 1 1/s, x_off: 0.4 nm}}"
    case = held(tmp_path, law, "loading: {f: 0 pN}")
    even = replace(case.case.run, picture=None)
    length_given = held(tmp_path, REVERSIBLE, "loading: {f: 0 pN}").run(run=even).dataset["phi"]
    np.testing.assert_allclose(case.run(run=even).dataset["phi"], length_given, rtol=1e-9)
    for change in (lambda: case.run({"loading.f": "5 pN"}), lambda: case.sweep({"loading.f": ["0 pN", "5 pN"]})):
        with pytest.raises(InputError, match="same equilibrium under any prescribed force"):
            change()


def test_a_length_beside_springs_is_refused(tmp_path):
    with pytest.raises(InputError, match="the potential says what the force does to the equilibrium; leave it out"):
        held(tmp_path, REVERSIBLE, "loading: {g_n: 1 nm}", springs=", {bond-springs: {k_b: 1e-3 N/m}}").run()


def test_a_reversible_bell_reaction_under_a_prescribed_force_is_refused(tmp_path):
    reversible = "- {equation: a <=> b, type: Bell, rate-constant: {A: 2 1/s, b: 0, Ea: 0}, x-beta: 0.4 nm}\n"
    run, sweep = pairs(tmp_path, reversible=reversible).run, pairs(tmp_path, reversible=reversible, force="0 pN").sweep
    told = r"bonds\.yaml:\d+: .* same equilibrium under any prescribed force.* two reactions with `=>`"
    # A sweep names the mechanism as the case does, a run by its path.
    for refused, start in ((run, ".*/"), (lambda: sweep({"loading.f": ["0 pN", "5 pN"]}), "")):
        with pytest.raises(InputError, match=f"^{start}{told}"):
            refused()


DOWN, PRESS = "down: {w_n: -100 nm/s, for: 0.3 s}", "press: {w_n: -100 nm/s, until: {p: 1 kPa}}"


@pytest.mark.parametrize(
    ("stages", "told"),
    [
        (
            ["approach: {w_n: -100 nm/s, until: {p: 0 Pa}}"],
            "the stage approach waits until p rises to 0, which it is as",
        ),
        (["approach: {w_n: -100 nm/s, until: {p: 1 Pa}}"], ""),
        ([PRESS, "hold: {until: {p: 1 kPa}}"], "the stage hold waits until p rises to 1000, which it is as the stage"),
        ([PRESS, "hold: {until: {p: 2 kPa}}"], ""),
        ([PRESS, "up: {w_n: 1 nm/s, until: {w_n: 0 nm}}"], ""),
        ([DOWN, "up: {w_n: 20 nm/s, until: {w_n: 20 nm}}"], "the stage up waits until w_n rises to 2e-08, which it is"),
        ([DOWN, "on: {w_n: -9 nm/s, until: {w_n: {falls-to: 30 nm}}}"], "the stage on waits until w_n falls to 3e-08"),
        ([DOWN, "up: {w_n: 20 nm/s, until: {w_n: 21 nm}}"], ""),
    ],
)
def test_a_stage_that_waits_for_what_is_so_as_it_begins_is_told(stages, told):
    """Bonds far from touch pull with 1e-245 Pa, whose sign is roundoff."""
    programme = ", ".join(f"{{{stage}}}" for stage in stages)
    warnings = surfacechem.load("press-hold-pull", [f"programme=[{programme}]"]).system.warnings
    found = [text for text in warnings if "which it is" in text]
    assert len(found) == bool(told)
    assert told in "".join(found)
