"""Shipped cases, changed: exact solutions of other scenes are refused, what is compiled is used again."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from case_runs import load, solved

import surfacechem
from surfacechem.errors import InputError
from surfacechem.format import load_text, names
from surfacechem.quantities import BOLTZMANN
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import largest_errors
from surfacechem.results.error_estimates import against_exact, computed, floors
from surfacechem.results.matching import exact_values, match
from surfacechem.runs.simulation import Simulation

CELLS = ("sudden-contact", "epoxy-cure-thick")
"""Cases whose bodies are divided into cells."""


def test_the_error_of_cells_chosen_by_an_accuracy_is_that_against_many():
    """Eight times the cells leave a sixty-fourth of the error."""
    chosen = solved("epoxy-cure-thick")
    many = surfacechem.run(
        "epoxy-cure-thick", {"bodies.laminate.conduction.cells": 128, "bodies.tool.conduction.cells": 32}
    )
    ours, theirs = ({name: computed(run.trajectory)[name] for name in ("phi", "T", "T_2")} for run in (chosen, many))
    for name, error in largest_errors(ours, theirs, floors(chosen.trajectory)).items():
        assert error < 1e-4
        # An estimate from two grids leaves out the next order, a few hundredths of itself here.
        assert chosen.accuracy.variables[name] == pytest.approx(error, rel=0.1)


def test_a_stage_that_does_not_end_is_reported():
    assert solved("press-hold-pull").warnings == ()
    early = surfacechem.run("press-hold-pull", ["run.until=22 s"])
    assert early.warnings == ("the stage pull did not end: it goes on until theta_bond_s falls to 1e-06",)
    held = surfacechem.run("press-hold-pull", ["run.until=10 s"])
    assert held.warnings == ("the stage hold did not end: it goes on until 20 s have passed",)
    changes = ["programme=[{pull: {w_n: 1 nm/s, until: release}}]", "run.until=1 s"]
    assert surfacechem.run("press-hold-pull", changes).warnings == (
        "the stage pull did not end: it goes on until the event 'release'",
    )
    # The sum 0.1 + 0.2 is above 0.3 by its rounding.
    changes = ["programme=[{approach: {w_n: -1 nm/s, for: 0.1 s}}, {hold: {for: 0.2 s}}]", "run.until=0.3 s"]
    assert surfacechem.run("press-hold-pull", changes).warnings == ()


def test_a_run_with_changed_parameters_compiles_nothing(monkeypatch):
    simulation = load("exothermic")
    assert "T" in simulation.run().dataset
    monkeypatch.setattr("surfacechem.compile.program.symengine.Lambdify", None)
    hotter = simulation.run({"interface.potential.bond-energy.K_0": "600 J/m^2", "initial.phi": 0.1})
    assert hotter.status == "finished"
    assert hotter.dataset["T"][-1] > 400


HELD_FILM = """
T_0: 300 K
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface:
  temperature: T_c
  friction: [viscous: {eta: {value: 0.01 Pa s, times: [exponential: {beta: -0.01 1/K}]}}]
