"""Areas: a run on a stretched surface is one on a surface of that size, and stretching does the work that it takes."""

import dataclasses
import random

import numpy as np
import pytest
from law_values import USUAL
from sampling import every
from solved import solve

from surfacechem.contracts.terms import BodyEnergy, Friction, HeatTransfer, Potential, RateLaw, Varying, reads
from surfacechem.errors import InputError
from surfacechem.laws import laws
from surfacechem.laws.cohesive import CompliantDebonding, ExponentialCohesiveZone, TensileStrength
from surfacechem.laws.factors import Linear
from surfacechem.laws.free_energy import (
    BondEnergy,
    BondStiffness,
    Constant,
    ConstantInterfaceCapacity,
    LatticeGas,
    LinearEnthalpy,
    PartnerMixing,
)
from surfacechem.laws.heat_transfer import Conductance
from surfacechem.laws.kinetics import Bimolecular
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.laws.longrange import LennardJonesFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.quantities import BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Medium, Mounting, Scene, Sites

J = 2.0
N_1, N_2 = 4e16, 6e16
ENDS = ("lower", "upper")
USUAL = USUAL | {"m^2/s": 1e-17, "1/(J s)": 2e19, "1/(J s m^2)": 2e36, "J s/m^2": 0.3, "C/m^2": 1e-3, "F/m": 1e-11}
EXTENSIVE = {"J/m^2": -1, "J/(m^2 K)": -1, "Pa/m": -1, "1/m^2": -1, "C/m^2": -1, "J s/m^2": -1, "m^2": 1}
"""Power with which what is stated per reference area changes if the stretched surface is taken for the reference."""
OPTIONS = {"between": ENDS, "closure": "direct", "of": "T_c", "extrapolation": "hold", "conductances": (900.0, 400.0)}
OPTIONS |= {"pressures": (0.0, 2e5), "gaps": (0.0, 5e-9)}


def sample(law, on: float, **given: float):
    """A law with parameters of usual size, stated for a reference surface that is ``on`` times as large."""
    draw = random.Random(law.name())
    per_reference = issubclass(law, Potential) and law.per == "reference"
    values = {}
    for name, spec in law.specs():
        low, high = max(spec.above, spec.at_least, 0.0), spec.at_most
        usual = given.get(name, USUAL.get(spec.unit, 1.0) * draw.uniform(0.4, 0.8))
        stated = per_reference or issubclass(law, BodyEnergy) or spec.stretch == -1 or "per reference" in spec.text
        stated = stated or spec.unit == "J s/m^2"
        values[name] = min(max(usual, low + 0.1 * (usual < low)), high) * on ** (EXTENSIVE.get(spec.unit, 0) * stated)
    return law(**values, **{name: OPTIONS[name] for name, _ in law.options() if name in OPTIONS})


def scene(on: float, potentials=(), loading=(), C=50.0, heat=(), **more) -> Scene:
    """Two bodies about an interface that has a temperature, of a reference surface that is ``on`` times as large."""
    capacity = ConstantInterfaceCapacity(C_c=20.0 / on)
    pair = Body("lower", "T_1", Constant(C=C / on)), Body("upper", "T_2", Constant(C=C / on))
    frictions, reactions, limits = (more.pop(name, ()) for name in ("frictions", "reactions", "limits"))
    sites = Sites(N_1 / on, N_2 / on)
    medium = Medium(None, {"k_m": 0.1, "eta_m": 0.02, "rho_m": 900.0, "cp_m": 2000.0}, 1e-6)
    interface = Interface("T_c", [capacity, *potentials], frictions, reactions, sites, limits=limits, medium=medium)
    sides = [Conductance(between=(end, "interface"), h=30.0) for end in ENDS]
    given = dict(loading) | ({"J_c": Hold(level=J)} if on == 1.0 else {})
    initial = {"T_1": 300.0, "T_2": 330.0, "T_c": 310.0} | more.pop("initial", {})
    return Scene(pair, interface, [*sides, *heat], given, None, 300.0, initial, **more)


def same(make, names, times=(0.0, 0.1, 0.4, 1.0), extensive=("U_c", "S_c", "U_1", "S_total")):
    """The run on the stretched surface, which is that on a reference surface of that size."""
    stretched, plain = (solve(make(on), times) for on in (1.0, J))
    for name in ("T_1", "T_2", "T_c", "q_1", *names):
        size = float(np.max(np.abs(plain[name])))
        assert stretched[name] == pytest.approx(plain[name], rel=1e-9, abs=1e-11 * size), name
    for name in extensive:
        size = float(np.max(np.abs(plain[name])))
        assert stretched[name] == pytest.approx(J * plain[name], rel=1e-9, abs=1e-9 * J * size), name
    return stretched


