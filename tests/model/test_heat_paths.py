"""Heat paths: conductance laws against exact tables, closures, the ledger of fluxes, ranges and behaviour at touch."""

import math
from dataclasses import replace
from textwrap import dedent

import numpy as np
import pytest
import scenes
import tables
from scenes import SITES, bodies, path, varying
from solved import closed, solve

from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.laws.factors import Proportional
from surfacechem.laws.free_energy import (
    BondEnergy,
    Constant,
    ConstantInterfaceCapacity,
    InterfaceCapacity,
    NormalStiffness,
)
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.heat_transfer import (
    Conductance,
    CooperMikicYovanovich,
    GapConductance,
    GasGap,
    PressureConductance,
    PressureTable,
    Radiation,
)
from surfacechem.laws.kinetics import Relaxation
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.model.assemble import assemble, conductance_warnings
from surfacechem.quantities import STEFAN_BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.results.solution import Solution
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Interface, Scene

ENDS = ("lower", "upper")
GAP = {"h_0": 2e4, "C_trans": 2e6, "k_gas": 0.026, "g_0": 3.7e-7, "epsilon_1": 0.8, "epsilon_2": 0.6}


def direct(heat, loading, T_1=350.0, T_2=500.0, C=1e30, interface=None, **rest) -> Scene:
    """Two bodies without a medium, so large that they keep their temperatures unless told otherwise."""
    interface = interface or Interface(None)
    initial = {"T_1": T_1, "T_2": T_2}
    return Scene(bodies(energy=Constant, C_1=C, C_2=C), interface, heat, loading, T_0=300.0, initial=initial, **rest)


def solved(scene: Scene, *times: float):
    return solve(scene, times)


def history(values) -> Table:
    return Table(times=[float(i) for i in range(len(values))], values=list(values))


# -- exact tables -----------------------------------------------------------------------------------------------------


def test_conductance_out_of_contact_and_what_carries_it():
    p, columns = tables.read("j_conductance_out_of_contact")
    rows = len(columns["h"])
    assert p["c_rad"] == STEFAN_BOLTZMANN
    law = GapConductance(between=ENDS, **GAP)
    values = solved(direct([law], {"g_n": history(columns["g_n"])}), *range(rows))
    assert values["q_t"] == pytest.approx(columns["q_t"], rel=1e-12)
    taken_over = -np.expm1(-p["C_trans"] * columns["g_n"])
    assert values["q_12_gas"] == pytest.approx(-150 * columns["h_gas"] * taken_over, rel=1e-9)
    assert values["q_12_radiation"] == pytest.approx(-150 * columns["h_rad"] * taken_over, rel=1e-9)


# -- the ledger of fluxes ---------------------------------------------------------------------------------------------


def ledger() -> Scene:
    """Spots, gas and radiation in parallel, and friction and reaction heat, part of it lost to the surroundings."""
    scene = scenes.no_medium()
    heat = [
        PressureConductance(between=ENDS, h_c=1e4, H=1e9),
        GasGap(between=ENDS, k=0.026, M=3.7e-7),
        Radiation(between=ENDS, epsilon_1=0.8, epsilon_2=0.6),
        Radiation(between=("upper", "surroundings"), epsilon_1=0.9),
    ]
    loading = {**scene.loading, "g_n": Hold(level=2e-6)}
    interface = replace(scene.interface, loss=0.1)
    return replace(scene, heat=heat, loading=loading, interface=interface, surroundings=Hold(level=280.0))


def test_fluxes_by_channel_sum_lost_heat_is_booked_and_both_laws_hold():
    values = trajectory = solved(ledger(), 0.0, 0.5, 2.0)
    channels = ("spots", "gas", "radiation", "friction", "reaction", "external")
    for k in "12":
        parts = [values[f"q_{k}_{channel}"] for channel in channels]
        assert sum(parts) == pytest.approx(values[f"q_{k}"], rel=1e-13)
    across = [values[f"q_12_{channel}"] for channel in channels[:3]]
    assert sum(across) == pytest.approx(values["q_12"], rel=1e-13)
    assert values["q_2a"] == pytest.approx(0.9 * STEFAN_BOLTZMANN * (values["T_2"] ** 4 - 280.0**4), rel=1e-12)
    books = audit(trajectory)
    assert books.energy_error < 1e-10
    assert books.entropy_error < 1e-10
    assert books.violations == ()
    for channel, heat in (("friction", values["D_coulomb"]), ("reaction", values["D_linear_affinity"])):
        for k, share in (("1", 0.3), ("2", 0.6)):
            assert values[f"q_{k}_{channel}"] == pytest.approx(share * heat, rel=1e-13)


