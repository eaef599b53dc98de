"""Random laws with parameters over many decades, about the scales of one scene; a new law is drawn by itself."""

import random
from typing import Any

from surfacechem import laws as registry
from surfacechem.contracts.terms import Factor, Law, Load, Varying, reads
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.quantities import BOLTZMANN

T_0 = 300.0
FORCE = 1e-11
"""Force on a bond [N] that matters."""

LEFT_OUT = 0.5
"""How often a parameter keeps its default."""

VARIES = 0.12
"""How often a parameter depends on a variable."""

DRAWN_EARLY = ["bond-energy", "linear-enthalpy", "lattice-gas", "partner-mixing", "bond-springs", "equilibrium-bonds"]
DRAWN_LATE = [
    *("film-shear", "rate-and-state-aging", "rate-and-state-slip", "anisotropic-coulomb", "anisotropic-viscous"),
    *("gap-conductance", "gas-gap", "gap-table", "film", "rarefied-film"),
]
"""Laws that are drawn first and last of their contract, so that a seed keeps its scene wherever a law stands."""


def laws(contract: Any) -> dict[str, Any]:
    """All laws of a contract by name, in the order in which they are drawn."""
    places = {name: i + 1 for i, name in enumerate(DRAWN_LATE)}
    places |= {name: i - len(DRAWN_EARLY) for i, name in enumerate(DRAWN_EARLY)}
    return dict(sorted(registry.laws(contract).items(), key=lambda item: places.get(item[0], 0)))


