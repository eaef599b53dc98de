"""Every exact table of mechanics, run as a scene: 1e-8 where motion is smooth, 1e-6 with events; verdicts exactly."""

import math

import numpy as np
import pytest
import tables_mechanics as scenes
from asked import MOTION
from tables_mechanics import Solved, columns, parameters, rows, solve

from surfacechem.errors import InputError
from surfacechem.model.assemble import assemble
from surfacechem.runs.check import consistent_start, rates
from surfacechem.solve.jumps import ADMISSIBLE, IMPOSSIBLE, VIOLATES
from surfacechem.solve.run import Model

SMOOTH, EVENTS = 1e-8, 1e-6
TOLERANCES = {
    "S63_debonding": 1e-11,
    "g_coulomb_stop": 1e-12,
    "g_stickslip_V": 1e-9,
    "g_stickslip_rebonding_transient": 1e-10,
    "h_pulloff_dynamic": SMOOTH,
    "h_pulloff_k": EVENTS,
    "h_pulloff_heating": EVENTS,
    "h_isentropic": SMOOTH,
    "x09_penalty": 1e-12,
}
"""Relative errors of the tables."""
VERDICTS = {"ok": ADMISSIBLE, "entropy-violating": VIOLATES, "impossible": IMPOSSIBLE}


def each_row(name: str, label: str):
    return pytest.mark.parametrize("row", rows(name), ids=lambda row: f"{row[label]}")


def assert_close(found, exact, tolerance: float) -> None:
    """Relative to the largest exact value."""
    found, exact = np.asarray(found), np.asarray(exact)
    assert np.max(np.abs(found - exact)) <= tolerance * np.max(np.abs(exact))


def assert_each(found, exact, tolerance: float) -> None:
    assert np.asarray(found) == pytest.approx(np.asarray(exact), rel=tolerance, abs=0.0)


def assert_closed(solved: Solved, status: str = "finished") -> None:
    assert solved.status == status, solved.reason
    assert solved.findings == ()
    assert solved.energy_error < 1e-9


@pytest.mark.parametrize("name", MOTION)
def test_exact_values_are_met(name):
    solved, error = MOTION[name]()
    assert error < TOLERANCES[name.partition("-")[0]]
    assert {jump.verdict for jump in solved.jumps} <= ({ADMISSIBLE, VIOLATES} if "S63" in name else {ADMISSIBLE})
    if "x09" not in name:  # energies of so stiff a contact are rounding
        assert_closed(solved)


class TestDebonding:
    @each_row("x14_debonding_gate", "kappa")
    @pytest.mark.parametrize("violation", ["warn", "accept", "refuse"])
    def test_verdicts(self, row, violation):
        """What cannot be stops the run; what destroys entropy does so where it is refused."""
        T_0, C, k = 300.0, 2.0, 1e12
        q = {"T0": T_0, "T_i": T_0, "C_tot": C, "K0": row["kappa"] * T_0 * C, "phi_i": 1.0, "k_eff": k}
        solved = scenes.debonded(q | {"t_n": row["t_over_t0"] * math.sqrt(T_0 * C * k), "E_n": math.inf}, violation)
        (jump,) = solved.jumps
        assert jump.verdict == VERDICTS[row["verdict"]]
        stops = jump.verdict == IMPOSSIBLE or (jump.verdict == VIOLATES and violation == "refuse")
        assert_closed(solved, "stopped" if stops else "finished")
        if stops:
            assert jump.verdict in solved.reason
        if jump.verdict != IMPOSSIBLE:
            assert_each(solved.state(jump, "T") / T_0, row["T_f_over_T0"], 1e-12)


class TestCohesion:
    def test_bonds_in_equilibrium_until_none_is_left(self):
        solved, exact = scenes.damage(), columns("h_damage_equilibrium")
        assert_close(solved["phi"], exact["phi"], SMOOTH)
        assert_close(solved["t_n"], exact["t_n"], SMOOTH)
        end = math.sqrt(2 * parameters("h_damage_equilibrium")["K"] / parameters("h_damage_equilibrium")["E"])
        (unbonded,) = solved.of("unbonded")
        assert unbonded.t * exact["g"][-1] == pytest.approx(end, rel=1e-8)
        assert_closed(solved)


class TestLongRange:
    def test_flats(self):
        exact = columns("i_lj_flat_flat")
        solved = scenes.long_range("flat", exact["g"])
        assert_each(solved["t_n"], exact["t_n"], 1e-12)
        assert_each(solved["U_c"], exact["W"], 1e-12)
        assert_close(solved["W_g_n"], exact["W"] - exact["W"][0], 1e-7)

    @pytest.mark.parametrize(("kind", "column"), [("sphere", "F_exact"), ("derjaguin", "F_derjaguin")])
    def test_sphere_and_plane(self, kind, column):
        exact = columns("i_lj_sphere_plane")
        assert_each(scenes.long_range(kind, exact["g"])["t_n"] * 1e-16, exact[column], 1e-12)

    @each_row("i_lj_snap", "k_over_kmax")
    def test_snap_in_and_pull_off(self, row):
        solved, w = scenes.snap(row)
        into, off = solved.of("snap")
        found = [solved.state(into, "g_n", "before"), w[0], solved.state(off, "g_n", "before"), w[1]]
        assert_each(found, [row[name] for name in ("g_snap_in", "w_snap_in", "g_pull_off", "w_pull_off")], EVENTS)
        assert_closed(solved)


class TestExtremes:
    def test_closing_film_over_nineteen_decades(self):
        exact, p = columns("x05_closing_film"), parameters("x05_closing_film")
        gaps = p["g_i"] * exact["one_minus_t_over_tc"]
        for k in range(len(gaps) - 1):
            changes = {"loading.g_n.start": gaps[k], "initial.T": exact["T"][k]}
            solved = solve(scenes.film(), (0.0, (gaps[k] - gaps[k + 1]) / p["a"]), changes)
            assert_each(solved["T"][-1], exact["T"][k + 1], 1e-11)
            assert_each(solved["D_viscous"][-1], exact["D_mech"][k + 1], 1e-11)
            assert_closed(solved)

    @each_row("x09_penalty_limit", "E_n")
    def test_penalty_over_thirty_eight_decades(self, row):
        """The deflection of the body is the far field's displacement less the gap: known to the rounding of those."""
        changes = {"interface.potential.normal-stiffness.E_n": row["E_n"]}
        solved = solve(scenes.penalty(), (0.0, 1.0), changes)
        assert_each([solved["g_n"][-1], solved["t_n"][-1]], [row["g"], row["t_n"]], 1e-12)
        lost = 1e-15 * (1 + parameters("x09_penalty_limit")["k_eff"] / row["E_n"])
        assert_each(solved["U_c"][-1], row["U_contact"], 1e-12)
        assert_each(solved["E_spring_n"][-1], row["U_el_bulk"], max(SMOOTH, 4 * lost))

    @each_row("x13_negative_capacity_growth", "Cc")
    def test_interface_without_capacity_left(self, row):
        """Disturbances grow the faster the less is missing; what has no capacity is refused, what has some decays."""
        if row["Cc"] == 0:
            pytest.skip("without a capacity term the scene is another one")
        model = Model(assemble(scenes.light_interface(row["Cc"])))
        start = consistent_start(model, model.values())
        assert_each(rates(start).real, [row["growth_rate"]], 1e-12)
        if row["C_eff"] > 0:
            assert_closed(solve(model, (0.0, 1e-3)))
        else:
            with pytest.raises(InputError, match="heat capacity at T_c was lost"):
                solve(model, (0.0, 1e-3))
