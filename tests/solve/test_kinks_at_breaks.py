"""Kinks that fall on breakpoints of the loading are events like any other, once each."""

import math

import numpy as np
import pytest
from scenes import bodies

from surfacechem.laws.friction import Coulomb, MohrCoulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.laws.longrange import VanDerWaalsFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.results.event_table import event_columns
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run


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