def through_medium(heat) -> Scene:
    interface = Interface("T_c", [], [Coulomb(mu=0.3)])
    loading = {"p": Hold(level=1e5), "v": Hold(level=0.02)}
    return direct(heat, loading, C=1e3, interface=interface)


def test_one_conductance_through_a_medium_is_twice_that_on_each_side():
    law = PressureConductance(between=ENDS, h_0=200.0, h_c=1e6, H=1e9, closure="medium")
    h = law.conductance(p=1e5)
    first = solved(through_medium([law]), 0.0, 1.0, 3.0)
    sides = [path("lower", "interface", 2 * h), path("interface", "upper", 2 * h)]
    second = solved(through_medium(sides), 0.0, 1.0, 3.0)
    assert first.result.outputs == pytest.approx(second.result.outputs, rel=1e-10)
    T_1, T_2 = first["T_1"], first["T_2"]
    assert first["q_t"] == pytest.approx(h * (T_2 - T_1), rel=1e-9)


def test_mean_influx_against_its_exact_solution():
    """Between bodies that keep their temperatures the interface relaxes to the harmonic mean."""
    mean = Conductance(between=("upper", "lower"), h=40.0, closure="mean")
    interface = Interface("T_c", [ConstantInterfaceCapacity(C_c=20.0)])
    initial = {"T_1": 300.0, "T_2": 450.0, "T_c": 300.0}
    scene = replace(direct([mean], {}, interface=interface), initial=initial)
    trajectory = solved(scene, 0.0, 0.1, 0.5, 2.0)
    values, t = trajectory, np.array([0.0, 0.1, 0.5, 2.0])
    harmonic = 2 * 300.0 * 450.0 / 750.0
    exact = harmonic + (300.0 - harmonic) * np.exp(-2 * 40.0 * t / 20.0)
    assert values["T_c"] == pytest.approx(exact, rel=1e-10)
    assert values["q_1"] == pytest.approx(40.0 * (exact - harmonic), rel=1e-8)
    assert values["q_t"] == pytest.approx(np.zeros(4), abs=1e-9)


def test_mean_influx_into_a_hotter_body_is_told():
    """From 400 K it heats a body of 500 K beside one of 300 K; both together produce entropy."""
    mean = Conductance(between=ENDS, h=10.0, closure="mean")
    interface = Interface("T_c", [ConstantInterfaceCapacity(C_c=100.0)])
    scene = replace(direct([mean], {}, interface=interface), initial={"T_1": 300.0, "T_2": 500.0, "T_c": 400.0})
    (warning,) = assemble(scene).warnings
    assert "upper also from an interface that is cooler than itself, between 375 K and 500 K" in warning
    values = solved(scene, 0.0, 0.1)
    assert values["q_2"][0] == pytest.approx(250.0)
    assert values["sigma_q_c12"][0] == pytest.approx(10.0 * 25.0 * (1 / 300 + 1 / 500 - 2 / 400), rel=1e-12)
    alike = replace(scene, initial={"T_1": 300.0, "T_2": 300.0, "T_c": 400.0})
    assert assemble(alike).warnings == ()


def test_mean_influx_is_of_two_bodies_with_temperatures_of_their_own():
    mean = Conductance(between=("lower", "surroundings"), h=1.0, closure="mean")
    with pytest.raises(InputError, match="`closure: mean` belongs to a path between the two bodies"):
        assemble(replace(through_medium([mean]), surroundings=Hold(level=300.0)))
    mean, interface = Conductance(between=ENDS, h=1.0, closure="mean"), Interface("T_c", [InterfaceCapacity(C_c=3.0)])
    shared = Scene(bodies("T", "T"), interface, [mean], {}, None, 300.0, {"T": 300.0, "T_c": 310.0})
    with pytest.raises(InputError, match="two bodies with temperatures of their own"):
        assemble(shared)


# -- ranges -----------------------------------------------------------------------------------------------------------

PRESSURES = {"pressures": [0.0, 1e6, 3e6], "conductances": [500.0, 1500.0, 3000.0]}