# -- every law --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", every(3, laws(Potential)))
def test_every_potential(name):
    law = laws(Potential)[name]
    moves = {"g_n": Ramp(start=4e-10, rate=1e-9), "g_t": Ramp(start=1e-10, rate=1e-9), "phi": Ramp(start=0.2, rate=0.3)}
    read = reads(law.energy)
    loading = {variable: load for variable, load in moves.items() if variable in read}
    names = [t for g, t in (("g_n", "t_n"), ("g_t", "t_e")) if g in loading]
    extensive = ("U_c", "S_c", "M") if "phi" in loading and name != "bonded-contact" else ("U_c", "S_c")
    same(lambda on: scene(on, [sample(law, on)], loading), names, extensive=extensive)


ALONE = {"compliant-debonding"}
"""Laws that need a potential and a mounting of their own; see below."""


@pytest.mark.parametrize("name", every(4, [name for name in laws(RateLaw) if name not in ALONE]))
def test_every_rate_law(name):
    law = laws(RateLaw)[name]
    read = reads(law.rate)
    given = {"g_n": Hold(level=1e-9), "f": Hold(level=3e-12), "p": Hold(level=1e5)}
    loading = {variable: load for variable, load in given.items() if variable in read}

    def make(on):
        quadratic = sample(laws(Potential)["bond-energy"], on)
        mixture = [quadratic] if name == "relaxation" else [LatticeGas(epsilon=4e-21)]
        potentials = [LinearEnthalpy(H_r=-1e-3 / on)] if name == "adhesion-loss" else mixture
        return scene(on, potentials, loading, reactions=[sample(law, on)], initial={"phi": 0.3})

    stretched = same(make, ["phi"])
    assert abs(stretched["phi"][-1] - 0.3) > 1e-6


@pytest.mark.parametrize("name", every(3, laws(Friction)))
def test_every_friction_law(name):
    law = laws(Friction)[name]
    loading = {"p": Hold(level=1e5), "v": Hold(level=2e-3), "g_n": Hold(level=1e-6)}
    loading |= {"v_2": Hold(level=1e-3)} if law.transverse is not None else {}
    more = {"theta": 0.1} if law.internal else {}
    read = reads(law.traction) + reads(getattr(law, "limit", law.traction))
    loading |= {"phi": Hold(level=0.4)} if "phi" in read else {}
    same(
        lambda on: scene(on, (), loading, frictions=[sample(law, on)], initial=more),
        [f"t_{law.name().replace('-', '_')}"],
    )


@pytest.mark.parametrize("name", every(3, laws(HeatTransfer)))
def test_every_heat_path_between_the_bodies(name):
    law = laws(HeatTransfer)[name]
    read = {variable for formula in sample(law, 1.0).channels().values() for variable in reads(formula)}
    if read & {"gamma_m", "p_m"}:
        pytest.skip("needs a fluid of CoolProp, whose properties know no area")
    given = {"g_n": Hold(level=1e-9), "p": Hold(level=1e5), "phi": Hold(level=0.4)}
    loading = {variable: load for variable, load in given.items() if variable in read}
    same(lambda on: scene(on, (), loading, heat=[sample(law, on)]), ["q_2"])


@pytest.mark.parametrize("name", laws(BodyEnergy))
def test_every_energy_of_a_body(name):
    law = laws(BodyEnergy)[name]

    def make(on):
        plain = scene(on)
        pair = tuple(body._replace(energy=sample(law, on)) for body in plain.bodies)
        return dataclasses.replace(plain, bodies=pair)

    same(make, [])


def mounted(on, potentials, **more):
    pull = {"w_n": Ramp(rate=2e-8)}
    return scene(on, potentials, pull, normal=Mounting(k=1e14 / on), initial={"g_n": 0.0, "phi": 1.0}, **more)


def test_a_tensile_strength():
    def make(on):
        return mounted(on, [BondStiffness(E_b=1e14 / on, E_n=1e15 / on)], limits=[TensileStrength(t_max=3e5)])

    (t,), (again,) = ([jump.t for jump in solve(make(on), 0.9).of("debond")] for on in (1.0, J))
    assert t == pytest.approx(again, rel=1e-12)
    assert t == pytest.approx(3e5 * J * 2 / 1e14 / 2e-8, rel=1e-9)


