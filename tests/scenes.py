"""Scenes built in Python: one for each thermal regime and coupling."""

from surfacechem.contracts.terms import Varying
from surfacechem.laws.cohesive import AdhesionIntensity, AdhesionLoss, ExponentialCohesiveZone, XuNeedleman
from surfacechem.laws.factors import (
    Activated,
    Exponential,
    Linear,
    LinearInTemperature,
    Polynomial,
    Power,
    Proportional,
)
from surfacechem.laws.free_energy import (
    BondEnergy,
    BondSprings,
    BondStiffness,
    Constant,
    ConstantInterfaceCapacity,
    InterfaceCapacity,
    LatticeGas,
    LinearEnthalpy,
    NormalStiffness,
    Penalty,
    Quadratic,
    TangentialStiffness,
)
from surfacechem.laws.friction import AnisotropicCoulomb, Coulomb, MohrCoulomb, Viscous
from surfacechem.laws.heat_transfer import Conductance, Radiation
from surfacechem.laws.kinetics import Arrhenius, ExponentialAffinity, LinearAffinity, Relaxation, ReversibleBell
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.laws.longrange import VanDerWaalsFlatFlat, VanDerWaalsSpherePlane
from surfacechem.scene import Body, Interface, Scene, Sites

SITES = Sites(1e18, 1e18)


def varying(value, *factors):
    return Varying(value, factors)


def bodies(first="T_1", second="T_2", energy=Quadratic, C_1=40.0, C_2=25.0):
    return Body("lower", first, energy(C=C_1)), Body("upper", second, energy(C=C_2))


def path(a, b, h):
    return Conductance(between=(a, b), h=h)


def perfect_contact(potentials, reactions=(), phi=0.0, T=300.0, C_1=1.0, C_2=1.0, energy=Quadratic, T_0=300.0, **rest):
    """Both bodies and the interface at one temperature."""
    interface = Interface("T", potentials, reactions=reactions, sites=SITES, frictions=rest.pop("frictions", ()))
    initial = {"T": T} | ({"phi": phi} if reactions else {}) | rest.pop("initial", {})
    return Scene(bodies("T", "T", energy, C_1, C_2), interface, T_0=T_0, initial=initial, **rest)


def together(potentials=(), frictions=(), loading=None, initial=None, reactions=(), limits=(), **more) -> Scene:
    """Two bodies and an interface of one temperature; ``interface``, ``pair`` and ``sites`` may be given too."""
    sites = more.pop("sites", SITES if reactions or limits else None)
    interface = more.pop("interface", None) or Interface("T", potentials, frictions, reactions, sites, limits=limits)
    pair, start = more.pop("pair", bodies("T", "T")), {"T": 300.0} | (initial or {})
    return Scene(pair, interface, loading=loading or {}, T_0=300.0, initial=start, **more)


def coupled() -> Scene:
    """Everything depends on everything: the interface has its own temperature, a moving gap, bonds and friction."""
    potentials = [
        NormalStiffness(E_n=varying(1e12, Linear(of="phi", slope=0.5), LinearInTemperature(slope=-2e-3))),
        TangentialStiffness(E_t=varying(2e11, Linear(of="phi", slope=0.8))),
        InterfaceCapacity(C_c=varying(2.0, Linear(of="phi", slope=0.3))),
        BondEnergy(
            K_0=300.0,
            K_1=80.0,
            K_2=40.0,
            K=varying(1.0, Linear(of="g_n", slope=2e5)),
            phi_eq=varying(0.9, Polynomial(c_0=2 / 3, c_1=1 / 3)),
        ),
    ]
    interface = Interface(
        "T_c",
        potentials,
        [Viscous(eta=varying(0.05, Exponential(beta=0.01)))],
        [LinearAffinity(c_r=varying(1e16, Activated(E_a=3e4)))],
        SITES,
    )
    heat = [path("interface", "lower", 900.0), path("upper", "interface", 300.0), path("lower", "upper", 50.0)]
    loading = {
        "g_n": Harmonic(mean=1e-6, amplitude=5e-7, frequency=0.5),
        "g_t": Ramp(start=1e-7, rate=1e-8),
        "v": Hold(level=0.2),
        "Q_1": Hold(level=20.0),
        "Q_c": Ramp(start=5.0, rate=1.0),
    }
    return Scene(
        bodies(), interface, heat, loading, None, 300.0, {"T_1": 300.0, "T_2": 310.0, "T_c": 320.0, "phi": 0.4}
    )


def no_medium() -> Scene:
    """The bodies touch directly; half of another split of the heat goes into body 1."""
    interface = Interface(
        None,
        [BondEnergy(K_0=300.0)],
        [Coulomb(mu=varying(0.3, Power(exponent=-1.0)))],
        [LinearAffinity(c_r=1e16)],
        SITES,
        partition=0.3,
    )
    loading = {"v": Hold(level=0.02), "p": Hold(level=1e5), "Q_c": Hold(level=3.0)}
    initial = {"T_1": 290.0, "T_2": 330.0, "phi": 0.1}
    return Scene(bodies(energy=Constant), interface, [path("lower", "upper", 250.0)], loading, None, 300.0, initial)


