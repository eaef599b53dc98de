"""The assembled equations satisfy both laws of thermodynamics, whatever the regime."""

import mpmath
import pytest
import scenes
import scenes_mechanics
import symengine
import thermodynamics as laws

from surfacechem.model.assemble import assemble

each_scene = pytest.mark.parametrize("scene", scenes.ALL, ids=lambda scene: scene.__name__)


@each_scene
def test_energy_changes_by_what_is_supplied(scene):
    system = assemble(scene())
    for seed in range(3):
        assert laws.first_law_holds(system, laws.consistent_point(system, seed))


@each_scene
def test_entropy_changes_by_what_is_supplied_and_produced(scene):
    system = assemble(scene())
    for seed in range(3):
        assert laws.second_law_holds(system, laws.consistent_point(system, seed))


@each_scene
def test_no_law_destroys_entropy(scene):
    system = assemble(scene())
    for seed in range(3):
        point = laws.consistent_point(system, seed)
        assert all(value >= 0 for law, value in laws.productions(system, point).items() if "prescribed" not in law)


moving = pytest.mark.parametrize(
    ("scene", "modes"),
    [
        pytest.param(m.scene, modes, id=f"{m.__name__}{list(modes.values())}")
        for m in scenes_mechanics.ALL
        for modes in m.modes
    ],
)


@moving
def test_moving_gaps_satisfy_both_laws(scene, modes):
    """In each mode; where a gap is in equilibrium its rate follows from that, so the point is one of equilibrium."""
    system = assemble(scene())
    for seed in range(2):
        point = laws.consistent_point(system, seed, modes)
        assert laws.first_law_holds(system, point)
        assert laws.second_law_holds(system, point)


@moving
def test_moving_gaps_never_destroy_entropy(scene, modes):
    """The far field pulls forward; sliding backward is left at once, before it can give back heat."""
    system = assemble(scene())
    point = laws.consistent_point(system, 0, modes)
    if modes.get("slip", 0.0) >= 0:
        assert all(value >= 0 for value in laws.productions(system, point).values())


def test_maxwell_relations():
    """The mixed derivatives of one potential agree: dt_n/dphi = dM/dg_n, dS/dg_n = -dt_n/dT, dS/dphi = -dM/dT."""
    system = assemble(scenes.coupled())
    g, phi, T = (symengine.Symbol(name) for name in ("g_n", "phi", "T_c"))
    t_n, M, S = (item(system, name) for name in ("t_n", "M", "S_c"))
    point = laws.consistent_point(system, 0) | {g: mpmath.mpf(1e-6), symengine.Symbol("g_t"): mpmath.mpf(1e-7)}
    for left, right in [(t_n.diff(phi), M.diff(g)), (S.diff(g), -t_n.diff(T)), (S.diff(phi), -M.diff(T))]:
        assert laws.number(left, point) != 0
        assert laws.closes([left], [right], point)


def item(system, name):
    return system.find(name).expression