class Dice:
    """Draws of one scene; its lengths, stiffnesses and times have common scales, from which parameters stray."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.end = self.decades(-3, 3)
        self.length = self.decades(-9, -5)
        self.stiffness = self.decades(8, 15)
        self.traction = self.stiffness * self.length
        self.energy = self.traction * self.length
        self.sites = self.near(self.traction / FORCE, 2)
        self.capacity = max(1e-3, self.energy * self.decades(-3, 3))
        self.units = self._units()

    def _units(self) -> dict[str, float]:
        """What a parameter is about, by its unit."""
        L, end, E, N = self.length, self.end, self.energy, self.sites
        bond = BOLTZMANN * T_0
        return {
            "Pa/m": self.stiffness,
            "Pa": self.traction,
            "m": L,
            "J/m^2": E,
            "m/s": L / end,
            "1/s": 1 / end,
            "s": end,
            "J/(m^2 K)": self.capacity,
            "W/(m^2 K)": self.capacity / end,
            "J": 5 * bond,
            "W/(m K)": self.capacity / end * L,
            "N/m": 2 * bond / L**2,
            "J/mol": 2e4,
            "1/(J s)": N / (end * E),
            "1/(J s m^2)": N**2 / (end * E),
            "J s/m^2": end * E,
            "Pa s": self.traction * end,
            "Pa s/m": self.stiffness * end,
            "1/m^2": N,
            "m^2": L**2,
            "m^2/s": 1 / (N * end),
            "K": 100.0,
            "1/m": 1 / L,
            "C/m^2": (1.8e-11 * self.traction) ** 0.5,
            "F/m": 9e-12,
            "W/m^2": self.capacity / end,
        }

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

    # -- laws -----------------------------------------------------------------------------------------------------

    def own(self, law: type[Law], name: str) -> float | None:
        """Parameters whose size their unit does not tell."""
        family = law.__module__.rsplit(".", 1)[-1]
        if name.startswith("x_"):
            return self.signed(self.decades(-11, -8.7)) if name in ("x_off", "x_on") else self.decades(-11, -8.7)
        if name in ("n_1", "n_2", "psi_0"):
            return self.near((self.stiffness / (6 * 2e-20)) ** 0.5 if name != "psi_0" else 2e-20, 0.7)
        if name == "A_H":
            return self.near(20 * self.stiffness * self.length**4, 2)
        if name == "R":
            return self.near(30 * self.length, 1.5)
        if family == "rate_and_state" and name in ("a", "b"):
            return self.decades(-2.5, -1.3)
        if name == "nu":
            return self.pick(0.5, 2 / 3, 1.0)
        return None

    def value(self, law: type[Law], name: str, spec) -> float:
        own = self.own(law, name)
        if own is not None:
            return min(max(own, spec.at_least), spec.at_most) if own > spec.above else abs(own)
        if spec.unit == "1":
            low = max(0.03, spec.above, spec.at_least)
            return self.random.uniform(low, min(1.2, spec.at_most))
        value = self.near(self.units[spec.unit], 2 if self.chance(0.3) else 0.7)
        return self.signed(value) if spec.above < 0 and spec.at_least < 0 and self.chance(0.3) else value

    def law(self, law: type[Law], varies: tuple[str, ...] = (), **options) -> Law:
        """A law with random parameters; some of them depend on one of the variables that may vary."""
        values = {}
        for name, spec in law.specs():
            has_default = law.__dataclass_fields__[name].default.__class__.__name__ != "_MISSING_TYPE"
            if has_default and self.chance(LEFT_OUT):
                continue
            values[name] = self.value(law, name, spec)
            if spec.varies and varies and self.chance(VARIES):
                values[name] = Varying(values[name], (self.factor(self.pick(*varies)),))
        return law(**values, **{**self.options(law), **options})

    def options(self, law: type[Law]) -> dict:
        """Structural fields: tables are curves that rise or fall, the rest comes from the law or the caller."""
        found = {}
        for name, _ in law.options():
            if name in ("pressures", "gaps"):
                size = self.traction if name == "pressures" else self.length
                found[name] = [size * x for x in sorted(self.decades(-2, 2) for _ in range(4))]
            elif name == "conductances":
                found[name] = [self.near(self.units["W/(m^2 K)"], 2) for _ in range(4)]
            elif name == "extrapolation":
                found[name] = self.pick("hold", "hold", "linear", "refuse")
            elif name == "release":
                found[name] = self.pick("joint", "local")
            elif name == "violation":
                found[name] = self.pick("refuse", "warn", "accept")
        return found

    def factor(self, of: str) -> Factor:
        """How a parameter depends on a variable; those of temperature are drawn from all that there are."""
        known = laws(Factor)
        if of == "T_c":
            law = known[self.pick(*(name for name, f in known.items() if "T_0" in reads(f.factor)))]
            sizes = {"1/K": self.signed(self.decades(-5, -2)), "1": self.random.uniform(-1, 1), "J/mol": 2e4}
            values = {name: sizes[spec.unit] for name, spec in law.specs()}
            return law(of=of, **(values if law.name() != "polynomial" else {"c_0": 0.7, "c_1": 0.2, "c_2": 0.1}))
        if of == "sticking":
            return known["linear"](of=of, about=1.0, slope=1.0)
        if of == "phi" and self.chance(0.5):
            return known["proportional"](of=of, about=1.0)
        return known["linear"](of=of, slope=self.random.uniform(-0.5, 2), about=self.pick(0.0, 1.0))

    # -- histories ------------------------------------------------------------------------------------------------

    def history(self, size: float, *, positive: bool = False) -> Load:
        """A load about a size over the run."""
        end = self.end
        sign = 1 if positive else self.pick(-1, 1)
        low = 0.05 * size if positive else -size
        times = sorted(self.random.uniform(0, end) for _ in range(5))
        pulse, brief = times[0], end * self.pick(1e-2, 1e-9)
        rest = 0.3 * size if positive else 0.0
        return self.pick(
            Hold(level=sign * size),
            Ramp(start=rest, rate=sign * size / end),
            Harmonic(
                mean=size if positive else self.pick(0.0, size),
                amplitude=0.9 * size,
                frequency=self.near(3 / end, 1.3),
                phase=self.random.uniform(0, 6.3),
            ),
            Table(times=[0.0, *times], values=[self.random.uniform(low, size) for _ in range(6)]),
            Table(times=[0.0, pulse, pulse + brief, pulse + 2 * brief], values=[rest, rest, sign * size, rest]),
        )
