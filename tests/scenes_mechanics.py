"""Scenes of moving gaps: each mounting, each kind of sticking and sliding, each thermal regime, in its modes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scenes import SITES, bodies, path, together, varying

from surfacechem.laws.cohesive import (
    AdhesionIntensity,
    AdhesionLoss,
    ExponentialCohesiveZone,
    TensileStrength,
    XuNeedleman,
)
from surfacechem.laws.factors import Exponential, Linear, LinearInTemperature, Power, Proportional
from surfacechem.laws.free_energy import (
    BondedContact,
    BondEnergy,
    BondStiffness,
    Constant,
    InterfaceCapacity,
    NormalStiffness,
    TangentialStiffness,
)
from surfacechem.laws.friction import (
    AnisotropicCoulomb,
    AnisotropicViscous,
    BondedCoulomb,
    Coulomb,
    MohrCoulomb,
    Stribeck,
    Viscous,
)
from surfacechem.laws.kinetics import LinearAffinity
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.laws.longrange import LennardJonesFlatFlat
from surfacechem.scene import Body, Interface, Mounting, Scene, Stage

APART = {"T_1": 300.0, "T_2": 310.0}


@dataclass(frozen=True)
class Moving:
    """A scene with the modes in which its equations are tested."""

    scene: Callable[[], Scene]
    modes: tuple[Mapping[str, float], ...] = ({},)

    @property
    def __name__(self) -> str:
        return self.scene.__name__


def cohesive(**changes) -> ExponentialCohesiveZone:
    """Strength that falls with temperature and grows with bonding; the range of the zone varies too."""
    strength = varying(1e6, Power(exponent=-1.0), Linear(of="phi", slope=0.5))
    values = {"t_max": strength, "g_0": varying(1e-8, LinearInTemperature(slope=1e-3)), "E_n": 1e14}
    return ExponentialCohesiveZone(**values | changes)


def _gap(mounting: Mounting, loading) -> Scene:
    """A separate interface temperature, cohesion that depends on temperature and bonds."""
    heat = [path("interface", "lower", 900.0), path("upper", "interface", 300.0)]
    initial = APART | {"T_c": 305.0, "phi": 0.4, "g_n": 2e-8}
    potentials = [cohesive(), BondEnergy(K_0=300.0), InterfaceCapacity(C_c=3.0)]
    interface = Interface("T_c", potentials, (), [LinearAffinity(c_r=1e16)], SITES)
    return Scene(bodies(), interface, heat, loading, T_0=300.0, initial=initial, normal=mounting)


def inertial_gap() -> Scene:
    """Mass, spring, both dampers and a far-field traction beside the displacement."""
    mounting = Mounting(k=1e13, m=0.01, c_b=1e5, c_g=4e4, beta_1=0.3)
    return _gap(mounting, {"w_n": Ramp(start=1e-8, rate=1e-7), "F_n": Hold(level=1e4)})


def overdamped_gap() -> Scene:
    """Dampers, a spring and a far-field traction."""
    loading = {"w_n": Harmonic(mean=2e-8, amplitude=1e-8, frequency=0.3), "F_n": Hold(level=1e4)}
    return _gap(Mounting(k=1e14, c_b=1e5, c_g=4e4), loading)


def quasi_static_gap() -> Scene:
    """A spring alone: equilibrium at all times."""
    return _gap(Mounting(k=1e15), {"w_n": Ramp(start=2e-8, rate=1e-9)})


def dead_load() -> Scene:
    """A far-field traction alone on springs that bonds are."""
    potentials = [BondStiffness(E_b=1e13, E_n=1e14), BondEnergy(K_0=300.0)]
    return together(potentials, (), {"F_n": Ramp(start=1e5, rate=1e3)}, {"phi": 0.5}, [LinearAffinity(c_r=1e16)])


def no_medium_gap() -> Scene:
    """The interface has no temperature of its own; the contact damper heats the bodies."""
    interface = Interface(None, [LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10)], partition=0.3)
    mounting = Mounting(k=1e20, m=1e-3, c_b=1e3, c_g=2e3, beta_1=0.8)
    loading = {"w_n": Ramp(start=4e-10, rate=1e-9)}
    heat = [path("lower", "upper", 250.0)]
    return Scene(bodies(), interface, heat, loading, T_0=300.0, initial=APART | {"g_n": 3e-10}, normal=mounting)


def algebraic_temperature_gap() -> Scene:
    """A medium without capacity takes the heat of the contact damper."""
    interface = Interface("T_c", [NormalStiffness(E_n=1e13)])
    heat = [path("interface", "lower", 2500.0), path("interface", "upper", 700.0)]
    mounting = Mounting(k=1e13, c_g=1e6)
    loading = {"w_n": Ramp(start=1e-8, rate=1e-6)}
    return Scene(
        bodies(energy=Constant), interface, heat, loading, T_0=300.0, initial=APART | {"g_n": 1e-8}, normal=mounting
    )


def stretched_gap() -> Scene:
    """The reference surface stretches while the gap moves and bonds form."""
    scene = _gap(Mounting(k=1e14, m=0.01, c_b=1e4, c_g=1e4), {"w_n": Ramp(start=3e-8, rate=1e-9)})
    return Scene(**scene.__dict__ | {"loading": {**scene.loading, "J_c": Ramp(start=1.0, rate=0.1)}})


def rigid() -> Scene:
    """Nothing opens: the far field is borne until the interface debonds."""
    return _bonded((), varying(1e6, Proportional(of="phi")))


def rigid_under_load() -> Scene:
    """Nothing holds: the far field presses, the dead load pulls more."""
    loading = {"w_n": Hold(level=-2e-9), "F_n": Hold(level=3e5), "v": Hold(level=0.01)}
    return together((), [Coulomb(mu=0.3)], loading, normal=Mounting(k=1e14))


def rigid_with_a_mass() -> Scene:
    """Bodies that rebound from a rigid contact, and rub on it."""
    return _hitting(Mounting(k=1e13, m=0.01, c_b=1e5, c_g=4e4, e=0.6))


def rigid_with_a_damper() -> Scene:
    """Bodies that close without inertia."""
    return _hitting(Mounting(k=1e13, c_b=1e5, c_g=4e4))


def _hitting(mounting) -> Scene:
    loading = {"w_n": Ramp(start=-2e-9, rate=1e-9), "F_n": Hold(level=-3e5), "w_t": Ramp(rate=1e-3)}
    mounts = {"normal": mounting, "tangential": Mounting(k=1e8, m=10.0)}
    return together((), [Coulomb(mu=0.3)], loading, {"g_n": 3e-9, "u_t": 0.0, "v": 1e-4}, **mounts)


def _bonded(potentials, t_max) -> Scene:
    """A contact whose bonds have a strength."""
    bonds = {"reactions": [LinearAffinity(c_r=1e16)], "limits": [TensileStrength(t_max=t_max)]}
    loading, initial = {"w_n": Ramp(start=1e-9, rate=1e-9)}, {"phi": 0.6}
    return together([*potentials, BondEnergy(K_0=300.0)], (), loading, initial, normal=Mounting(k=1e14), **bonds)


def bonded_contact() -> Scene:
    """Elastic contact with a strength, quasi-static."""
    return _bonded([BondedContact(E_n=1e14)], 1e6)


SLIDING = ({"slip": 0.0}, {"slip": 1.0}, {"slip": -1.0})

PULL = {"F_t": Hold(level=3e3)}
"""A far-field traction beside the displacement."""


def _slider(mounting: Mounting | None, frictions, potentials=(), **more) -> Scene:
    """Two bodies about an interface with its own temperature, under pressure."""
    heat = [path("interface", "lower", 900.0), path("upper", "interface", 300.0)]
    interface = Interface("T_c", [InterfaceCapacity(C_c=3.0), *potentials], frictions, **more.pop("interface", {}))
    loading = {"p": Hold(level=1e5), "w_t": Ramp(start=1e-6, rate=1e-3)} | more.pop("loading", {})
    initial = APART | {"T_c": 305.0, "u_t": 5e-7} | more.pop("initial", {})
    return Scene(bodies(), interface, heat, loading, T_0=300.0, initial=initial, tangential=mounting, **more)


def inertial_slider() -> Scene:
    """Mass, spring and dampers; friction that falls with temperature."""
    return _slider(
        Mounting(k=1e8, m=10.0, c_b=200.0, c_g=100.0, beta_1=0.7),
        [Coulomb(mu=varying(0.4, Power(exponent=-1.0)), mu_s=0.6)],
        initial={"v": 2e-3},
    )


def damped_slider() -> Scene:
    """Spring and dampers."""
    return _slider(Mounting(k=1e12, c_b=1e7, c_g=1e6), [Coulomb(mu=0.4, mu_s=0.6)], initial={"v": 2e-3})


def quasi_static_slider() -> Scene:
    """A spring alone; bonds, temperature and pressure set the traction."""
    friction = MohrCoulomb(mu=varying(0.4, LinearInTemperature(slope=-1e-3)), c=2e4, mu_s=0.6)
    return _slider(Mounting(k=1e12), [friction], loading={"p": Ramp(start=1e5, rate=1e4)} | PULL)


def film_slider() -> Scene:
    """A viscous film and a spring: no sticking."""
    loading = {"g_n": Hold(level=1e-6)}
    scene = _slider(Mounting(k=1e10), [Viscous(eta=varying(0.05, Exponential(beta=0.01)))], loading=loading)
    return Scene(**scene.__dict__ | {"loading": {k: v for k, v in scene.loading.items() if k != "p"}})


def stribeck_slider() -> Scene:
    """A mass on falling friction."""
    friction = Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3, c_v=1e5)
    return _slider(Mounting(k=1e8, m=10.0), [friction], initial={"v": 2e-3})


def bonding_slider() -> Scene:
    """Bonds carry shear, form while the interface sticks, and break as it slides."""
    forms = LinearAffinity(c_r=varying(1e16, Linear(of="sticking", about=1.0, slope=1.0)))
    return _slider(
        Mounting(k=1e8, m=10.0),
        [BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.4)],
        [BondEnergy(K_0=10.0)],
        interface={"reactions": [forms], "sites": SITES},
        initial={"phi": 0.2, "v": 2e-3},
    )


ELASTIC = TangentialStiffness(E_t=varying(1e12, LinearInTemperature(slope=-1e-3)))


ACROSS = {"w_t2": Ramp(start=-2e-6, rate=5e-4)}


def plane_slider() -> Scene:
    """A mass on springs along and across, on friction that differs in the two directions."""
    friction = AnisotropicCoulomb(mu_1=varying(0.2, Power(exponent=-1.0)), mu_2=0.5)
    return _slider(
        Mounting(k=1e8, m=10.0, c_b=200.0, c_g=100.0, beta_1=0.7),
        [friction, Viscous(eta=1e-3)],
        loading={"g_n": Hold(level=1e-6)} | ACROSS,
        initial={"v": 2e-3, "v_2": -1e-3},
        transverse=Mounting(k=3e8, c_b=50.0),
    )


def plane_damped_slider() -> Scene:
    """Springs and dampers along and across, under a traction too."""
    return _slider(Mounting(k=1e12, c_b=1e7, c_g=1e6), [Coulomb(mu=0.4, mu_s=0.6)], loading=PULL | ACROSS)


def plane_uneven_slider() -> Scene:
    """Friction and dampers that differ from direction to direction, without a mass."""
    friction = AnisotropicCoulomb(mu_1=varying(0.2, Power(exponent=-1.0)), mu_2=0.5)
    mounts = {"mounting": Mounting(k=1e10, c_b=1e7, c_g=1e6), "transverse": Mounting(k=3e10, c_b=4e6)}
    return _slider(frictions=[friction], loading={"p": Ramp(start=1e5, rate=1e4)} | PULL | ACROSS, **mounts)


def plane_bonding_slider() -> Scene:
    """A mass that breaks bonds as it slides in the plane."""
    return _slider(
        Mounting(k=1e8, m=10.0),
        [BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.4), Stribeck(mu_s=0.1, mu_k=0.05, v_s=1e-3)],
        [BondEnergy(K_0=10.0)],
        interface={"reactions": [LinearAffinity(c_r=1e16)], "sites": SITES},
        loading={"F_t2": Hold(level=2e3)} | ACROSS,
        initial={"phi": 0.2, "v": 2e-3},
    )


def plane_film() -> Scene:
    """A film that resists differently along and across, beside a damper."""
    loading = {"g_n": Hold(level=1e-6), "w_t": Ramp(rate=1e-3)} | ACROSS
    film = AnisotropicViscous(eta_1=varying(0.05, Exponential(beta=0.01)), eta_2=0.1)
    interface = Interface(None, [], [film], partition=0.3)
    initial = APART | {"u_t2": 1e-6}
    return Scene(bodies(), interface, (), loading, T_0=300.0, initial=initial, tangential=Mounting(k=1e10, c_b=10.0))


def elastic_inertial_slider() -> Scene:
    """Elastic sticking on a mass."""
    return _slider(Mounting(k=1e8, m=10.0, c_b=50.0), [Coulomb(mu=0.4, mu_s=0.6)], [ELASTIC], initial={"v_t": 1e-3})


def elastic_damped_slider() -> Scene:
    """Elastic sticking on a spring and dampers, under a traction too."""
    return _slider(Mounting(k=1e12, c_b=1e7, c_g=1e6), [Coulomb(mu=0.4, mu_s=0.6)], [ELASTIC], loading=PULL)


def elastic_quasi_static_slider() -> Scene:
    """Elastic sticking on a spring and under a traction; two frictions bear it together."""
    frictions = [Coulomb(mu=0.4, mu_s=0.6), MohrCoulomb(mu=0.1, c=2e4, mu_s=0.2)]
    return _slider(Mounting(k=1e12), frictions, [ELASTIC], loading=PULL)


def elastic_rate_dependent_slider() -> Scene:
    """Elastic sticking with friction that grows with velocity."""
    friction = Stribeck(mu_s=0.4, mu_k=0.4, v_s=1e-3, c_v=1e8)
    return _slider(Mounting(k=1e12), [friction], [ELASTIC], initial={"v": 1e-3})


def elastic_prescribed() -> Scene:
    """Elastic sticking under a prescribed displacement."""
    scene = _slider(None, [Coulomb(mu=0.4, mu_s=0.6)], [ELASTIC], loading={"u_t": Ramp(rate=1e-3)})
    kept = {name: load for name, load in scene.loading.items() if name != "w_t"}
    initial = {name: value for name, value in scene.initial.items() if name != "u_t"}
    return Scene(**scene.__dict__ | {"loading": kept, "initial": initial})


def both_directions() -> Scene:
    """Normal and tangential gap move; the normal traction is the pressure of friction."""
    potentials = [NormalStiffness(E_n=varying(1e14, LinearInTemperature(slope=-1e-3)))]
    loading = {"w_n": Ramp(start=-1e-7, rate=-1e-9), "w_t": Ramp(rate=1e-3)}
    mounts = {"normal": Mounting(k=1e13, c_g=1e6), "tangential": Mounting(k=1e8, m=10.0)}
    initial = {"g_n": -1e-8, "u_t": 0.0, "v": 1e-3}
    return together(potentials, [Coulomb(mu=0.4, mu_s=0.6)], loading, initial, **mounts)


def mixed_mode() -> Scene:
    """A coupled cohesive zone that opens and shears, both directions damped."""
    zone = XuNeedleman(Phi_n=0.1, g_0=1e-8, g_t0=2e-8, q=0.8, r=0.1)
    loading = {"w_n": Ramp(start=1e-8, rate=1e-8), "u_t": Ramp(start=1e-8, rate=1e-8)}
    return together([zone], (), loading, {"g_n": 1e-8, "g_t": 1e-8}, normal=Mounting(k=1e15, c_g=1e5))


def adhesion() -> Scene:
    """Adhesion that is lost for good."""
    law, loss = AdhesionIntensity(C_N=1e15, C_T=1e15, w=0.1, E_n=1e16), [AdhesionLoss(b=1e-2)]
    loading, initial = {"w_n": Ramp(start=2e-8, rate=1e-8), "g_t": Hold(level=1e-9)}, {"g_n": 2e-8, "phi": 0.9}
    return together([law], (), loading, initial, loss, normal=Mounting(k=1e15, c_b=1e5))


def programme() -> Scene:
    """Approach, press, slide: the stages move the far field."""
    stages = (
        Stage("approach", {"w_n": -1e-7}, variable="p", value=1e4),
        Stage("hold", {}, duration=0.5),
        Stage("slide", {"w_t": 1e-3, "w_n": -1e-9}, duration=1.0),
    )
    scene = both_directions()
    initial = {**scene.initial, "w_n": 1e-8, "w_t": 0.0}
    return Scene(**scene.__dict__ | {"loading": {}, "programme": stages, "initial": initial})


def reservoirs() -> Scene:
    """Prescribed temperatures, one of them rising, about a moving gap."""
    pair = Body("lower", Ramp(start=300.0, rate=5.0)), Body("upper", Hold(level=310.0))
    interface = Interface(
        Table(times=[0.0, 1.0], values=[300.0, 305.0]), [cohesive(t_max=varying(1e6, Power(exponent=-1.0)))]
    )
    loading = {"w_n": Ramp(start=2e-8, rate=1e-9)}
    return Scene(
        pair, interface, (), loading, T_0=300.0, initial={"g_n": 2e-8}, normal=Mounting(k=1e15, c_b=1e5, c_g=1e5)
    )


WHERE = ({"closed": 1.0}, {"closed": 0.0})
GAPS = (inertial_gap, overdamped_gap, quasi_static_gap, dead_load, no_medium_gap, algebraic_temperature_gap)
SMOOTH = (*GAPS, stretched_gap, film_slider, plane_film, mixed_mode, adhesion, reservoirs)
SLIDERS = (inertial_slider, damped_slider, quasi_static_slider, stribeck_slider, bonding_slider, both_directions)
ELASTIC_SLIDERS = (elastic_inertial_slider, elastic_damped_slider, elastic_quasi_static_slider)
PLANE_SLIDERS = (plane_slider, plane_damped_slider, plane_uneven_slider, plane_bonding_slider)

ALL = [
    *(Moving(scene) for scene in SMOOTH),
    *(Moving(scene, WHERE) for scene in (rigid, rigid_under_load)),
    Moving(rigid_with_a_mass, ({"closed": 1.0, "slip": 1.0}, {"closed": 0.0, "slip": -1.0})),
    Moving(rigid_with_a_damper, ({"closed": 1.0, "slip": 1.0}, {"closed": 0.0, "slip": 0.0})),
    Moving(bonded_contact, ({"bonded": 1.0}, {"bonded": 0.0})),
    *(Moving(scene, SLIDING) for scene in (*SLIDERS, *ELASTIC_SLIDERS)),
    *(Moving(scene, SLIDING) for scene in (elastic_rate_dependent_slider, elastic_prescribed)),
    *(Moving(scene, SLIDING[:2]) for scene in PLANE_SLIDERS),
    Moving(programme, tuple({"stage": float(i)} for i in range(4))),
]
