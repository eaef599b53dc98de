"""Every exact solution against every row of its table (30 digits, from an independent calculation)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tables import columns, expected, parameters

from surfacechem.errors import InputError
from surfacechem.quantities import BOLTZMANN
from surfacechem.references import Reference, get
from surfacechem.references.numerics import scaled_rise

FOLDER = Path(__file__).parent
RELATIVE = 1e-13


@dataclass
class Table:
    parameters: dict[str, float]
    columns: dict[str, np.ndarray]
    expect: dict[str, float]


def table(name: str) -> Table:
    return Table(parameters(name), columns(name), expected(name))


def assert_exact(actual, exact, *, relative=RELATIVE, absolute=0.0):
    np.testing.assert_allclose(actual, exact, rtol=relative, atol=absolute)


def spelled(parameters: Mapping[str, float]) -> dict[str, float]:
    """The tables write C1, Cc, T1, h1, D0, K0, T0; the classes C_1, C_c, ..."""
    return {f"{key[0]}_{key[1]}" if len(key) == 2 and key != "mu" else key: value for key, value in parameters.items()}


def build(name: str, parameters: Mapping[str, float], **more: float) -> Reference:
    """The reference with those of the table's parameters that it has."""
    kind = get(name)
    given = {**spelled(parameters), **more}
    return kind(**{key: value for key, value in given.items() if key in kind.__dataclass_fields__})


@dataclass
class Case:
    """A table, the reference it belongs to, and which quantity each column holds."""

    table: str
    reference: str
    columns: Mapping[str, str]
    more: Callable[[Mapping[str, float]], Mapping[str, float]] = lambda p: {}
    absolute: Mapping[str, float] | None = None
    rounding_of_time: bool = False

    def __str__(self) -> str:
        return f"{self.table}-{self.reference}"


PERFECT = {
    "phi": "phi",
    "T": "T",
    "q1": "q_1",
    "q2": "q_2",
    "U_c": "U_c",
    "S_total": "S_total",
    "sigma_chem": "sigma_chem",
}
PAPER = {"phi": "phi", "T": "T", "q1": "q_1", "q2": "q_2"}
EXCHANGE = {"T1": "T_1", "T2": "T_2", "Tc": "T_c"}
EXOTHERMIC = [f"S621_exothermic_kappa_{kappa}" for kappa in ("0p1", "0p5", "1", "2")]
ENDOTHERMIC = [f"S622_endothermic_kappa_{kappa}" for kappa in ("0p1", "0p5", "0p9", "0p99")]
NEARLY_ONE = [f"x01_endothermic_kappa_1m2e-{power}" for power in (10, 20, 40)]
FLUXES = {"q1": "q_1", "q2": "q_2"}
KINETICS = {"phi": "phi", "phi_dot": "phi_dot"}
IGNITED = {"T": "T", "phi": "phi", "ln_1_minus_phi": "ln_unbonded"}
CURED = {"alpha": "phi", "T": "T", "alpha_dot": "phi_dot"}


def friction(p: Mapping[str, float]) -> dict[str, float]:
    return {"C": p["C_tot"], "D_0": p["mu0"] * p["p"] * p["v"], "T_i": p["T0"]}


def cooling(p: Mapping[str, float]) -> dict[str, float]:
    return {"C": p["C_tot"], "Q": p["Q_cool"], "T_i": p["T0"]}


def bell(p: Mapping[str, float]) -> dict[str, float]:
    given = {"k_off": p["k0"], "x_off": p["x"]}
    return given | {name: p[key] for name, key in (("f", "F"), ("rate", "r")) if key in p}


def cluster(load: float, rebinding: float = 0.0) -> dict[str, float]:
    """A cluster with a force per site of ``load`` force scales, in units of the unstressed lifetime."""
    given = {"k_off": 1.0, "x_off": 4e-10, "T": 300.0, "n_c": 1e14, "t_n": load * 1e14 * BOLTZMANN * 300.0 / 4e-10}
    return given | ({"k_on": rebinding} if rebinding else {})


