"""Exact tables of bonds under load: 1e-8 where the solution is smooth, 1e-6 near rupture, rupture times to 1e-8."""

import math

import numpy as np
import pytest
import symengine
import tables_bonds as tables
from tables import read
from test_tables import errors, solved

from surfacechem.laws.kinetics import Bell
from surfacechem.laws.loading import Hold
from surfacechem.model.assemble import assemble
from surfacechem.quantities import BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.solve.run import Model, Run

MAKERS = tables.makers()
ROWS = range(0, 20, 3)


@pytest.mark.parametrize("name", MAKERS)
def test_exact_values_are_met(name):
    table = MAKERS[name]()
    trajectory = solved(table)
    assert trajectory.status == "finished", trajectory.reason
    assert max(errors(table, trajectory).values()) < table.tolerance
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize("row", ROWS)
def test_lifetime_of_a_cluster(row):
    p, columns = read("d_cluster_lifetimes")
    life = columns["tau_star"][row]
    trajectory = Model(assemble(tables.cluster(columns["f"][row] / p["N_t"]))).solve(Run(times=[0.0, 2 * life]))
    assert trajectory.status == "stopped"
    assert trajectory.reason == f"the bonds ruptured at t = {life:.9g} s"
    assert trajectory.result.t == pytest.approx(life, rel=1e-10)


def test_last_moments_of_a_cluster():
    """A tight tolerance gives the state 1e-10 of a life before its end."""
    table = tables.no_rebinding("d_cluster_no_rebinding", left=1e-10)
    assert max(errors(table, solved(table, rtol=1e-13)).values()) < 1e-6


@pytest.mark.parametrize("row", ROWS)
def test_largest_load_that_rebinding_bonds_carry(row):
    """There the rate and its slope vanish together; a little below, the bonds stay, and a little above they do not."""
    _, columns = read("d_cluster_saddle_node")
    rebinding, load, phi = (columns[key][row] for key in ("gamma", "f_c_over_Nt", "n_c"))
    system = assemble(tables.cluster(load, rebinding))
    (row_of_phi,) = system.residual()
    state = system.states[0]
    point = {parameter.symbol: parameter.value for parameter in system.parameters} | {state.symbol: phi, state.dot: 0}
    gross = 2 * rebinding
    assert abs(float(row_of_phi.subs(point))) < 1e-12 * gross
    assert abs(float(symengine.diff(row_of_phi, state.symbol).subs(point))) * phi < 1e-12 * gross / phi
    slow = 1e6 / min(rebinding, 1.0)
    below, above = (
        Model(assemble(tables.cluster(load * factor, rebinding))).solve(Run(times=[0.0, slow]))
        for factor in (1 - 1e-6, 1 + 1e-8)
    )
    assert below.status == "finished", below.reason
    assert below.result.outputs[-1, 0] == pytest.approx(phi * (1 + math.sqrt(2e-6 / (1 + load))), rel=2e-6)
    assert above.reason.startswith("the bonds ruptured at t = ")


@pytest.mark.parametrize("row", ROWS)
def test_rates_beyond_what_a_double_holds(row):
    p, columns = read("x03_bell_overflow")
    force = columns["Fx_over_kT"][row] * BOLTZMANN * p["T"] / p["x"]
    law = Bell(k_off=p["k0"], x_off=p["x"])
    log_rate = math.log(p["k0"]) + law.log_off(f=force, T_c=p["T"])
    assert log_rate == pytest.approx(columns["ln_rate"][row], rel=1e-14)
    hazard = math.exp(min(log_rate + math.log(1e-300), 700.0))
    assert math.exp(-hazard) == pytest.approx(columns["S_at_1e-300_s"][row], rel=1e-6, abs=1e-300)
    scene = tables.isothermal(law, {"f": Hold(level=force)}, T=p["T"])
    trajectory = Model(assemble(scene)).solve(Run(times=[0.0, 1e-3, 1.0]))
    assert trajectory.status == "finished", trajectory.reason
    assert np.isfinite(trajectory.outputs).all()
    assert trajectory.result.outputs[-1, 0] == pytest.approx(columns["S_at_1_s"][row], rel=1e-8, abs=1e-17)
