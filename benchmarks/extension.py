"""Cost of a rate of bonds under load in Cantera: one of `surfacechem.extension` beside one written by hand.

    python benchmarks/extension.py

prints and keeps in benchmarks/results/extension.csv the processor time of all net rates of progress at a new
temperature and load, for surfaces with so many Bell rates, and the same for Arrhenius rates, which are Cantera's own.
"""

import csv
import math
import time
from pathlib import Path
from typing import Any

import cantera as ct

from surfacechem.extension import LoadedInterface
from surfacechem.quantities import BOLTZMANN

TARGET = Path(__file__).parent / "results" / "extension.csv"
SIZES, REPEATS, CALLS = (1, 2, 10, 50), 15, 1000
SURFACE = """
phases:
- name: surface
  thermo: ideal-surface
  kinetics: surface
  species: [A, {names}]
  reactions: all
  site-density: 1e-9 mol/cm^2
species:
{species}
reactions:
{reactions}
"""
KINDS = {
    "of the extension": ", type: Bell, x-beta: 0.1 nm",
    "by hand": ", type: by-hand, x-beta: 0.1 nm",
    "Arrhenius": "",
}


class Given(ct.ExtensibleRateData):
    """Temperature and load."""

    def update(self, surface: Any) -> bool:
        """Take them over."""
        self.T, self.f = surface.T, surface.f
        return True


@ct.extension(name="interface-by-hand", data=Given)
class ByHand(ct.ExtensibleRate):
    """Bell's rate, as a user of Cantera would write it."""

    def set_parameters(self, node: Any, units: Any) -> None:
        """Read the entry of a reaction."""
        constant = node["rate-constant"]
        self.A, self.b = constant.convert_rate_coeff("A", units), constant["b"]
        self.Ea, self.x = constant.convert_activation_energy("Ea", "K"), node.convert("x-beta", "m")

    def eval(self, data: Given) -> float:
        """Rate coefficient."""
        return self.A * data.T**self.b * math.exp(-self.Ea / data.T + data.f * self.x / (BOLTZMANN * data.T))


def surface(size: int, kind: str) -> LoadedInterface:
    """A surface with so many bonds that break at such a rate."""
    names = [f"B{i}" for i in range(size)]
    entry = "- {{equation: {} => A, rate-constant: {{A: 1e3, b: 0.5, Ea: 10 kJ/mol}}{}}}"
    species = (f"- {{name: {name}, composition: {{H: 1}}, thermo: {{model: constant-cp}}}}" for name in ("A", *names))
    reactions = (entry.format(name, kind) for name in names)
    text = SURFACE.format(names=", ".join(names), species="\n".join(species), reactions="\n".join(reactions))
    return LoadedInterface(yaml=text)


def microseconds(found: LoadedInterface) -> float:
    """Time of the net rates of progress at a new state."""
    begun = time.process_time()
    for i in range(CALLS):
        found.TP, found.f = (300.0 + 1e-6 * i, None), 1e-12
        found.net_rates_of_progress  # noqa: B018
    return 1e6 * (time.process_time() - begun) / CALLS


def main() -> None:
    """Measure all kinds in turn, print a row for each size and keep them."""
    rows = []
    for size in SIZES:
        surfaces = [surface(size, kind) for kind in KINDS.values()]
        measured = [[microseconds(each) for each in surfaces] for _ in range(REPEATS)]
        ours, own, plain = (min(found) for found in zip(*measured, strict=True))
        per_rate = (ours - plain) / (own - plain)
        rows.append((size, *(f"{value:.2f}" for value in (ours, own, plain, ours / own, per_rate))))
        print(
            f"{size:4d} rates: {ours:6.2f} us, by hand {own:6.2f}, Arrhenius {plain:5.2f}; {ours / own:.2f} times,"
            f" {per_rate:.2f} beyond Arrhenius"
        )
    with TARGET.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("rates", *(f"{kind} [us]" for kind in KINDS), "ratio", "ratio beyond Arrhenius"))
        writer.writerows(rows)


if __name__ == "__main__":
    main()