CASES = [
    Case("S61_sliding_dry", "sliding", {"T": "T"},
         lambda p: {"D": p["mu"] * p["p"] * p["v"], "T_i": p["T0"]}),
    Case("S61_sliding_viscous", "sliding", {"T": "T", "q1": "q_1", "q2": "q_2", "S_total": "S_total"},
         lambda p: {"D": p["eta"] * p["v"] ** 2 / p["g_n"], "T_i": p["T0"]}),
    *[Case(name, "bonding", PERFECT) for name in [*EXOTHERMIC, *ENDOTHERMIC]],
    *[Case(name, "exothermic-bonding", PAPER) for name in EXOTHERMIC],
    *[Case(name, "endothermic-bonding", PAPER) for name in ENDOTHERMIC],
    Case("S62x_entropic_endothermic", "bonding", PERFECT),
    Case("S62x_generalised", "bonding", PERFECT),
    *[Case(name, reference, {"T": "T"}) for name in NEARLY_ONE for reference in ("bonding", "endothermic-bonding")],
    Case("x12_wide_scales", "bonding", {"phi": "phi", "T": "T"}),
    Case("a_linear_equilibrium", "linear-affinity", {q: q for q in ("phi", "R_forward", "R_backward", "R_c")},
         lambda p: {"K_c": p["Kf"] + p["Kb"], "phi_eq": p["Kf"] / (p["Kf"] + p["Kb"])}),
    # The tables subtract from one with 50 digits: rates below 1e-40 are lost in them.
    *[Case(f"b_exponential_{way}", "exponential-affinity", KINETICS, lambda p: {"K_c": p["K"]}, {"phi_dot": 1e-40})
      for way in ("bonding", "debonding")],
    Case("e_three_temperatures", "three-temperatures", {**EXCHANGE, **FLUXES}, absolute={"q1": 1e-44, "q2": 1e-44}),
    Case("e_three_temperatures_source", "three-temperatures", EXCHANGE),
    Case("e_three_temperatures_dae", "three-temperatures-no-capacity", EXCHANGE),
    Case("e_exchange_quadratic", "pair-exchange", {"T1": "T_1", "T2": "T_2"}),
    Case("e_reservoir_quadratic", "reservoir-exchange", {"T_cooling": "T"}, lambda p: {"T_a": p["T_inf"]}),
    Case("e_reservoir_quadratic", "reservoir-exchange", {"T_heating_from_20K": "T"},
         lambda p: {"T_a": p["T_inf"], "T_i": 20.0}),
    Case("f_dry_friction_mu_T0_over_T", "weakening-friction", {"T_quadratic": "T"}, friction),
    Case("f_dry_friction_mu_T0_over_T", "thinning-film", {"T_visc_exp_quadratic": "T"}, friction),
    Case("f_dry_friction_with_loss", "weakening-friction-with-loss", {"T": "T"}, friction),
    Case("x08_cooling_to_zero", "cooling-to-zero", {"T_quadratic": "T"}, cooling, rounding_of_time=True),
    Case("k_adiabatic_arrhenius", "adiabatic-arrhenius", {"T": "T", "phi": "phi"},
         lambda p: {"A": p["k0"], "E_a": p["Ea"], "delta_T": p["dT_ad"]}, rounding_of_time=True),
    Case("c_bell_constant_force", "bell-constant-force", {"S": "phi"}, bell),
    Case("x18_friction_ignited_bonding", "friction-ignited-bonding", IGNITED,
         lambda p: {"A": p["k0"], "E_a": p["Ea"], "C": p["C_tot"]}),
    Case("k_kamal_const_capacity", "kamal-cure-constant-capacity", CURED,
         lambda p: {"A_1": p["A1"], "A_2": p["A2"], "E_1": p["E1"], "E_2": p["E2"], "T_0": p["T_i"],
                    "delta_T": p["dT_ad"]}, rounding_of_time=True),
]  # fmt: skip


def effect_of_rounding(reference: Reference, t: np.ndarray, quantity: str) -> np.ndarray:
    """How far the exact value moves when the time moves by two units in its last place."""
    later = np.minimum(t + 2.0 * np.spacing(t), reference.end_time)
    earlier = np.maximum(t - 2.0 * np.spacing(t), 0.0)
    return np.abs(reference.solution(later)[quantity] - reference.solution(earlier)[quantity])


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_row(case):
    data = table(case.table)
    reference = build(case.reference, data.parameters, **case.more(data.parameters))
    t = data.columns["t"]
    exact = reference.solution(t)
    for column, quantity in case.columns.items():
        absolute = (case.absolute or {}).get(column, 0.0)
        if case.rounding_of_time:
            absolute = absolute + effect_of_rounding(reference, t, quantity)
        difference = np.abs(exact[quantity] - data.columns[column])
        assert np.all(difference <= RELATIVE * np.abs(data.columns[column]) + absolute), (column, difference)


def test_every_table_is_used():
    """By a case above, or by its name in some test."""
    used = {case.table for case in CASES}
    tests = "".join(file.read_text() for file in Path(__file__).parents[1].rglob("t*.py"))
    kept = {file.stem for file in FOLDER.glob("*.json")}
    assert used <= kept
    assert {name for name in kept - used if f'"{name}"' not in tests} == set()


