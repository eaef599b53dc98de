"""Random scenes of moving gaps: laws, parameters over many decades, loads and programmes, all from one seed."""

import random

from scenes import SITES, path, varying

from surfacechem.laws.bonding import BondEnergy
from surfacechem.laws.bulk import Constant, Quadratic
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.contact import (
    BondedContact,
    BondStiffness,
    InterfaceCapacity,
    NormalStiffness,
    Penalty,
    TangentialStiffness,
)
from surfacechem.laws.factors import Linear, LinearInTemperature, Power
from surfacechem.laws.friction import BondedCoulomb, Coulomb, MohrCoulomb, Stribeck
from surfacechem.laws.kinetics import ExponentialAffinity, LinearAffinity
from surfacechem.laws.limits import TensileStrength
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.laws.longrange import LennardJonesFlatFlat, VanDerWaalsFlatFlat
from surfacechem.scene import Body, Interface, Mounting, Scene, Stage
from surfacechem.terms import reads


class Dice:
    """Draws of one scene; lengths, stiffnesses and times have common scales, from which parameters stray by decades."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.end = self.decades(-3, 3)
        self.length = self.decades(-9, -5)
        self.stiffness = self.decades(8, 15)

    def decades(self, low: float, high: float) -> float:
        return 10 ** self.random.uniform(low, high)

    def chance(self, p: float) -> bool:
        return self.random.random() < p

    def pick(self, *choices):
        return self.random.choice(choices)

    def signed(self, size: float) -> float:
        return self.pick(-1, 1) * size

    def near(self, size: float, decades: float = 1.0) -> float:
        """A value about a size, within some decades."""
        return size * self.decades(-decades, decades)


def normal_laws(dice: Dice) -> tuple[list, list]:
    """Potentials of the normal gap and limits."""
    E, length = dice.near(dice.stiffness, 2), dice.length
    strength = dice.near(E * length)
    strong = varying(strength, Power(exponent=-1.0)) if dice.chance(0.5) else strength
    softer = varying(E, LinearInTemperature(slope=-1e-4)) if dice.chance(0.3) else E
    return dice.pick(
        ([NormalStiffness(E_n=softer)], []),
        ([Penalty(E_n=softer)], []),
        ([ExponentialCohesiveZone(t_max=strong, g_0=length, E_n=dice.near(E, 2))], []),
        ([BondStiffness(E_b=E, E_n=dice.near(E)), BondEnergy(K_0=dice.near(E * length**2))], []),
        ([BondedContact(E_n=E), BondEnergy(K_0=dice.near(E * length**2, 2))], [_limit(dice, strength)]),
        ([BondEnergy(K_0=dice.near(E * length**2, 2))], [_limit(dice, strength)]),
        ([LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10)], []),
        ([VanDerWaalsFlatFlat(A_H=6.5e-20), Penalty(E_n=dice.decades(15, 20))], []),
    )


def _limit(dice: Dice, strength: float) -> TensileStrength:
    return TensileStrength(
        t_max=strength,
        release=dice.pick("joint", "local"),
        violation=dice.pick("refuse", "warn", "accept"),
    )


def history(dice: Dice, size: float, *, smooth: bool):
    """A load about a size over the run; made of straight lines unless it may be smooth."""
    end = dice.end
    times = sorted(dice.random.uniform(0, end) for _ in range(5))
    pulse = times[0] + end * 1e-9
    return dice.pick(
        Hold(level=dice.signed(size)),
        Ramp(start=0.0, rate=dice.signed(size) / end),
        *[Harmonic(mean=dice.pick(0.0, size), amplitude=size, frequency=dice.near(3 / end))] * smooth,
        Table(times=[0.0, *times], values=[dice.random.uniform(-size, size) for _ in range(6)]),
        Table(times=[0.0, times[0], pulse, pulse + end * 1e-9], values=[0.0, 0.0, dice.signed(size), 0.0]),
    )


def mounting(dice: Dice) -> Mounting:
    """Inertial, overdamped, quasi-static, or anything between."""
    k = dice.near(dice.stiffness, 2)
    kind = dice.pick("inertial", "damped", "quasi-static", "all")
    m = dice.near(k * (dice.end / 20) ** 2, 1) if kind in ("inertial", "all") else 0.0
    c = dice.near(k * dice.end / 10, 2) if kind in ("damped", "all") else 0.0
    return Mounting(k=k, m=m, c_b=c * dice.pick(0, 1), c_g=c, beta_1=dice.pick(0.0, 0.5, 1.0))


def friction(dice: Dice) -> list:
    mu = dice.random.uniform(0.05, 0.8)
    weak = varying(mu, Power(exponent=-1.0)) if dice.chance(0.3) else mu
    return [
        dice.pick(
            Coulomb(mu=weak),
            Coulomb(mu=weak, mu_s=dice.random.uniform(0.05, 1.2)),
            MohrCoulomb(mu=weak, t_n_max=dice.decades(2, 5), c=dice.decades(1, 4)),
            Stribeck(mu_s=1.3 * mu, mu_k=mu, v_s=dice.near(dice.length / dice.end, 2)),
            BondedCoulomb(mu=mu, mu_b=1.5 * mu, mu_ub=1.1 * mu),
        )
    ]


def stages(dice: Dice, names: list[str]) -> tuple[Stage, ...]:
    size = dice.length / dice.end
    made = []
    for i in range(3):
        rates = {name: dice.signed(dice.near(10 * size)) for name in names if dice.chance(0.7)}
        made.append(Stage(f"stage {i}", rates, duration=dice.end * dice.random.uniform(0.05, 0.4)))
    return (*made, Stage("rest", {}))


def random_scene(seed: int) -> tuple[Scene, float]:
    """A scene and the length of its run [s]."""
    dice = Dice(seed)
    normal = dice.chance(0.7)
    sliding = dice.chance(0.6) or not normal
    potentials, limits = normal_laws(dice) if normal else ([], [])
    frictions = friction(dice) if sliding else []
    loading, initial = {}, {}
    mounts = {}
    programmed = dice.chance(0.25)
    drives = [f"w_{axis}" for axis, used in (("n", normal), ("t", sliding)) if used]
    programme = stages(dice, drives) if programmed else ()
    moved = {name for stage in programme for name in stage.rates}
    loading |= {
        name: history(dice, dice.near(dice.length), smooth=name == "w_n") for name in drives if name not in moved
    }
    if normal:
        mounts["normal"] = mounting(dice)
        initial["g_n"] = 3e-10 if isinstance(potentials[0], LennardJonesFlatFlat) else 0.0
    if sliding:
        mounts["tangential"] = mounting(dice)
        if not normal or not any("g_n" in _read(p) for p in potentials):
            loading["p"] = Hold(level=dice.near(dice.stiffness * dice.length))
        if dice.chance(0.3):
            potentials = [*potentials, TangentialStiffness(E_t=dice.near(dice.stiffness, 2))]
    scene = _thermal(dice, potentials, frictions, limits, loading, initial, mounts, programme)
    return scene, dice.end


def _read(potential) -> tuple[str, ...]:
    return reads(potential.statement)


def _thermal(dice: Dice, potentials, frictions, limits, loading, initial, mounts, programme) -> Scene:
    """Bodies, temperatures, bonds."""
    bonds = any("phi" in _read(p) for p in potentials) or isinstance(next(iter(frictions), None), BondedCoulomb)
    forming = [dice.pick(LinearAffinity(c_r=varying(dice.decades(14, 20), *_where(frictions))), _exponential(dice))]
    energy, kind = dice.pick(Quadratic, Constant), dice.pick("together", "apart", "reservoirs", "no medium")
    C = dice.decades(-3, 4)
    reads_T = limits or any("T_c" in _read(p) or _varies(p) for p in potentials) or bonds
    kind = "together" if kind == "no medium" and (reads_T or frictions) else kind
    heat = []
    if kind == "reservoirs":
        pair, T_c = (Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))), Hold(level=300.0)
    elif kind == "apart":
        pair, T_c = (Body("lower", "T_1", energy(C=C)), Body("upper", "T_2", energy(C=2 * C))), "T_c"
        heat = [path("interface", "lower", dice.decades(0, 5)), path("interface", "upper", dice.decades(0, 5))]
        potentials = [*potentials, InterfaceCapacity(C_c=dice.near(C, 2))]
        initial |= {"T_1": 300.0, "T_2": 320.0, "T_c": 305.0}
    elif kind == "together":
        pair, T_c = (Body("lower", "T", energy(C=C)), Body("upper", "T", energy(C=C))), "T"
        initial |= {"T": 300.0}
    else:
        pair, T_c = (Body("lower", "T_1", energy(C=C)), Body("upper", "T_2", energy(C=C))), None
        initial |= {"T_1": 300.0, "T_2": 320.0}
    if bonds:
        initial |= {"phi": dice.random.uniform(0.2, 1.0)}
    interface = Interface(T_c, potentials, frictions, forming if bonds else (), SITES, limits=limits)
    return Scene(pair, interface, heat, loading, T_0=300.0, initial=initial, programme=programme, **mounts)


def _exponential(dice: Dice) -> ExponentialAffinity:
    return ExponentialAffinity(C_r=dice.decades(33, 40))


def _varies(potential) -> bool:
    return any(hasattr(getattr(potential, name), "factors") for name, _ in potential.specs())


def _where(frictions) -> tuple:
    """Bonds form while the interface sticks, where it can."""
    return (Linear(of="sticking", about=1.0, slope=1.0),) if frictions else ()
