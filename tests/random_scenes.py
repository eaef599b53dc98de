"""Random scenes from one seed: laws drawn from all there are, ways to hold the gap, loads, programmes, temperatures."""

from dataclasses import replace
from functools import cache

from random_laws import T_0, Dice, laws

from mechanisms import SHIPPED
from surfacechem.contracts.terms import (
    BodyEnergy,
    Friction,
    HeatTransfer,
    Law,
    Limit,
    Potential,
    Property,
    RateLaw,
    Varying,
    reads,
)
from surfacechem.documents import mechanisms
from surfacechem.laws.cohesive import AdhesionIntensity, AdhesionLoss, CompliantDebonding
from surfacechem.laws.coolprop import CoolPropFluid
from surfacechem.laws.free_energy import BondStiffness, ConstantInterfaceCapacity, InterfaceCapacity
from surfacechem.laws.loading import Hold
from surfacechem.mechanism import load_mechanism
from surfacechem.scene import Body, Interface, Medium, Mounting, Scene, Sites, Stage

MEDIUM = ("k_m", "eta_m", "rho_m", "cp_m", "gamma_m", "p_m", "d_m", "f_m")
OWN = {"T_from", "T_to", "mu", "dmu_dphi", "ln_theta", "bonded", "softening", "direction", "direction_2", "sticking"}
OWN |= {"v_n", "overshoot"}
OWN |= {"T_c", "T_0", "N_c", "n_c", "n_1", "n_2", *MEDIUM}
"""What a scene gives without being asked for it."""


FORMULAS = ("transverse", "limit", "evolution", "spots", "gas", "radiation")


def formulas_read(law: Law | type[Law]) -> set[str]:
    """What the formulas of a law read."""
    formulas = [getattr(law, name) for name in (law.formula, *FORMULAS) if getattr(law, name, None)]
    return {name for formula in formulas for name in reads(formula)} - {"self"}


def asked(law: Law) -> set[str]:
    """What a law reads: in its formulas, and in the factors of its parameters."""
    found = formulas_read(law)
    for name, _ in law.specs():
        value = getattr(law, name)
        if isinstance(value, Varying):
            for factor in value.factors:
                found |= {factor.of, *reads(factor.factor)} - {"x"}
    return found


_mechanism = cache(load_mechanism)