heat: [conductance: {between: [interface, lower], h: 7e4}, conductance: {between: [interface, upper], h: 3e4}]
loading: {v: 10 m/s, g_n: 1 um, p: {ramp: {rate: 1 MPa/s}}}
initial: {T_c: 300 K}
run: {until: 1 ms, outputs: 21}
reference: semenov-fold
"""


def test_an_exact_solution_is_held_against_balances_without_rates():
    accuracy = Simulation(load_text(HELD_FILM)).run().accuracy
    assert accuracy.source == "exact solution semenov-fold"
    assert accuracy.error < 1e-12
    rubbing = HELD_FILM.replace("friction: [", "friction: [coulomb: {mu: 0.1}, ")
    assert "it misses the equation of T_c by" in Simulation(load_text(rubbing)).run().accuracy.source


STRENGTH = "interface.limits.tensile-strength.t_max.times"


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("exothermic", "initial.T=350 K", "it starts from T = 300, the scene from 350"),
        ("exothermic", "bodies.upper.capacity=constant", "it misses the equation of T by"),
        ("exothermic", "reference=sliding", "it says nothing of phi"),
        ("stick-slip", "mechanics.tangential.c_g=1 kPa s/m", "it misses the equation of"),
        ("stick-slip", "initial.v=1 mm/s", "it starts from v = 0"),
        ("stick-slip", "loading.w_t={harmonic: {amplitude: 1 mm, frequency: 1 Hz}}", "it needs V"),
        ("cohesive-pull-off", "mechanics={normal: {m: 1 kg/m^2, c_g: 1 MPa s/m}}", "it says nothing of v_n"),
        ("coulomb-stop", "loading.p={ramp: {start: 30 kPa, rate: 10 MPa/s}}", "it misses the equation of v"),
        ("debonding", "loading.w_n={table: {times: [0 s, 9 s], values: [0, 9 um]}}", "it needs w_dot"),
        ("debonding", "interface.potential.bond-energy.K=0.8", "at t = 7.75 s it misses 30 J/m^2 of the 180 J/m^2"),
        ("debonding", f"{STRENGTH}.proportional.about=0.5", "beyond a jump of the scene: the interface debonds as"),
        ("debonding-cooling", "loading.w_n.ramp.start=0.1 um", "its w_n is"),
        (
            "adiabatic-arrhenius",
            "interface.bonding=[arrhenius: {A: 1e13, E_a: 60 kJ/mol, n: 2}]",
            "the equation of phi",
        ),
        (
            "compliant-debonding",
            "loading.g_n={table: {times: [0 s, 8 s], values: [0, 8.1 um]}}",
            "with g_1, speed, and the scene was changed",
        ),
        ("compliant-debonding", "reference.g_f=30 um", "it is given for g_f = 3e-05 m; the scene has 2.425e-05 m"),
        ("rate-and-state-slip-law", "reference.v_step=9 um/s", "its v is 9e-06, the scene's 1e-05"),
        ("stick-slip-rebonding", "initial.phi=1e-9", "it starts from phi = 0, the scene from 1e-09"),
    ],
)
def test_an_exact_solution_of_another_scene_is_not_used(name, change, reason):
    changes = [change, "initial.g_n=0", "run.until=1 ms"] if "normal" in change else [change]
    source = surfacechem.run(name, changes).accuracy.source
    assert "does not apply to this scene" in source
    assert reason in source


def test_a_run_far_from_an_exact_solution_with_a_jump_has_exact_values_all_the_same():
    """A time that errs by more than half of itself is sought from the start on."""
    simulation = load("debonding")
    run, case = simulation.run().trajectory.stored, simulation.case
    reference = match(case.reference.name, {}, SceneView(case.scene, run))
    assert exact_values(reference, case.scene, run, side=0.8, tested=False)["T"][-1] > 360


TOLD = ("compliant-debonding", "debonding-cooling", "endothermic-kappa-0p1", "stick-slip-rebonding")
"""Cases whose exact solutions were once compared with other scenes."""


MANY = (1.1, 1.001), (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
ANY = [pytest.param(name, *MANY, marks=pytest.mark.slow) for name in names() if name not in CELLS]


@pytest.mark.parametrize(
    ("name", "factors", "instead_of_zero"), [*((name, (1.001,), (1e-4, 1e-9)) for name in TOLD), *ANY]
)
def test_no_error_against_another_scene(name, factors, instead_of_zero):
    """Whatever is changed, the exact solution follows it, or says that it is of another scene."""
    simulation = load(name)
    model, reference = simulation.model, simulation.case.reference
    if reference is None:
        return
    run, values = replace(simulation.case.run, solver="radau", rtol=1e-11), model.values()
    for path in model.system.changeable:
        for value in [factor * values[path] for factor in factors] if values[path] else instead_of_zero:
            with suppress(InputError):
                trajectory = model.solve(run, {path: value})
                found = against_exact(trajectory, simulation.case.scene, reference.name, reference.options)
                assert found.error < 1e-6, (path, value, found.variables)


def test_a_single_bond_needs_a_bond_a_force_and_a_temperature():
    bond = (
        "bonding: [bell: {k_off: 0.1 s-1, x_off: 0.4 nm}]}\nloading: {f: {ramp: {rate: 100 pN/s}}}\ninitial: {phi: 1}\n"
    )
    short = surfacechem.load("interface: {temperature: 300 K, " + bond + "run: {until: 0.8 s}\n")
    solution, growth = short.run(), 0.4e-9 * 1e-10 / (BOLTZMANN * 300)  # of the rate of rupture [1/s]
    survival = np.exp(-0.1 / growth * np.expm1(growth * solution["time"].values))
    np.testing.assert_allclose(solution["phi"], survival, rtol=0, atol=1e-10)
    warmer = short.run({"interface.temperature.level": "310 K"})
    assert float(warmer["T"][0]) == 310.0
    with pytest.raises(InputError, match=r"the case needs `bodies`: .*; or `interface: \{temperature: 300 K\}`"):
        surfacechem.load("interface: {" + bond + "run: {until: 0.8 s}\n")