def algebraic() -> Scene:
    """A medium without capacity whose friction falls with temperature."""
    interface = Interface("T_c", [], [Viscous(eta=varying(0.1, Exponential(beta=0.02)))])
    heat = [path("interface", "lower", 2500.0), path("interface", "upper", 700.0)]
    loading = {"v": Hold(level=0.1), "g_n": Hold(level=1e-6)}
    return Scene(bodies(energy=Constant), interface, heat, loading, None, 300.0, {"T_1": 290.0, "T_2": 350.0})


def mean_influx() -> Scene:
    """Heat of friction into both bodies alike, and a stretched area."""
    mean = Conductance(between=("upper", "lower"), h=40.0, closure="mean")
    radiation = Radiation(between=("lower", "upper"), epsilon_1=0.8, closure="mean")
    interface = Interface("T_c", [InterfaceCapacity(C_c=3.0)], [Coulomb(mu=0.3)])
    loading = {"p": Hold(level=1e5), "v": Hold(level=0.02), "J_c": Ramp(start=1.0, rate=0.01)}
    heat = [mean, radiation, path("lower", "upper", 70.0)]
    return Scene(bodies(), interface, heat, loading, T_0=300.0, initial={"T_1": 290.0, "T_2": 350.0, "T_c": 310.0})


def one_sided() -> Scene:
    """The interface is in perfect contact with body 1 only; the other body loses heat to the surroundings."""
    interface = Interface("T_1", [BondEnergy(K_2=20.0), InterfaceCapacity(C_c=3.0)], (), [Relaxation(tau=0.5)], SITES)
    heat = [path("interface", "upper", 100.0), path("upper", "surroundings", 12.0)]
    return Scene(bodies(), interface, heat, {}, Hold(level=280.0), 300.0, {"T_1": 310.0, "T_2": 290.0, "phi": 0.0})


def reservoirs() -> Scene:
    """One body is a reservoir, the other follows a prescribed temperature."""
    pair = Body("lower", Hold(level=310.0)), Body("upper", Ramp(start=300.0, rate=2.0), Quadratic(C=10.0))
    interface = Interface(
        "T_c",
        [BondEnergy(K_0=30.0, K_1=5.0), ConstantInterfaceCapacity(C_c=2.0)],
        (),
        [ExponentialAffinity(C_r=1e36)],
        SITES,
    )
    heat = [path("lower", "interface", 100.0), path("interface", "upper", 70.0)]
    return Scene(pair, interface, heat, {}, None, 300.0, {"T_c": 305.0, "phi": 0.2})


def prescribed_medium() -> Scene:
    """A medium that is kept at a temperature from outside."""
    interface = Interface(Harmonic(mean=300.0, amplitude=5.0, frequency=1.0), [InterfaceCapacity(C_c=2.0)])
    heat = [path("lower", "interface", 100.0), path("interface", "upper", 70.0)]
    return Scene(bodies(), interface, heat, {}, None, 300.0, {"T_1": 305.0, "T_2": 295.0})


def stretched() -> Scene:
    """The reference surface stretches while bonds form; the second surface, with fewer sites, limits them."""
    interface = Interface(
        "T_c",
        [LatticeGas(epsilon=1e-20), InterfaceCapacity(C_c=3.0)],
        [Coulomb(mu=0.3)],
        [ExponentialAffinity(C_r=1e38)],
        Sites(1e18, 6e17, 1),
    )
    heat = [path("lower", "interface", 100.0), path("interface", "upper", 70.0)]
    loading = {"J_c": Ramp(start=1.0, rate=0.1), "v": Hold(level=0.01), "p": Hold(level=1e4)}
    return Scene(
        bodies(), interface, heat, loading, None, 300.0, {"T_1": 300.0, "T_2": 300.0, "T_c": 300.0, "phi": 0.1}
    )


def prescribed_bonding() -> Scene:
    """Bonds form as told; their heat still follows."""
    loading = {"phi": Table(times=[0.0, 1.0, 2.0], values=[0.0, 0.5, 0.6])}
    interface = Interface("T", [BondEnergy(K_0=100.0)], sites=SITES)
    return Scene(bodies("T", "T"), interface, (), loading, None, 300.0, {"T": 300.0})


def cure() -> Scene:
    """A constant heat of reaction, thermally activated, between bodies of constant capacity."""
    reaction = Arrhenius(A=1e13, E_a=1.1e5)
    return perfect_contact([LinearEnthalpy(H_r=300.0)], [reaction], T=320.0, energy=Constant)


