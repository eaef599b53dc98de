"""Exact solutions of bonds under force against their tables (30 digits), and in ranges where exponentials overflow."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from test_references import RELATIVE, assert_exact, bell, build, cluster, table

from surfacechem.errors import InputError
from surfacechem.references import get


@pytest.mark.parametrize("row", range(20))
def test_force_spectrum(row):
    data = table("c_bell_ramp")
    rate, *exact = (data.columns[key][row] for key in ("r", "F_mode", "F_mean", "F_median", "S_at_mode"))
    bond = build("bell-ramp", data.parameters, **bell(data.parameters), rate=rate)
    survival = bond.solution(bond.mode / rate)["phi"]
    assert_exact([bond.mode, bond.mean, bond.median, survival], exact)


def test_survival_along_a_ramp():
    data = table("c_bell_ramp_survival")
    bond = build("bell-ramp", data.parameters, **bell(data.parameters))
    exact = bond.solution(data.columns["F"] / bond.rate)
    assert_exact(exact["phi"], data.columns["S"])
    assert_exact(exact["ln_phi"], np.log(data.columns["S"]), absolute=1e-15)
    assert_exact(np.exp(bond.log_density(data.columns["F"])), data.columns["pdf"])


def test_survival_down_to_1e_300_and_beyond():
    bond = get("bell-ramp")(k_off=0.1, x_off=4e-10, T=300.0, rate=1e-10)
    last = bond.force_scale * math.log1p(300 * math.log(10) / bond.severity)
    exact = bond.solution(np.array([last, 3 * last]) / bond.rate)
    assert_exact(exact["phi"][0], 1e-300, relative=1e-12)
    assert_exact(exact["ln_phi"][0], -300 * math.log(10))
    assert exact["phi"][1] == 0.0
    assert exact["ln_phi"][1] < -1e6


@pytest.mark.parametrize("row", range(20))
def test_bell_overflow(row):
    data = table("x03_bell_overflow")
    p = bell(data.parameters)
    exponent = data.columns["Fx_over_kT"][row]
    scale = get("bell-constant-force")(**p, T=300.0, f=0.0).force_scale
    bond = build("bell-constant-force", data.parameters, **p, f=exponent * scale)
    assert_exact(bond.log_rate, data.columns["ln_rate"][row], relative=1e-15)
    # The rounding of the exponent alone is a relative error of the rate.
    rounding = 4e-16 * max(exponent, 1.0)
    half_life = data.columns["t_half"][row]
    assert_exact(math.log(2) * bond.lifetime, half_life, relative=RELATIVE + rounding, absolute=1e-304)
    exact = bond.solution([0.0, 1e-300, 1.0])
    assert exact["phi"][0] == 1.0
    for got, column in zip(exact["phi"][1:], ("S_at_1e-300_s", "S_at_1_s"), strict=True):
        assert_exact(got, data.columns[column][row], relative=1e-12, absolute=1e-300)
    assert not np.isnan(exact["ln_phi"]).any()


def test_cluster_without_rebinding():
    data = table("d_cluster_no_rebinding")
    given = cluster(0.5)
    bonds = get("shared-load-cluster")(**given)
    assert_exact(bonds.end_time, data.expect["tau_star"], relative=1e-15)
    tau, exact = data.columns["tau"], data.columns["N"] / data.parameters["N_t"]
    got = bonds.solution(tau)["phi"]
    # dphi/dtau = -phi exp(F/phi): close to rupture one unit in the last place of the time is seen.
    sensitivity = np.spacing(tau) * exact * np.exp(0.5 / exact)
    assert np.all(np.abs(got - exact) <= RELATIVE * exact + 2 * sensitivity)
    assert bonds.solution(bonds.end_time)["phi"] == 0.0
    with pytest.raises(InputError, match="exact for 0 <= t <="):
        bonds.solution(bonds.end_time * 1.001)


def test_lifetimes_of_clusters():
    data = table("d_cluster_lifetimes")
    for force, tau in zip(data.columns["f"], data.columns["tau_star"], strict=True):
        bonds = get("shared-load-cluster")(**cluster(force / data.parameters["N_t"]))
        assert_exact(bonds.end_time, tau)
        assert_exact(bonds.solution(np.array([1e-12, 0.5]) * tau)["phi"][0], 1.0, relative=1e-10)
    assert get("shared-load-cluster")(**cluster(1e4)).end_time == 0.0


def test_fold_of_the_cluster_with_rebinding():
    data = table("d_cluster_saddle_node")
    for gamma, load, state in zip(*(data.columns[c] for c in ("gamma", "f_c_over_Nt", "n_c")), strict=True):
        bonds = get("rebinding-cluster")(**cluster(load, gamma))
        assert_exact([bonds.critical_load, bonds.critical_state], [load, state])
        assert_exact(bonds.critical_traction, cluster(load)["t_n"])
    below = get("rebinding-cluster")(**cluster(0.278, 1.0))
    assert math.isinf(below.end_time)
    assert below.steady_state > below.critical_state
    with pytest.raises(InputError, match="no steady state above"):
        _ = get("rebinding-cluster")(**cluster(0.279, 1.0)).steady_state


def test_springs_in_equilibrium():
    data = table("x_latticegas_equilibrium")
    film = build("lattice-gas-springs", data.parameters, epsilon=data.parameters["eps"])
    # The exponent is 14 and more, and its rounding is that of the bonding state.
    assert_exact(film.equilibrium(data.columns["g"]), data.columns["phi_eq"])
    for epsilon in (-1e-17, -1e-19, 1e-19, 1e-17, 1e-15):
        assert 0 <= replace(film, epsilon=epsilon).equilibrium(1e-9) <= 1


def test_cure_that_nothing_starts_is_refused():
    with pytest.raises(InputError, match="nothing starts the reaction"):
        get("kamal-cure-constant-capacity")(A_1=0.0, A_2=1.0, T_i=300.0)


def test_ignition_without_cancellation():
    weld = get("friction-ignited-bonding")(A=1e14, E_a=1.2e5, T_i=300.0, C=500.0, D=2500.0)
    t = np.array([1e-12, 1e-3, 0.5])
    with mpmath.workdps(40):
        s = mpmath.mpf(1.2e5) / mpmath.mpf(8.31446261815324)
        exact = [mpmath.quad(lambda x: 1e14 * mpmath.exp(-s / (300 + 5 * x)), [0, mpmath.mpf(end)]) for end in t]
    assert_exact(-weld.solution(t)["ln_unbonded"], [float(value) for value in exact], relative=3e-14)
    assert_exact(weld.solution(1e4)["phi"], 1.0)


@pytest.mark.parametrize(
    ("k_r", "n_2", "phi_i"), [(0.0, 1e16, 0.0), (0.5, 2e16, 0.0), (3.0, 0.4e16, 0.3), (1e-12, 1e16, 0.9)]
)
def test_bimolecular_bonding(k_r, n_2, phi_i):
    """Against the quadrature of its rate, with 40 digits."""
    sites = get("bimolecular-bonding")(k_f=1e-16, k_r=k_r, n_1=1e16, n_2=n_2, n_c=1e16, phi_i=phi_i)
    t = np.array([1e-9, 0.1, 1.0, 10.0])
    phi = sites.solution(t)["phi"]
    with mpmath.workdps(40):
        speed = lambda x: (1 - x) * (mpmath.mpf(n_2) / mpmath.mpf(1e16) - x) - mpmath.mpf(k_r) * x  # noqa: E731
        for moment, end in zip(t, phi, strict=True):
            elapsed = mpmath.quad(lambda x: 1 / speed(x), [mpmath.mpf(phi_i), mpmath.mpf(end)])
            known = 4e-16 * max(end, phi_i) / abs(float(speed(mpmath.mpf(end)))) / moment  # rounding of phi as a time
            assert_exact(float(elapsed), moment, relative=1e-12 + 4 * known)
    assert_exact(get("bimolecular-bonding")(k_f=1e-16, n_1=1e16, n_2=1e16, n_c=1e16).solution(9.0)["phi"], 0.9)
