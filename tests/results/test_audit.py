"""What the audit says of laws that destroy entropy: judged by what each turns over, in runs and in sweeps alike."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from case_runs import solved

import surfacechem
from surfacechem.format import load_text
from surfacechem.results import audit
from surfacechem.runs.simulation import Simulation

BURST = """
T_0: 300 K
bodies:
  lower: {{temperature: T, C: {C} J/m^2/K}}
  upper: {{temperature: T, C: 1 kJ/m^2/K}}
interface:
  temperature: T
  sites: 1e18 1/m^2
  potential:
    - bond-energy: {{K_0: {K_0} J/m^2, phi_eq: 0.5}}
  bonding:
    - exponential-affinity: {{C_r: {C_r}}}
    - mass-action: {{k_on: 0 1/s, k_off: 1 1/s}}
initial: {{T: 300 K, phi: 1}}
run: {{until: 10 s}}
"""
"""Bonds break against their potential, held up by a law that first equilibrates them in an instant."""


def burst(K_0=0.8, C_r=1e38, C=1e3) -> Simulation:
    return Simulation(load_text(BURST.format(K_0=K_0, C_r=C_r, C=C)))


def test_the_rounding_of_what_is_infinite_is_infinite():
    run = solved("closing-film").trajectory
    infinite = audit._rounding_of(
        run, run.result.steps, lambda rows: np.full((len(rows), 1), np.inf), [[0]], np.arange(2)
    )
    assert np.all(next(infinite)[0, :2] == np.inf)


def test_a_large_body_hides_no_law():
    """The rounding of its heat content, added up over the steps, is more than what is destroyed."""
    solution = burst(C_r=1e38, C=1e11).run()
    assert -solution.dataset.entropy_mass_action[-1] < solution.audit.entropy_rounding
    assert solution.audit.violations == ("mass_action",)


def test_a_law_that_another_holds_in_equilibrium_destroys_nothing():
    """At C_r = 1e142 the potential differs from its equilibrium by 1e-104 of a bond's energy, which no digit shows."""
    solution = burst(C_r=1e142).run()
    assert solution.audit.violations == ()
    assert any("the balance of sites is open" in warning for warning in solution.warnings)


def test_what_is_destroyed_is_the_part_of_what_the_law_turns_over():
    """Without the other law bonds fall from 1 to nothing: they lose energy down to the middle and gain it below."""
    solution = burst(C_r=0.0).run()
    assert solution.audit.destroyed["mass_action"] == pytest.approx(0.5, abs=0.01)
    assert solution.audit.destroyed_together == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("name", "scale"), [("energy", "energy_scale"), ("entropy", "entropy_scale")])
def test_a_balance_that_is_open_is_told(name, scale):
    audit = solved("exothermic").audit
    assert audit.findings == ()
    off = getattr(audit, name) + 1e-3 * getattr(audit, scale)
    assert replace(audit, **{name: off}).findings == (f"the balance of {name} is open by 1.0e-03",)


FILM = """
T_0: 300 K
bodies: {{lower: {{temperature: 300 K}}, upper: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  sites: 1e18 1/m^2
  potential: [{{bond-energy: {{K_0: 0.8 J/m^2, phi_eq: 1}}}}]
  bonding: [{{mass-action: {{k_on: 0 1/s, k_off: 0.1 1/s}}}}]
  friction: [{{viscous: {{eta: 1 Pa s}}}}]
loading: {{g_n: {{ramp: {{start: 1 um, rate: -1 um/s}}}}, v: 1 m/s}}
initial: {{phi: 1}}
run: {{until: 2 s, rtol: {rtol}}}
"""
"""A film that thins to nothing while bonds break against their potential."""


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-11])
def test_the_end_of_one_law_hides_no_other(rtol):
    solution = surfacechem.run(FILM.format(rtol=rtol))
    assert solution.status == "stopped", solution.reason
    assert "viscous" in solution.reason
    assert solution.audit.violations == ("mass_action",)


@pytest.mark.parametrize(
    ("status", "last", "value", "past"),
    [
        ("stopped", 1.0 + 1e-10, -5.0, True),  # within the tolerance of time: on either side of the limit by rounding
        ("stopped", 2.0, -5.0, False),  # what a whole step destroys counts
        ("stopped", 2.0, math.inf, True),
        ("finished", 1.0 + 1e-10, -5.0, False),
    ],
)
def test_the_last_point_is_left_out_only_where_a_law_ends(status, last, value, past):
    steps = SimpleNamespace(t=np.array([0.0, 1.0, last]))
    trajectory = SimpleNamespace(status=status, run=SimpleNamespace(rtol=1e-9), result=SimpleNamespace(steps=steps))
    assert audit._is_past_its_end(trajectory, value) is past


OPEN_GAP = """
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface: {{potential: [penalty: {{E_n: 1 MPa/um}}]}}
mechanics: {{normal: {{k: 20 MPa/mm}}}}
loading: {{w_n: {{harmonic: {{mean: 5 um, amplitude: 3 um, frequency: 1 Hz}}}}}}
run: {{until: 1 s, rtol: {rtol}}}
"""
"""An open gap that follows its spring: no energy is stored, no work done."""


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-11])
def test_work_that_errors_alone_do_leaves_no_balance_open(rtol):
    solution = surfacechem.run(OPEN_GAP.format(rtol=rtol))
    assert solution.warnings == ()
    assert solution.audit.energy_error < rtol


@pytest.mark.parametrize(("mean", "part"), [("5 um", 1e-8), ("0 um", 1e-6)])
def test_work_that_is_booked_wrong_is_told(mean, part):
    """A part of what the spring would hold at the gap, open, or of what it does hold, where the gap closes."""
    trajectory = surfacechem.run(OPEN_GAP.format(rtol=1e-11), [f"loading.w_n.harmonic.mean={mean}"]).trajectory
    assert audit.audit(trajectory).findings == ()
    result = trajectory.result
    wrong = result.ledger_outputs + part * np.linspace(0, 0.1, len(result.times))[:, None]
    findings = audit.audit(replace(trajectory, result=result._replace(ledger_outputs=wrong))).findings
    assert any("the balance of energy is open" in finding for finding in findings)


def test_many_laws_that_destroy_entropy_share_a_warning():
    balances = replace(solved("exothermic").audit, least={f"R{i}": -1.0 for i in range(100)})
    lost = replace(balances, losses=lambda: (dict.fromkeys(balances.least, 1.0), 1.0))
    assert lost.findings == ("the laws R0, R1, R2, R3, R4, R5 and 94 more destroy entropy",)