def test_a_table_that_refuses_to_be_extrapolated_ends_the_run():
    law = PressureTable(between=ENDS, extrapolation="refuse", **PRESSURES)
    trajectory = solved(direct([law], {"p": Ramp(rate=1e6)}), 0.0, 2.0, 10.0)
    assert trajectory.status == "stopped"
    assert trajectory.result.t == pytest.approx(3.0, rel=1e-6)
    assert "p left the range of the law pressure-table, 0 to 3e+06" in trajectory.reason


def test_the_ends_of_a_range_belong_to_it():
    """A pressure at the end of a table, and an emissivity of one that varies with the bonds, all of which are there."""
    table = PressureTable(between=ENDS, extrapolation="refuse", **PRESSURES)
    black = Radiation(between=ENDS, epsilon_1=0.8, epsilon_2=varying(1.0, Proportional(of="phi")))
    trajectory = solved(direct([table, black], {"p": Hold(level=3e6), "phi": Hold(level=1.0)}), 0.0, 2.0)
    assert trajectory.status == "finished"


def test_a_correlation_outside_its_range_says_so():
    law = CooperMikicYovanovich(between=ENDS, k=20.0, m=0.1, sigma=1e-6, H=2e9)
    inside = Solution(solved(direct([law], {"p": Hold(level=1e6)}), 0.0, 1.0))
    softer = inside.trajectory.model.solve(inside.trajectory.run, {"heat.cooper-mikic-yovanovich.H": 2e7})
    assert "ran from 1e+06 to 1e+06, its range is 20 to 460000" in Solution(softer).warnings[0]
    outside = Solution(solved(direct([law], {"p": Hold(level=1e9)}), 0.0, 1.0))
    assert inside.warnings == ()
    assert outside.warnings[0].startswith("cooper mikic yovanovich is an extrapolation: p ran from 1e+09 to 1e+09")


# -- touch ------------------------------------------------------------------------------------------------------------


class Jumping(Conductance):
    def conductance(self, g_n):
        from surfacechem.expressions import where

        return self.h * where(g_n > 0, 1.0, 3.0)


SPOTS = PressureConductance(between=ENDS, h_c=1e4, H=1e9)


@pytest.mark.parametrize(
    ("heat", "said"),
    [
        ([GapConductance(between=ENDS, **GAP)], ["not monotone: 20000 W/(m^2 K) at touch"]),
        ([GapConductance(between=ENDS, **GAP | {"h_0": 8e4})], []),
        ([GapConductance(between=ENDS, **GAP | {"h_0": 8e4}), SPOTS], []),
        ([GasGap(between=ENDS, k=0.026, M=3.7e-7), replace(SPOTS, h_0=500.0)], ["does not vanish without pressure"]),
        ([Jumping(between=ENDS, h=10.0)], ["jumps at touch, from 30 to 10 W/(m^2 K)"]),
    ],
)
def test_what_a_conductance_does_at_touch_is_told(heat, said):
    loading = {"g_n": Ramp(start=1e-6, rate=-1e-7)} | ({"p": Hold(level=0.0)} if len(heat) > 1 else {})
    found = list(conductance_warnings(assemble(direct(heat, loading))))
    assert len(found) == len(said)
    assert all(text in warning for text, warning in zip(said, found, strict=True))
    held = assemble(direct(heat, loading | {"g_n": Hold(level=1e-6)}))
    assert len(list(conductance_warnings(held))) == ("pressure" in "".join(said))


@pytest.mark.parametrize("gap", ["10 um", "{ramp: {start: 10 um, rate: -1 um/s}}"])
def test_a_film_that_conducts_without_end_at_touch_does_not_jump_there(gap):
    text = """
T_0: 300 K
bodies: {a: {temperature: T_1, capacity: constant, C: 1000}, b: {temperature: T_2, capacity: constant, C: 1000}}
interface: {medium: {conductivity: 0.1}}
heat: [{film: {between: [a, b]}}]
loading: {g_n: GAP}
initial: {T_1: 300, T_2: 400}
run: {until: 1 s}
"""
    system = load_text(text.replace("GAP", gap)).system()
    assert (system.warnings, list(conductance_warnings(system))) == ((), [])