@pytest.mark.parametrize("row", range(20))
def test_stiff_exchange(row):
    data = table("x06_stiff_exchange")
    given = {key: float(data.columns[key][row]) for key in ("Cc", "h1", "h2")}
    exact = build("three-temperatures", {**data.parameters, **given}, D_0=data.parameters["D"]).solution(10.0)
    for column, quantity in EXCHANGE.items():
        assert_exact(exact[quantity], data.columns[column][row], relative=1e-15)


@pytest.mark.parametrize("row", range(36))
def test_exponential_overflow(row):
    data = table("x03_exponential_overflow")
    values = {key: float(column[row]) for key, column in data.columns.items()}
    steepness = values["a"] * data.parameters["n_c"] * BOLTZMANN * data.parameters["T"]
    given = {"K_c": steepness, "phi_i": values["phi_i"], "phi_eq": values["phi_eq"]}
    assert_exact(build("exponential-affinity", data.parameters, **given).solution(values["t"])["phi"], values["phi"])


def test_time_at_a_temperature():
    friction_data = table("f_dry_friction_with_loss")
    reference = build("weakening-friction-with-loss", friction_data.parameters, **friction(friction_data.parameters))
    T = friction_data.columns["T"]
    # Close to the steady state the rounding of T moves the time by its relative distance from there.
    rounding = np.spacing(T) / np.abs(reference.steady_temperature - T) * 2e3
    assert np.all(
        np.abs(reference.time(T) - friction_data.columns["t"]) <= RELATIVE * friction_data.columns["t"] + rounding
    )
    runaway = table("k_adiabatic_arrhenius")
    p = runaway.parameters
    reaction = build("adiabatic-arrhenius", {}, A=p["k0"], E_a=p["Ea"], T_i=p["T_i"], delta_T=p["dT_ad"])
    assert_exact(reaction.time(runaway.columns["phi"]), runaway.columns["t"])


def test_final_temperatures():
    data = table("e_exchange_quadratic")
    assert_exact(build("pair-exchange", data.parameters).equilibrium_temperature, data.expect["T_eq"])
    data = table("e_three_temperatures")
    assert_exact(build("three-temperatures", data.parameters).solution(1e9)["T_c"], data.expect["T_eq"])
    for name in [*EXOTHERMIC, *ENDOTHERMIC, *NEARLY_ONE, "S62x_generalised", "S62x_entropic_endothermic"]:
        data = table(name)
        assert_exact(build("bonding", data.parameters).solution(1e9)["T"], data.expect["T_inf"])


def test_end_of_cooling():
    data = table("x08_cooling_to_zero")
    more = cooling(data.parameters)
    reference = build("cooling-to-zero", data.parameters, **more)
    assert_exact(reference.end_time, data.expect["t_zero_quadratic"])
    assert reference.solution(reference.end_time)["T"] == 0.0
    with pytest.raises(InputError, match="exact for 0 <= t <="):
        reference.solution(np.nextafter(reference.end_time, math.inf))


def test_semenov_fold():
    data = table("e_semenov_fold")
    severity, T_0, beta = data.columns["D0_over_Dcrit"], data.parameters["T0"], data.parameters["beta"]
    assert_exact(T_0 + scaled_rise(severity) / beta, data.columns["Tc_lower"])
    for share, T_c in zip(severity, data.columns["Tc_lower"], strict=True):
        interface = build("semenov-fold", data.parameters, D_0=share * data.expect["D_crit"])
        # At the fold dT_c/dD_0 is infinite, and rounding D_0 by one part in 2^52 moves T_c by sqrt(2^-51)/beta.
        rounding = 4e-16 / math.sqrt(max(1.0 - share, 1e-16)) / beta
        assert_exact(interface.solution(0.0)["T_c"], T_c, absolute=rounding)
    assert_exact(interface.critical_dissipation, data.expect["D_crit"])
    assert_exact(interface.T_0 + 1.0 / interface.beta, data.expect["T_fold"])
    with pytest.raises(InputError, match="ignition"):
        build("semenov-fold", data.parameters, D_0=data.expect["D_crit"] * (1 + 1e-12))


def test_capacity_validity():
    """Perfect contact only: with a temperature of its own the interface is no matter of these references."""
    data = table("x02_capacity_validity")
    perfect = data.columns["regime"] == "perfect"
    for C_c, K_2, phi_i, verdict in zip(
        *(data.columns[c][perfect] for c in ("Cc", "K2", "phi_i", "verdict")), strict=True
    ):
        given = {"C_1": 1.0, "C_2": 1.0, "C_c": C_c, "T_0": 300.0, "T_i": 300.0, "tau": 1.0, "K_2": K_2, "phi_i": phi_i}
        if verdict == "accept":
            assert np.isfinite(get("bonding")(**given).solution([0.0, 1.0])["T"]).all()
        else:
            with pytest.raises(InputError, match="capacity must be positive"):
                get("bonding")(**given)
