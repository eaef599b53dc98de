"""The exact solutions of mechanics against every row of their tables, their own equations, and extreme parameters."""

import math
from itertools import islice
from operator import attrgetter

import numpy as np
import pytest
import tables
from tables import rows
from test_references import assert_exact, effect_of_rounding

from surfacechem.errors import InputError
from surfacechem.references import get
from surfacechem.references.base import ConstantCapacity, QuadraticEnergy

EPS = np.finfo(float).eps
FRICTION = {"m": 10.0, "k": 1e8, "t_s": 6e4, "t_k": 4e4}
REBONDING = {"m": 10.0, "k": 1e8, "p": 1e5, "mu_b": 0.7, "mu_ub": 0.4, "mu_k": 0.4, "tau": 2.0}
ZONE = {"t_max": 1e6, "g_0": 1e-8}
SLIP = {"v_max": "slip.v_max", "slip_time": "slip.duration", "slip_distance": "slip.distance"}
CALLED = {"t_first_onset": "onset_time", **SLIP}
"""What columns of tables are called here, where it differs."""


def read(name: str) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Columns of a table and its scalars."""
    return tables.columns(name), tables.expected(name)


class TestFriction:
    def test_coulomb_stop(self):
        columns, expect = read("g_coulomb_stop")
        slider = get("coulomb-stop")(m=5.0, mu=0.25, p=3e4, v_i=2.0, C=100.0, T_0=300.0, T_i=300.0)
        exact = slider.solution(columns["t"])
        # The velocity is a difference near the stop: rounding of t moves it by its slope.
        assert_exact(exact["v"], columns["v"], absolute=4 * EPS * 2.0)
        assert_exact(exact["u_t"], columns["x"])
        assert_exact(exact["T"], columns["T"])
        assert slider.stop_time == pytest.approx(expect["t_stop"], rel=1e-15)
        assert exact["u_t"][-1] == pytest.approx(expect["x_stop"], rel=1e-15)
        assert np.all(exact["v"][columns["t"] > expect["t_stop"]] == 0.0)
        assert_exact(exact["heat"][-1], 0.5 * 5.0 * 2.0**2)

    def test_stick_slip_motion(self):
        columns, expect = read("g_stickslip_motion")
        slider = get("stick-slip")(**FRICTION, V=1e-3)
        exact = slider.solution(columns["t"])
        assert np.all((exact["v"] == 0.0) == (columns["phase"] == "stick"))
        for column, quantity in {"x": "u_t", "xdot": "v", "spring_traction": "spring_traction", "heat": "heat"}.items():
            rounding = 4 * effect_of_rounding(slider, columns["t"], quantity)
            assert np.all(np.abs(exact[quantity] - columns[column]) <= 1e-12 * np.abs(columns[column]) + rounding)
        assert 4e4 * slider.slip.distance == pytest.approx(expect.pop("heat_per_cycle"), rel=1e-14)
        for name, value in expect.items():
            assert attrgetter(CALLED.get(name, name))(slider) == pytest.approx(value, rel=1e-14)

    @pytest.mark.parametrize("row", rows("g_stickslip_period_vs_V"), ids=lambda row: f"{row['V']:g}")
    def test_stick_slip_over_decades_of_speed(self, row):
        slider = get("stick-slip")(**FRICTION, V=float(row["V"]))
        for name in ("period", "slip_time", "v_max"):
            assert attrgetter(CALLED.get(name, name))(slider) == pytest.approx(row[name], rel=1e-14)
        assert 4e4 * slider.slip.distance == pytest.approx(row["heat_per_cycle"], rel=1e-14)

    def test_equal_friction_never_rests(self):
        slider = get("stick-slip")(m=10.0, k=1e8, V=1e-3, t_s=4e4, t_k=4e4)
        assert slider.stick_time == 0.0
        assert slider.slip.duration == pytest.approx(2 * math.pi * math.sqrt(1e-7), rel=1e-15)
        with pytest.raises(InputError, match="t_s must not be below"):
            get("stick-slip")(m=10.0, k=1e8, V=1e-3, t_s=3e4, t_k=4e4)

    @pytest.mark.parametrize("row", rows("g_stickslip_rebonding_steady"), ids=lambda row: f"{row['V_over_Vc']:g}")
    def test_rebonding_in_the_steady_cycle(self, row):
        slider = get("stick-slip-rebonding")(**REBONDING, V=float(row["V"]))
        steady, near = slider.steady, 1.0 - row["V_over_Vc"]
        # Rounding V by half a unit moves the stick time by that over the distance from the critical speed.
        rounding = 1e-13 + 4 * EPS / near
        assert steady.stick_time == pytest.approx(row["stick_time"], rel=rounding)
        assert steady.phi == pytest.approx(row["phi_star"], rel=rounding)
        assert steady.limit == pytest.approx(row["ts_star"], rel=1e-13)
        assert steady.slip.duration == pytest.approx(row["slip_time"], rel=1e-13)
        assert 4e4 * steady.slip.distance == pytest.approx(row["heat_per_cycle"], rel=1e-13)

    def test_rebonding_from_the_start(self):
        slider = get("stick-slip-rebonding")(**REBONDING, V=7.5e-5)
        assert slider.critical_speed == pytest.approx(3e-4, rel=1e-15)
        for cycle, row in zip(islice(slider.cycles(), 20), rows("g_stickslip_rebonding_transient"), strict=True):
            exact = [row[name] for name in ("stick_time", "ts_star", "slip_time", "slip_distance", "heat")]
            slip = cycle.slip
            found = [cycle.stick_time, cycle.limit, slip.duration, slip.distance, 4e4 * slip.distance]
            assert found == pytest.approx(exact, rel=1e-13)

    def test_what_slides_without_rest_is_refused(self):
        with pytest.raises(InputError, match="no stick-slip above V"):
            _ = get("stick-slip-rebonding")(**REBONDING, V=3.1e-4).steady
        with pytest.raises(InputError, match="exact for mu_k <= mu_ub"):
            get("stick-slip-rebonding")(**REBONDING | {"mu_k": 0.5}, V=1e-4)


class TestCohesion:
    @pytest.mark.parametrize("row", rows("h_pulloff_vs_stiffness"), ids=lambda row: f"{row['k_g0_over_tmax']:g}")
    def test_folds(self, row):
        bodies = get("cohesive-pull-off")(**ZONE, k=float(row["k_eff"]), w_dot=1.0)
        opening, closing = bodies.folds
        # Where the folds meet, rounding the stiffness moves them by its part of the distance.
        rounding = 1e-13 + 4 * EPS / (1.0 - bodies.severity)
        exact = [row[name] for name in ("g_off", "w_off", "t_off", "g_after")]
        assert [opening.g, opening.w, opening.t, opening.g_after] == pytest.approx(exact, rel=rounding)
        exact = [row[name] for name in ("g_on", "w_on", "g_after_on")]
        assert [closing.g, closing.w, closing.g_after] == pytest.approx(exact, rel=rounding)
        for fold, release in ((opening, row["release_off"]), (closing, row["release_on"])):
            size = 0.5 * fold.t**2 / float(row["k_eff"]) + math.e * 1e6 * 1e-8
            assert fold.release == pytest.approx(release, rel=1e-13, abs=16 * EPS * size)

    def test_stable_or_not(self):
        limit = read("h_pulloff_vs_stiffness")[1]["limit_k_g0_over_tmax"] * 1e14
        assert get("cohesive-pull-off")(**ZONE, k=limit * (1 + 1e-12), w_dot=1.0).severity >= 1.0
        bodies = get("cohesive-pull-off")(**ZONE, k=limit * (1 - 1e-10), w_dot=1.0)
        opening, closing = bodies.folds
        assert opening.g == pytest.approx(closing.g, rel=1e-4)
        assert opening.g < 2e-8 < closing.g
        with pytest.raises(InputError, match="there is no jump"):
            _ = get("cohesive-pull-off")(**ZONE, k=1e14, w_dot=1.0).folds

    def test_heating_by_cycles_of_opening_and_closing(self):
        bodies = get("cohesive-pull-off")(**ZONE, k=1e13, w_dot=1e-8)
        off, on = bodies.folds
        for n, row in enumerate(rows("h_pulloff_heating")):
            fold, cycles = (off, 0) if n == 0 else (on, n)
            heat = off.release if n == 0 else cycles * (off.release + on.release)
            assert fold.g_after == pytest.approx(row["g"], rel=1e-13)
            for model, column in ((QuadraticEnergy(), "T_quadratic"), (ConstantCapacity(), "T_constC")):
                assert 310.0 + model.rise(np.array(heat), 2e-4, 300.0, 310.0) == pytest.approx(row[column], rel=1e-13)
        heated = get("cohesive-pull-off-heating")(**ZONE, k=1e13, w_dot=1e-8, C=2e-4, T_0=300.0, T_i=310.0)
        exact = heated.solution([1.0, 20.0])
        assert_exact(exact["T"], [310.0, rows("h_pulloff_heating")[0]["T_quadratic"]])

    @pytest.mark.parametrize(
        "row", rows("h_overdamped_bottleneck"), ids=lambda row: f"{row['w_over_woff_minus_1']:.2g}"
    )
    def test_bottleneck(self, row):
        w_off = get("cohesive-pull-off")(**ZONE, k=1e13, w_dot=0.0).folds[0].w
        gap = get("overdamped-pull-off")(**ZONE, k=1e13, c=2e5, delta_w=w_off * float(row["w_over_woff_minus_1"]))
        assert gap.time(4e-8) == pytest.approx(row["t"], rel=1e-13)
        assert math.pi * gap.c * gap.width / (gap.k * gap.delta_w) == pytest.approx(row["t_asymptotic"], rel=1e-13)
        reached = gap.solution(gap.time(4e-8))
        # In the bottleneck a rounding of time is a small distance; beyond it, it is the speed.
        assert reached["g_n"] == pytest.approx(4e-8, rel=1e-13 + 8 * EPS * gap.time(4e-8) * reached["v_n"] / 4e-8)

    def test_isentropic_cooling(self):
        columns, expect = read("h_isentropic_cohesive_cooling")
        zone = get("isentropic-cohesive-opening")(t_max=5e7, g_0=1e-8, C=0.02, T_0=300.0, T_i=300.0, g_dot=1e-8)
        exact = zone.solution(columns["g"] / 1e-8)
        assert_exact(exact["T"], columns["T"])
        assert_exact(exact["t_n"], columns["t_n"], relative=1e-12)
        assert_exact(exact["work"], columns["work"], absolute=1e-14)
        assert zone.open_temperature == pytest.approx(expect["T_open"], rel=1e-14)
        cold = get("isentropic-cohesive-opening")(t_max=5e9, g_0=1e-8, C=0.02, T_0=300.0, T_i=300.0, g_dot=1e-8)
        assert cold.open_temperature < 0.0
        T = cold.solution(np.linspace(0.0, 50.0, 20))["T"]
        assert np.all(np.diff(T) < 0.0)
        assert T[-1] > 0.0


class TestContact:
    def test_closing_film(self):
        columns, _ = read("x05_closing_film")
        film = get("closing-film")(eta=0.01, v=0.5, g_i=1e-5, a=1e-6, C=800.0, T_0=300.0, T_i=300.0)
        exact = film.at_gap(1e-5 * columns["one_minus_t_over_tc"])
        assert_exact(exact["T"], columns["T"])
        assert_exact(exact["D"], columns["D_mech"])
        early = columns["one_minus_t_over_tc"] > 1e-3
        assert_exact(film.solution(columns["t"][early])["T"], columns["T"][early])
        assert film.solution(film.end_time)["T"] == math.inf
        with pytest.raises(InputError, match="exact for 0 <= t"):
            film.solution(10.1)

    @pytest.mark.parametrize("row", rows("x09_penalty_limit"), ids=lambda row: f"{row['E_n']:g}")
    def test_penalty_limit(self, row):
        exact = get("elastic-contact")(k=1e12, E_n=float(row["E_n"]), w_i=1e-8).solution(0.0)
        for column, quantity in {"g": "g_n", "t_n": "t_n", "U_el_bulk": "E_spring_n", "U_contact": "U_contact"}.items():
            assert exact[quantity] == pytest.approx(row[column], rel=1e-14)


VERDICTS = {"ok": "admissible", "entropy-violating": "entropy-violating", "impossible": "impossible"}


class TestSuddenDebonding:
    @pytest.mark.parametrize("row", rows("S63_debonding"))
    def test_final_temperature(self, row):
        given = {"C": row["C_tot"], "T_0": row["T0"], "T_i": row["T_i"], "K_0": row["K0"], "phi_i": row["phi_i"]}
        bonds = get("sudden-debonding")(**given, t_n=row["t_n"], k=row["k_eff"], compliance=1.0 / row["E_n"])
        assert bonds.final_temperature == pytest.approx(row["T_f"], rel=1e-14)
        assert bonds.entropy_change == pytest.approx(row["dS"], rel=1e-13)
        assert bonds.released_energy == pytest.approx(row["Ediss"], rel=1e-13)
        assert bonds.verdict == ("admissible" if row["dS"] >= 0 else "entropy-violating")
        assert bonds.solution(0.0)["T"] == bonds.final_temperature

    @pytest.mark.parametrize("row", rows("x14_debonding_gate"))
    def test_verdicts(self, row):
        bonds = get("sudden-debonding")(C=1.0, T_0=1.0, T_i=1.0, K_0=row["kappa"], t_n=row["t_over_t0"], k=1.0)
        assert bonds.verdict == VERDICTS[str(row["verdict"])]
        assert bonds.final_temperature == pytest.approx(row["T_f_over_T0"], rel=1e-14, nan_ok=True)
        if bonds.verdict == "impossible":
            with pytest.raises(InputError, match="no real value"):
                bonds.solution(0.0)
