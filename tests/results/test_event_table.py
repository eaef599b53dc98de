"""The event table, what is said of it, and what a stage may wait for."""

from dataclasses import replace

import numpy as np
import pytest

import surfacechem
from surfacechem import errors
from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.results.event_table import event_columns, event_findings, event_summary
from surfacechem.runs.simulation import Simulation

BENDS = """
T_0: 300 K
bodies:
  lower: {temperature: T, C: 20 J/m^2/K, stiffness: 6e12 Pa/m}
  upper: {temperature: T, C: 30 J/m^2/K}
interface:
  temperature: T
  sites: 1e18 1/m^2
  potential: [adhesion-intensity: {C_N: 4e12 Pa/m, C_T: 2e12 Pa/m, w: 30 J/m^2, E_n: 1e13 Pa/m}]
  bonding: [adhesion-loss: {b: 12 J s/m^2}]
loading:
  w_n: {table: {times: [0, 2, 3, 6, 20], values: [-1 um, 12 um, 3 um, 30 um, 60 um]}}
  g_t: {ramp: {rate: 0.3 um/s}}
initial: {T: 300 K, phi: 0.97}
run: {until: 12 s, outputs: 11}
"""

HEATS = """
T_0: 300 K
bodies:
  lower: {temperature: T, C: 2 J/m^2/K}
  upper: {temperature: T, C: 2 J/m^2/K}
interface: {temperature: T, potential: [penalty: {E_n: 1 MPa/um}]}
loading: {Q_1: 4 W/m^2}
programme:
  - warm: {until: {T: 302 K}}
  - press: {w_n: -1 nm/s, for: 1 s}
mechanics: {normal: {k: 1 MPa/um}}
initial: {T: 300 K, g_n: 0, w_n: 0}
run: {until: 4 s}
"""


@pytest.fixture(scope="module")
def bends():
    return Simulation(load_text(BENDS)).run(error="balances")


@pytest.fixture(scope="module")
def cooling():
    return surfacechem.load("debonding-cooling").run().trajectory.jumps[0]


def test_no_number_is_missing_where_nothing_jumps(bends):
    data = bends.dataset
    assert data.attrs["status"] == "finished"
    assert data.event_name.values.tolist() == ["release", "mu", "mu", "mu"]
    assert all(np.isfinite(values).all() for values in data.variables.values() if values.dtype.kind == "f")
    bend = data.isel(event=slice(1, None))
    assert not bend.event_released.any()
    assert not bend.event_entropy.any()
    assert bend.event_verdict.values.tolist() == ["", "", ""]
    np.testing.assert_allclose(bend.event_since, bend.event_time - data.event_time[0], rtol=1e-15)
    for name in ("phi", "g_n", "T"):
        assert np.array_equal(bend[f"{name}_before"], bend[f"{name}_after"])


def test_a_run_without_jumps_has_the_same_columns_beside_one_with_some(bends):
    both = [bends.trajectory, replace(bends.trajectory, jumps=())]
    table = {column.name: column.values for column in event_columns(both, {"x": 2})}
    assert table["event_name"].tolist() == [["release", "mu", "mu", "mu"], ["mu", "mu", "mu", ""]]
    for name in ("event_released", "event_entropy", "phi_before", "T_after"):
        assert np.isnan(table[name][1]).tolist() == [False, False, False, True], name


def test_findings_that_repeat_are_one_line(cooling):
    (once,) = event_findings([cooling])
    assert once.endswith("reached at t = 3.87298335 s: destroys entropy (-0.817 J/(m^2 K))")
    worse = replace(cooling, t=5.0, entropy=2 * cooling.entropy)
    (many,) = event_findings([cooling, worse, replace(cooling, t=6.0)])
    at_worst = "destroys entropy (at worst -1.63 J/(m^2 K), at t = 5 s)"
    assert many.endswith(f"reached 3 times, first at t = 3.87298335 s: {at_worst}")
    assert len([*event_findings([cooling, replace(worse, verdict="impossible")])]) == 2


def test_rounding_is_no_heat(cooling):
    assert "released -195 J/m^2" in event_summary([cooling], 270.0)
    assert "released" not in event_summary([replace(cooling, released=1e-13)], 1.0)
    assert "released 1e-13 J/m^2" in event_summary([replace(cooling, released=1e-13)], 1e-12)


def test_a_stage_waits_for_a_temperature_by_its_own_name():
    data = Simulation(load_text(HEATS)).run(error="balances").dataset
    assert data.event_name.values.tolist() == ["end of warm", "touch", "end of press"]
    assert data.T_after.values[0] == pytest.approx(302.0, rel=1e-12)


@pytest.mark.parametrize(
    ("end", "message"),
    [
        ("{T_plate: 302 K}", "unknown key 'T_plate'"),
        ("{t_e: 302 Pa}", "unknown key 't_e'"),
        ("{J_c: 2}", "the stage warm waits for 'J_c'"),
    ],
)
def test_what_is_known_is_told_once_and_can_be_written(end, message, monkeypatch):
    monkeypatch.setattr(errors, "LINES", 10_000)
    with pytest.raises(InputError, match=message) as error:
        load_text(HEATS.replace("{T: 302 K}", end)).system()
    known = str(error.value).partition("Known: ")[2].rstrip(".").split(", ")
    assert len(known) == len(set(known)) > 5
    assert {"T", "g_n", "p"} <= set(known)
    assert not {"slack", "f_m", "gamma_m", "T_from", "M", "E_spring_n"} & set(known)


def test_events_that_a_stage_may_wait_for_are_told_once():
    for event in ("sliip", "slip back"):
        changes = ["loading.w_t=", f"programme=[{{pull: {{w_t: 1 mm/s, until: {event}}}}}]"]
        with pytest.raises(InputError, match=r"Known: slip backward, slip forward, stop\."):
            surfacechem.load("stick-slip", changes).case.system()


def test_rates_are_told_in_a_unit_without_brackets():
    with pytest.raises(InputError, match=r"programme\.press\.w_n: 3 nm is a length; w_n needs a velocity \[m/s\]\."):
        load_text(HEATS.replace("-1 nm/s", "3 nm"))
    with pytest.raises(InputError, match=r"3 m is a length; rate needs a quantity in W/\(m\^2 s\)\."):
        load_text(HEATS.replace("4 W/m^2", "{ramp: {rate: 3 m}}"))