class Composer:
    """Puts a scene together and gives everything that is read a role."""

    def __init__(self, seed: int) -> None:
        self.dice = Dice(seed)
        self.aside = Dice(seed)
        self.aside.random.seed(f"across {seed}")
        self.falling = Dice(seed)
        self.falling.random.seed(f"falling {seed}")
        self.potentials: list[Law] = []
        self.frictions: list[Law] = []
        self.reactions: list[Law] = []
        self.limits: list[Law] = []
        self.heat: list[Law] = []
        self.loading: dict = {}
        self.initial: dict[str, float] = {}
        self.mechanism = None
        self.rates: dict[str, float] = {}

    def draw(self, contract: type[Law], *wanted: str, without: tuple = (), **options) -> Law:
        """A law that reads some of what is wanted and nothing that this scene does not have."""
        known = [law for law in laws(contract).values() if self._fits(law, without)]
        known = [law for law in known if not wanted or {*wanted} & formulas_read(law)]
        return self.dice.law(self.dice.random.choice(known), tuple(sorted({"T_c", "phi"} & self.readable)), **options)

    def _fits(self, law: type[Law], without: tuple = ()) -> bool:
        return not issubclass(law, without) and formulas_read(law) <= self.readable

    def _readable(self) -> set[str]:
        """Variables that this scene has, or could have."""
        found = OWN | {"p", "v_2"}
        found -= {"T_c"} if self.kind in ("no medium", "bare") else set()
        found |= {"phi", "f"} if self.bonds else set()
        found |= {"g_n"} if self.gap not in ("none", "rigid") else set()
        found |= {"g_t"} if self.slip in ("moving", "dead", "elastic only") or self.dice.chance(0.1) else set()
        return found | ({"v"} if self.slip not in ("none", "elastic only") else set())

    def asked(self) -> set[str]:
        everything = [*self.potentials, *self.frictions, *self.reactions, *self.limits, *self.heat]
        return {name for law in everything for name in asked(law)}

    def scene(self) -> Scene:
        dice = self.dice
        self.kind = dice.pick(
            "together", "together", "apart", "apart", "bare", "one side", "reservoirs", "held", "no medium"
        )
        self.gap = dice.pick("none", "prescribed", "moving", "moving", "moving", "dead", "rigid")
        self.bonds = dice.chance(0.55)
        self.slip = dice.pick("none", "none", "prescribed", "moving", "moving", "moving", "dead", "elastic only")
        self.sites = self._some_sites()
        if dice.chance(0.06):
            self._mechanism()
        self.readable = self._readable()
        self._potentials()
        self._reactions()
        self._limits()
        self._frictions()
        bodies, T_c, surroundings = self._temperatures()
        self._heat()
        mounts = self._mountings()
        self._prescribed()
        programme = self._programme()
        self._start()
        mounts |= self._across(mounts) | self._falling(mounts)
        sites, medium = self.mechanism.sites if self.mechanism else self.sites, self._medium()
        laws_of = {"limits": self.limits, "partition": dice.random.random(), "medium": medium}
        reading = (self.potentials, self.frictions, self.reactions)
        interface = Interface(T_c, *reading, sites, **laws_of, **self._species())
        return Scene(
            bodies, interface, self.heat, self.loading, surroundings, T_0, self.initial, programme=programme, **mounts
        )

    # -- laws -----------------------------------------------------------------------------------------------------

    def _mechanism(self) -> None:
        self.mechanism, self.bonds = _mechanism(mechanisms() / self.dice.pick(*SHIPPED)), False
        first, *_, last = self.mechanism.species
        share = self.dice.pick(0.0, 1e-9, self.dice.random.random(), 1.0)
        self.initial |= self.mechanism.coverages({first: 1 - share, last: share})
        self.potentials += self.mechanism.potentials
        self.reactions += self.mechanism.reactions

    def _potentials(self) -> None:
        dice = self.dice
        if self.gap not in ("none", "rigid"):
            known = dice.pick(1, 1, 1, 2)
            self.potentials += [self.draw(Potential, "g_n") for _ in range(known)]
        if self.bonds:
            self.potentials.append(self.draw(Potential, "phi"))
        if self.slip == "elastic only" or (self.slip in ("moving", "dead") and dice.chance(0.35)):
            self.potentials.append(self.draw(Potential, "g_t"))
        if dice.chance(0.08):
            self.potentials.append(self.draw(Potential))

    def _reactions(self) -> None:
        if not self.bonds or self.dice.chance(0.08):
            return
        dice = self.dice
        needs_gap = (CompliantDebonding,) if self.gap in ("none", "rigid", "prescribed") else ()
        law = self.draw(RateLaw, without=needs_gap)
        if isinstance(law, CompliantDebonding):
            E_b = dice.near(dice.stiffness)
            peak = dice.near(dice.length)
            law = CompliantDebonding(t_max=E_b * peak, E_b=E_b, g_f=peak * (1 + dice.decades(-2, 2)))
            self.potentials = [BondStiffness(E_b=E_b, E_n=dice.near(E_b, 2)), *self.potentials[1:]]
        if isinstance(law, AdhesionLoss) and not any(isinstance(p, AdhesionIntensity) for p in self.potentials):
            law = self.draw(RateLaw, "mu", without=(AdhesionLoss,))
        self.reactions = [law]
        if dice.chance(0.15):
            self.reactions.append(self.draw(RateLaw, without=(CompliantDebonding, AdhesionLoss)))

    def _limits(self) -> None:
        if self.mechanism is None and self.gap in ("moving", "rigid", "dead") and self.dice.chance(0.25):
            self.limits = [self.draw(Limit)]

    def _frictions(self) -> None:
        if self.slip in ("none", "elastic only"):
            return
        across = [law for law in laws(Friction).values() if law.transverse is not None]
        without = tuple(across) if self.slip != "prescribed" else ()
        self.frictions = [self.draw(Friction, without=without)]
        if self.dice.chance(0.15):
            memory = tuple(law for law in laws(Friction).values() if law.internal)
            self.frictions.append(self.draw(Friction, without=(*without, *memory)))
        if self.mechanism is not None:
            self.frictions = [law for law in self.frictions if not law.breaks_bonds]

    # -- heat -----------------------------------------------------------------------------------------------------

    def _temperatures(self):
        dice = self.dice
        C, energy = dice.capacity, list(laws(BodyEnergy).values())
        first, second = (dice.pick(*energy)(C=dice.near(C, 1.5)) for _ in range(2))
        hot = [dice.pick(T_0, T_0, dice.random.uniform(250, 400)) for _ in range(3)]
        if dice.chance(0.04):
            hot = [dice.decades(0, 3.5) for _ in hot]
        self.ends = [("lower", "upper")]
        through = [("lower", "interface"), ("interface", "upper")]
        surroundings = None
        if dice.chance(0.12):
            surroundings = Hold(level=hot[2])
            self.ends.append((dice.pick("lower", "upper"), "surroundings"))
        together = {"T": hot[0]}
        apart = {"T_1": hot[0], "T_2": hot[1]}
        pair = (Body("lower", "T_1", first), Body("upper", "T_2", second))
        if self.kind == "together":
            self.ends, pair = self.ends[1:], (Body("lower", "T", first), Body("upper", "T", second))
            self.initial |= together
            return pair, "T", surroundings
        if self.kind == "reservoirs":
            pair = (Body("lower", dice.history(hot[0], positive=True)), Body("upper", Hold(level=hot[1])))
            pair = dice.pick(pair, tuple(Body(name, Hold(level=T_0)) for name in ("lower", "upper")))
            T_c = dice.pick("T_c", Hold(level=T_0))
            self.ends += through
            if T_c == "T_c":
                self._capacity(C)
                self.initial["T_c"] = hot[2]
            return pair, T_c, surroundings
        self.initial |= apart
        if self.kind == "no medium":
            return pair, None, surroundings
        if self.kind == "one side":
            self.ends = self.ends + [("interface", "upper")] * dice.chance(0.5)
            return pair, "T_1", surroundings
        self.ends += through
        if self.kind == "held":
            return pair, dice.pick(Hold(level=hot[2]), dice.history(hot[2], positive=True)), surroundings
        if self.kind == "apart":
            self._capacity(C)
            self.initial["T_c"] = hot[2]
        return pair, "T_c", surroundings

    def _capacity(self, C: float) -> None:
        law = self.dice.pick(InterfaceCapacity, ConstantInterfaceCapacity)
        self.potentials.append(law(C_c=self.dice.near(C, 3)))

    def _heat(self) -> None:
        chosen = [ends for ends in self.ends if "interface" in ends or self.dice.chance(0.6)]
        for ends in chosen:
            self.heat.append(self.draw(HeatTransfer, between=ends))

    def _medium(self) -> Medium | None:
        needs = self.asked() & {*MEDIUM}
        if not needs:
            return None
        dice = self.dice
        thickness = dice.near(dice.length) if self.gap == "none" or needs & {"f_m", "p_m"} or dice.chance(0.5) else None
        if needs & {"gamma_m", "p_m"} or dice.chance(0.1):
            return Medium(CoolPropFluid(dice.pick("Air", "Nitrogen"), dice.decades(3, 6)), {}, thickness)
        sizes = {"k_m": 0.1, "eta_m": dice.units["Pa s"], "rho_m": 1e3, "cp_m": 2e3}
        given = {name: dice.near(size) for name, size in sizes.items()}
        properties = [law for law in laws(Property).values() if law.quantity in needs]
        if properties and dice.chance(0.4):
            law = dice.pick(*properties)
            given[law.quantity] = dice.law(law)
        return Medium(None, given, thickness)

    # -- motion ---------------------------------------------------------------------------------------------------

    def _mounting(self) -> Mounting:
        """Inertial, overdamped, quasi-static, or anything between; sometimes damped so little that it hardly counts."""
        dice = self.dice
        k = dice.near(dice.stiffness, 2)
        kind = dice.pick("inertial", "damped", "quasi-static", "all")
        m = dice.near(k * (dice.end / 20) ** 2, 1.5) if kind in ("inertial", "all") else 0.0
        c = dice.near(k * dice.end / 10, 3) if kind in ("damped", "all") else 0.0
        return Mounting(k=k, m=m, c_b=c * dice.pick(0, 1), c_g=c, beta_1=dice.pick(0.0, 0.5, 1.0))

    def _mountings(self) -> dict[str, Mounting]:
        dice, found = self.dice, {}
        if self.gap in ("moving", "rigid"):
            found["normal"] = self._mounting() if self.gap == "moving" else Mounting(k=dice.near(dice.stiffness))
            self.loading["w_n"] = dice.history(dice.near(dice.length))
            if dice.chance(0.1):
                self.loading["F_n"] = dice.history(dice.near(dice.traction))
        elif self.gap == "dead":
            self.loading["F_n"] = dice.history(dice.near(dice.traction))
        if self.slip == "moving":
            found["tangential"] = self._mounting()
            self.loading["w_t"] = dice.history(dice.near(dice.length))
            if dice.chance(0.1):
                self.loading["F_t"] = dice.history(dice.near(dice.traction))
        elif self.slip == "dead":
            self.loading["F_t"] = dice.history(dice.near(dice.traction, 1.5))
        elif self.slip == "elastic only":
            self.loading["u_t"] = dice.history(dice.near(dice.length))
        return found

    def _across(self, mounts: dict[str, Mounting]) -> dict[str, Mounting]:
        """Now and then what moves along the interface moves across it, too; by dice of its own."""
        dice = self.aside
        bound = "g_t" in self.asked() or any(law.internal for law in self.frictions)
        if self.slip not in ("moving", "dead") or bound or dice.chance(0.4):
            return {}
        dry = [law for law in laws(Friction).values() if hasattr(law, "transverse_limit")]
        if any("p" in asked(law) for law in self.frictions) and dice.chance(0.5):
            self.frictions = [dice.law(dice.pick(*dry))]
        if self.slip == "dead":
            self.loading["F_t2"] = dice.history(dice.near(dice.traction, 1.5))
            return {}
        self.loading["w_t2"] = dice.history(dice.near(dice.length))
        if mounts["tangential"].m and dice.chance(0.5):
            self.initial |= {v: dice.signed(dice.near(dice.length / dice.end)) for v in ("v", "v_2")}
        return {"transverse": replace(self._mounting(), m=0.0)} if dice.chance(0.2) else {}

    def _falling(self, mounts: dict[str, Mounting]) -> dict[str, Mounting]:
        """Now and then what is rigid falls with a mass, or sinks in a damper; by dice of its own."""
        dice = self.falling
        if self.gap != "rigid" or dice.chance(0.3) or any(law.internal for law in self.frictions):
            return {}
        k = mounts["normal"].k
        m = dice.near(k * (dice.end / 20) ** 2, 1.5) if dice.chance(0.8) else 0.0
        c = dice.near(k * dice.end / 10, 3) * dice.pick(0, 0, 1) if m else dice.near(k * dice.end / 10, 3)
        self.initial |= {"g_n": dice.pick(0.0, dice.near(dice.length))}
        self.initial |= {"v_n": dice.signed(dice.near(dice.length / dice.end))} if m and dice.chance(0.5) else {}
        e = dice.pick(0.0, 0.3, 0.8, 0.95, 1.0) if m else 0.0
        return {"normal": replace(mounts["normal"], m=m, c_g=c, c_b=c * dice.pick(0, 1), e=e)}

    def _prescribed(self) -> None:
        """What is read and has no role yet; heat and area stretch now and then."""
        dice, needs = self.dice, self.asked()
        needs |= {"v", "v_2"} if "direction_2" in needs else set()
        sizes = {"v": dice.length / dice.end, "v_2": dice.length / dice.end, "g_t": dice.length, "g_n": dice.length}
        positive = self._needs_open_gap()
        moves = {"moving", "dead", "rigid"}
        gap_is_read = any("g_n" in asked(p) for p in self.potentials)
        if self.gap not in moves and "g_n" in needs | ({"g_n"} if "d_m" in needs and self.gap != "none" else set()):
            self.loading["g_n"] = dice.history(dice.near(dice.length), positive=positive or dice.chance(0.5))
        if "g_t" in needs and self.slip not in ("moving", "dead", "elastic only"):
            self.loading["g_t"] = dice.history(dice.near(sizes["g_t"]))
        if "phi" in needs and not self.reactions and not self.limits:
            self.loading["phi"] = dice.history(0.5 * self.sites.phi_max, positive=True)
        for name in sorted({"v", "v_2"} & needs):
            if self.slip == "prescribed" or name == "v_2":
                self.loading[name] = dice.history(dice.near(10 * sizes[name]))
        if ("v" in needs or self.frictions) and self.slip == "prescribed" and "v" not in self.loading:
            self.loading["v"] = dice.history(dice.near(10 * sizes["v"]))
        if {"p", "f", "t_n"} & needs and not gap_is_read and self.gap != "rigid":
            if "p" in needs:
                self.loading["p"] = dice.history(dice.near(dice.traction), positive=True)
            if "f" in needs:
                self.loading[dice.pick("f", "t_n")] = dice.history(dice.near(1e-11))
                if "t_n" in self.loading:
                    self.loading["t_n"] = dice.history(dice.near(dice.traction))
        for name in ("Q_1", "Q_2"):
            if dice.chance(0.06) and self.kind not in ("reservoirs",):
                self.loading[name] = dice.history(dice.near(3 * dice.units["W/m^2"]))
        if dice.chance(0.04) and self.gap in ("none", "prescribed") and self.slip in ("none", "prescribed"):
            self.loading["J_c"] = dice.history(1.0, positive=True)

    def _needs_open_gap(self) -> bool:
        everything = [*self.potentials, *self.frictions, *self.heat]
        film = "d_m" in self.asked()
        return film or any("g_n" in law.positive for law in everything)

    def _programme(self) -> tuple[Stage, ...]:
        dice = self.dice
        movable = [name for name in ("w_n", "w_t", "F_n", "F_t", "u_t", "g_n", "Q_1") if name in self.loading]
        if not movable or dice.chance(0.7):
            return ()
        moved = [name for name in movable if dice.chance(0.7)] or movable[:1]
        sizes = {"w": dice.length, "u": dice.length, "g": dice.length, "F": dice.traction, "Q": dice.units["W/m^2"]}
        made = []
        for i in range(dice.pick(1, 2, 3, 4)):
            rates = {x: dice.signed(dice.near(10 * sizes[x[0]] / dice.end)) for x in moved if dice.chance(0.8)}
            made.append(Stage(f"stage {i}", rates, **self._end_of_stage(rates)))
        for name in moved:
            del self.loading[name]
        made[0].rates.update({x: made[0].rates.get(x, 0.0) for x in moved})  # each has a rate somewhere
        return (*made, Stage("rest", {}))

    def _end_of_stage(self, rates: dict[str, float]) -> dict:
        dice = self.dice
        if rates and dice.chance(0.3):
            name, rate = dice.pick(*rates.items())
            return {"variable": name, "value": rate * dice.end * dice.random.random(), "rising": rate > 0}
        if self.limits and dice.chance(0.3):
            return {"event": "debond"}
        return {"duration": dice.end * dice.random.uniform(0.02, 0.4)}

    # -- start ----------------------------------------------------------------------------------------------------

    def _some_sites(self) -> Sites:
        N = self.dice.sites
        return Sites(N, N * self.dice.pick(1.0, 1.0, 0.3, 3.0), self.dice.pick(1, 1, 2))

    def _species(self) -> dict:
        found = self.mechanism
        return {} if found is None else {"variables": found.variables, "bonds": found.bonds, "engine": found.engine}

    def _start(self) -> None:
        dice = self.dice
        if self.bonds and (self.reactions or self.limits):
            self.initial["phi"] = self.sites.phi_max * dice.pick(
                0.0, 1e-12, 1e-3, *[dice.random.random()] * 3, 1 - 1e-9, 1.0
            )
        if self.limits and not self.reactions and self.mechanism is None:
            self.initial["phi"] = self.sites.phi_max * dice.random.random()
        opened = self._needs_open_gap()
        if self.gap == "moving" or (self.gap == "dead"):
            g = dice.near(dice.length, 0.5)
            self.initial["g_n"] = g if opened else dice.pick(0.0, g, -g)
        for law in self.frictions:
            for of in law.internal.values():
                self.initial[of] = dice.near(dice.end, 3)


def random_scene(seed: int) -> tuple[Scene, float]:
    """A scene and the length of its run [s]."""
    composer = Composer(seed)
    return composer.scene(), composer.dice.end