def test_bonds_stay_on_their_envelope_as_the_surface_stretches():
    law = CompliantDebonding(t_max=3e5, E_b=1e14, g_f=4e-8)
    plain = mounted(1.0, [BondStiffness(E_b=1e14, E_n=1e15)], reactions=[law])
    scene = dataclasses.replace(plain, loading=plain.loading | {"J_c": Ramp(start=1.0, rate=0.1)})
    values = solve(scene, np.linspace(0.0, 1.4, 15))
    areas = 1.0 + 0.1 * np.linspace(0.0, 1.4, 15)
    left = [
        law.bind({"t_max": float(3e5 * area)}).envelope(g_n=float(g))
        for area, g in zip(areas, values["g_n"], strict=True)
    ]
    assert values["phi"] == pytest.approx(np.minimum(left, 1.0), rel=1e-7)
    assert values["phi"][-1] < 0.9


# -- work of stretching -----------------------------------------------------------------------------------------------

STRETCHED = {
    "lennard-jones-flat-flat": LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10),
    "exponential-cohesive-zone": ExponentialCohesiveZone(t_max=1e6, g_0=1e-9, E_n=1e15),
}


def stretching(potentials, rate=0.5, loading=(), **more) -> Scene:
    plain = scene(1.0, potentials, {"J_c": Ramp(start=1.0, rate=rate), **dict(loading)}, **more)
    return dataclasses.replace(plain, loading={**dict(loading), "J_c": Ramp(start=1.0, rate=rate)})


@pytest.mark.parametrize("name", STRETCHED)
def test_stretching_a_surface_takes_the_change_of_its_energy(name):
    law, g = STRETCHED[name], 5e-10
    trajectory = solve(stretching([law], loading={"g_n": Hold(level=g)}), (0.0, 1.0, 2.0))
    values, areas = trajectory, np.array([1.0, 1.5, 2.0])
    per_area = law.energy(g_n=g) * (areas if "zone" in name else 1 / areas)
    assert trajectory["W_J"] == pytest.approx(per_area - per_area[0], rel=1e-9)
    assert values["t_n_nominal"] == pytest.approx(areas * values["t_n"], rel=1e-12)
    assert audit(trajectory).energy_error < 1e-9


def test_an_energy_may_depend_on_the_stretch_of_the_surface_but_not_jump_with_it():
    varying = BondEnergy(K_0=Varying(10.0, (Linear(of="J_c", slope=0.5),)))
    trajectory = solve(stretching([varying], loading={"phi": Hold(level=0.5)}), (0.0, 2.0))
    assert trajectory["W_J"][-1] == pytest.approx(0.5 * 10.0 * 0.5 * 1.0 * 0.5**2, rel=1e-9)
    jumping = dataclasses.replace(
        stretching([varying], loading={"phi": Hold(level=0.5)}),
        loading={"phi": Hold(level=0.5), "J_c": Table(times=[0.0, 1.0, 1.0, 2.0], values=[1.0, 1.0, 2.0, 2.0])},
    )
    with pytest.raises(InputError, match="J_c stores energy, so it cannot jump"):
        assemble(jumping)


# -- partners on a surface --------------------------------------------------------------------------------------------

KT = BOLTZMANN * 300.0
K_F, K_R = 5e-17, 1.0
AREA = 1e-18
PARTNERS = PartnerMixing(epsilon=KT * np.log(K_F / K_R / AREA), a=AREA)


def partners(area, potential=PARTNERS) -> Scene:
    """Partners and their bonds at one temperature."""
    kept = Hold(level=300.0)
    interface = Interface(kept, [potential], (), [Bimolecular(k_f=K_F, k_r=K_R)], Sites(N_1, N_2))
    return Scene((Body("lower", kept), Body("upper", kept)), interface, (), {"J_c": area}, None, 300.0, {"phi": 0.3})


@pytest.mark.parametrize("area", [0.5, 4.0])
def test_bimolecular_bonds_come_to_the_equilibrium_of_their_mixture(area):
    values = solve(partners(Hold(level=area)), (0.0, 60.0))
    phi = values["phi"][-1]
    n_b, n_1, n_2 = phi * N_1 / area, (1 - phi) * N_1 / area, (N_2 - phi * N_1) / area
    assert n_b / (n_1 * n_2) == pytest.approx(K_F / K_R, rel=1e-9)
    assert values["mu"][-1] == pytest.approx(0.0, abs=1e-9 * KT)