def test_heat_into_a_body_that_is_kept_warm_is_all_that_the_interface_gives():
    """Prescribed temperatures: conduction from the other body, friction, and bonds at their internal energy."""
    text = """
    T_0: 300 K
    bodies: {lower: {temperature: T_1}, upper: {temperature: T_2}}
    interface:
      temperature: T_1
      sites: 1e18 1/m^2
      potential: [bond-energy: {K_0: 0.5 J/m^2, K_1: 0.2 J/m^2}]
      friction: [coulomb: {mu: 0.25}]
      bonding: [relaxation: {tau: 0.5 s}]
    heat: [conductance: {between: [upper, interface], h: 30 W/m^2/K}]
    loading: {T_1: 310 K, T_2: 350 K, p: 1 kPa, v: 2 mm/s}
    initial: {phi: 0}
    run: {times: [0.5, 1, 2], rtol: 1e-12}
    """
    data = Simulation(load_text(dedent(text))).run(error="balances").dataset
    np.testing.assert_allclose(data.q_1, 30 * 40 + 0.25 * 1e3 * 2e-3 + np.exp(-4 * data.time), rtol=1e-12)
    np.testing.assert_allclose(data.q_2, -30 * 40, rtol=1e-14)


# -- loads that are easy to miss, and limits in which two models must agree --------------------------------------------


def exchange(h, temperatures=("T_1", "T_c", "T_2"), C_c=4.0):
    first, middle, second = temperatures
    potentials = [BondEnergy(K_0=300.0)] + ([ConstantInterfaceCapacity(C_c=C_c)] if C_c else [])
    heat = [path("interface", body, h) for body, node in (("lower", first), ("upper", second)) if node != middle]
    initial = dict.fromkeys((first, second), 300.0) | ({middle: 300.0} if C_c or middle in (first, second) else {})
    interface = Interface(middle, potentials, (), [Relaxation(tau=0.5)], SITES)
    return Scene(bodies(first, second, Constant, 10.0, 30.0), interface, heat, {}, None, 300.0, initial | {"phi": 0.0})


def test_infinite_conductance_is_one_temperature():
    stiff, shared = closed(exchange(1e20), 2.0), closed(exchange(1.0, ("T", "T", "T")), 2.0)
    for name in ("T_1", "T_2", "T_c"):
        assert stiff[name][-1] == pytest.approx(shared["T"][-1], rel=1e-9)
    assert stiff["heat_into_2"][-1] == pytest.approx(shared["heat_into_2"][-1], rel=1e-8)
    assert stiff.energy_error < 1e-9


def test_an_interface_temperature_that_nothing_determines_is_refused():
    with pytest.raises(InputError, match="nothing determines the interface temperature T_c"):
        assemble(Scene(bodies(), Interface("T_c"), (), {}, None, 300.0, {"T_1": 300.0, "T_2": 300.0}))


@pytest.mark.parametrize(("h", "lost"), [(1e9, False), (1e20, True)])
def test_fluxes_that_are_rounding_are_called_out(h, lost):
    """The states and the heat received stay right at any conductance; h times a difference of rounding does not."""
    trajectory = closed(exchange(h), 2.0)
    warnings = [text for text in Solution(trajectory.trajectory).warnings if "lost to rounding" in text]
    assert bool(warnings) is lost


def test_a_pressure_from_a_potential_and_from_loading_is_two_roles():
    interface = Interface("T", [NormalStiffness(E_n=1e9)], [Coulomb(mu=0.3)])
    loading = {name: Hold(level=1.0) for name in ("g_n", "v", "p")}
    with pytest.raises(InputError, match="p has two roles"):
        assemble(Scene(bodies("T", "T"), interface, (), loading, None, 300.0, {"T": 300.0}))


def test_a_pressure_may_grow_from_nothing():
    """C (T^2 - T_0^2) / 2 T_0 = mu_k p t v / 2, for a law that ends below p = 0."""
    friction = Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3)
    loading = {"p": Ramp(start=0.0, rate=1e4), "v": Hold(level=1.0)}
    pair = bodies("T", "T", C_1=50.0, C_2=50.0)
    scene = Scene(pair, Interface("T", frictions=[friction]), loading=loading, T_0=300.0, initial={"T": 300.0})
    assert closed(scene, 1.0).end("T") == pytest.approx(math.sqrt(300.0**2 + 2 * 300.0 * 2000.0 / 100.0), rel=1e-10)