def loaded_bonds() -> Scene:
    """Elastic bonds across an opening gap: their force speeds up rupture, their energy cools what they stretch."""
    potentials = [LatticeGas(epsilon=3e-20), BondSprings(k_b=varying(1e-3, LinearInTemperature(slope=-1e-3)))]
    interface = Interface(
        "T_c",
        [*potentials, InterfaceCapacity(C_c=3.0)],
        reactions=[ReversibleBell(k_off=2.0, x_off=4e-10)],
        sites=SITES,
    )
    heat = [path("lower", "interface", 100.0), path("interface", "upper", 70.0)]
    initial = {"T_1": 300.0, "T_2": 305.0, "T_c": 310.0, "phi": 0.6}
    return Scene(bodies(), interface, heat, {"g_n": Ramp(start=2e-9, rate=1e-9)}, None, 300.0, initial)


def shared_load() -> Scene:
    """A contact under tension whose bonds form and break at rates of their own."""
    interface = Interface(
        "T",
        [LatticeGas(epsilon=3e-20), NormalStiffness(E_n=1e15)],
        reactions=[ReversibleBell(k_off=2.0, x_off=4e-10)],
        sites=SITES,
    )
    loading = {"g_n": Ramp(start=1e-9, rate=1e-10)}
    return Scene(bodies("T", "T"), interface, (), loading, None, 300.0, {"T": 300.0, "phi": 0.6})


def sliding() -> Scene:
    """Dry sliding that reverses."""
    loading = {"v": Harmonic(amplitude=0.02, frequency=1.0), "p": Hold(level=1e5)}
    return perfect_contact([], frictions=[Coulomb(mu=0.3)], C_1=2000.0, C_2=2000.0, loading=loading)


def reacting_film() -> Scene:
    """An interface without capacity that is heated by bonds: its temperature has a fold."""
    interface = Interface("T_c", [LinearEnthalpy(H_r=300.0)], (), [Arrhenius(A=1e10, E_a=8e4)], SITES)
    heat = [path("interface", "lower", 2500.0), path("interface", "upper", 700.0)]
    initial = {"T_1": 300.0, "T_2": 310.0, "T_c": 305.0, "phi": 0.2}
    return Scene(bodies(energy=Constant), interface, heat, {}, None, 300.0, initial)


def sliding_both_ways() -> Scene:
    """Anisotropic friction along two directions between bodies that touch, some of its heat lost."""
    law = AnisotropicCoulomb(mu_1=varying(0.3, Power(exponent=-1.0)), mu_2=0.2)
    interface = Interface(None, [], [law], partition=0.3, loss=0.1)
    loading = {"v": Hold(level=0.02), "v_2": Ramp(start=0.01, rate=0.1), "p": Hold(level=1e5)}
    initial = {"T_1": 290.0, "T_2": 330.0}
    heat = [path("lower", "upper", 250.0), path("lower", "surroundings", 30.0)]
    return Scene(bodies(), interface, heat, loading, Hold(level=280.0), 300.0, initial)


def adhesive() -> Scene:
    """A cohesive zone that weakens with temperature and with the loss of its bonds, in a long range."""
    strength = varying(4e5, Proportional(of="phi"), Power(exponent=-1.0))
    potentials = [
        ExponentialCohesiveZone(t_max=strength, g_0=varying(1e-6, LinearInTemperature(slope=1e-3)), E_n=1e12),
        XuNeedleman(Phi_n=0.3, g_0=1e-6, g_t0=2e-6, q=0.8, r=0.2),
        AdhesionIntensity(C_N=1e12, C_T=5e11, w=0.2, E_n=1e13),
        VanDerWaalsFlatFlat(A_H=1e-19, D_0=1e-7),
        VanDerWaalsSpherePlane(A_H=1e-19, R=1e-6, area=1e-12),
        BondStiffness(E_b=1e11, E_n=1e12),
        Penalty(E_n=varying(1e12, Power(exponent=-1.0))),
        InterfaceCapacity(C_c=5.0),
    ]
    interface = Interface("T_c", potentials, [MohrCoulomb(mu=0.3, t_n_max=1e7)], [AdhesionLoss(b=2.0)], SITES)
    heat = [path("interface", "lower", 900.0), path("upper", "interface", 300.0)]
    loading = {"g_n": Ramp(start=1e-6, rate=5e-7), "g_t": Ramp(start=1e-7, rate=1e-6), "v": Hold(level=0.2)}
    initial = {"T_1": 300.0, "T_2": 310.0, "T_c": 320.0, "phi": 0.4}
    return Scene(bodies(), interface, heat, loading, None, 300.0, initial)


ALL = [
    *(adhesive, coupled, no_medium, algebraic, mean_influx, one_sided, reservoirs, prescribed_medium),
    *(stretched, prescribed_bonding, cure, loaded_bonds, shared_load, sliding, reacting_film, sliding_both_ways),
]
