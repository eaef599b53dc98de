"""Time against error for mechanisms of 2 to 300 reactions: compiled, `solver: cantera`, and Cantera by itself.

Mechanisms are random: coverages that turn into one another at a constant temperature, alone and in pairs, with rates
over four decades. `python benchmarks/mechanisms.py` prints a table and writes benchmarks/results/mechanisms.csv; times
are those of the processor, the least of many runs in turn. Errors are against the compiled stepper at a tolerance of
1e-13. What is "bare" keeps no balances, as nothing else but ours does. A run of ours has a longest step; with that a
reactor by itself takes the same steps as `solver: cantera`. What was compiled before is read from the cache; the table
of the documentation is from an empty one.
"""

import csv
import random
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import cantera as ct
import numpy as np

import surfacechem
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.run import Model

SIZES, TOLERANCES, END = (2, 10, 30, 100, 300), (1e-2, 1e-3, 1e-4, 1e-6, 1e-8), 1.0
RESULTS = Path(__file__).parent / "results" / "mechanisms.csv"

MECHANISM = """
units: {{length: m, quantity: mol}}
phases:
- name: surface
  thermo: ideal-surface
  kinetics: surface
  species: [{names}]
  reactions: all
  site-density: 1e-5 mol/m^2
species:
{species}
reactions:
{reactions}
"""
CASE = """
bodies: {{lower: {{temperature: 300 K}}, upper: {{temperature: 300 K}}}}
interface: {{temperature: 300 K, mechanism: {{file: {file}}}}}
initial: {{coverages: {{A0: 1}}}}
run: {{until: 1 s, outputs: 2}}
"""


def mechanism(size: int) -> str:
    """A mechanism of so many reactions, a third as many species."""
    draw, count = random.Random(size), max(2, size // 3)
    names = [f"A{i}" for i in range(count)]
    entries = []
    for i in range(size):
        a, b = names[i % count], names[(i + 1 + draw.randrange(count - 1)) % count]
        rate = 10 ** draw.uniform(-1, 3)
        if i < count or b == a:
            b, pair = names[(i + 1) % count], False
        else:
            pair = draw.random() < 0.5
        equation = f"{a} + {b} => 2 {b}" if pair else f"{a} => {b}"
        scale = 1e5 if pair else 1.0  # m^2/mol, so that rates of full coverages are alike
        entries.append(
            f"- {{equation: {equation}, rate-constant: {{A: {rate * scale:.6e}, b: 0, Ea: 0}}, duplicate: true}}"
        )
    alike = {entry.split("rate-constant")[0] for entry in entries}
    single = {text for text in alike if sum(entry.startswith(text) for entry in entries) == 1}
    entries = [e.replace(", duplicate: true", "") if e.split("rate-constant")[0] in single else e for e in entries]
    species = [f"- {{name: {n}, composition: {{H: 1}}, thermo: {{model: constant-cp}}}}" for n in names]
    return MECHANISM.format(names=", ".join(names), species="\n".join(species), reactions="\n".join(entries))


class Plain(ct.ExtensibleReactor):
    """A surface by itself, as a user of Cantera would write it."""

    def __new__(cls, surface: ct.Interface) -> "Plain":
        return super().__new__(cls, surface, clone=False)

    def __init__(self, surface: ct.Interface) -> None:
        super().__init__(surface, clone=False)
        self.surface, self.start = surface, surface.coverages

    def replace_initialize(self, _: float) -> None:
        self.n_vars = self.surface.n_species

    def replace_get_state(self, y: np.ndarray) -> None:
        y[:] = self.start

    def replace_update_state(self, y: np.ndarray) -> None:
        self.surface.set_unnormalized_coverages(y)

    def replace_update_connected(self, _: bool) -> None:
        pass

    def replace_eval(self, _: float, _lhs: np.ndarray, rhs: np.ndarray) -> None:
        rhs[:] = self.surface.net_production_rates / self.surface.site_density


def surface_of(file: Path) -> ct.Interface:
    """Cantera's surface at its start."""
    surface = ct.Interface(str(file))
    surface.TP = 300.0, None
    surface.coverages = "A0:1"
    return surface


def by_case(simulation: Simulation, solver: str, rtol: float, bare: bool = False) -> Callable[[], np.ndarray]:
    """The end of a run of the case, with its balances or bare."""
    run = replace(simulation.case.run, solver=solver, rtol=rtol, picture=None, looks=0.0)
    model = Model(replace(simulation.model.system, ledger=())) if bare else simulation.model
    return lambda: model.solve(run).result.y


def by_surface(file: Path, rtol: float) -> Callable[[], np.ndarray]:
    """Coverages of `advance_coverages`."""

    def end() -> np.ndarray:
        surface.coverages = "A0:1"
        surface.advance_coverages(END, rtol=rtol, atol=1e-6 * rtol, max_steps=100_000)
        return surface.coverages

    surface = surface_of(file)
    return end


def by_reactor(file: Path, rtol: float, longest: float = 0.0) -> Callable[[], np.ndarray]:
    """Coverages of a reactor in Python, whose steps may be limited [s]."""
    surface = surface_of(file)

    def end() -> np.ndarray:
        surface.coverages = "A0:1"
        net = ct.ReactorNet([Plain(surface)])
        net.rtol, net.atol = rtol, 1e-6 * rtol
        if longest:
            net.max_time_step = longest
        net.advance(END)
        return surface.coverages

    return end


def measured(ways: Mapping[str, Callable[[], np.ndarray]], exact: np.ndarray) -> dict[str, tuple[float, float]]:
    """Least time [s] and error of each way; they run in turn, five times in a row, for five seconds at least."""
    times: dict[str, list[float]] = {way: [] for way in ways}
    errors, start = {}, time.process_time()
    while not errors or time.process_time() - start < 5.0:
        for way, end in [pair for pair in ways.items() for _ in range(5)]:
            before = time.process_time()
            found = end()
            times[way].append(time.process_time() - before)
            errors[way] = float(np.abs(found - exact).max())
    return {way: (min(times[way]), errors[way]) for way in ways}


def main() -> None:
    """Measure all, print a row for each and keep them."""
    rows = []
    for size in SIZES:
        folder = Path(tempfile.mkdtemp())
        file, case = folder / "mechanism.yaml", folder / "case.yaml"
        file.write_text(mechanism(size))
        case.write_text(CASE.format(file=file.name))
        simulation = surfacechem.load(case)
        compiled = simulation.model.compile_seconds
        exact = by_case(simulation, "radau", 1e-13)()
        for rtol in TOLERANCES:
            ways = {
                "compiled": by_case(simulation, "radau", rtol),
                "compiled, bare": by_case(simulation, "radau", rtol, bare=True),
                "solver: cantera": by_case(simulation, "cantera", rtol),
                "advance_coverages": by_surface(file, rtol),
                "ExtensibleReactor": by_reactor(file, rtol),
                "the same steps": by_reactor(file, rtol, END / simulation.case.run.samples),
            }
            for way, (seconds, error) in measured(ways, exact).items():
                rows.append((size, way, rtol, seconds, error, compiled))
                print(f"{size:4d}  {way:18s} {rtol:.0e}  {seconds * 1e3:9.3f} ms  error {error:.1e}")
        print(f"{size:4d}  compiled in {compiled:.2f} s")
    with RESULTS.open("w", newline="") as out:
        writer = csv.writer(out)
        writer.writerow(("reactions", "way", "rtol", "seconds", "error", "compile_seconds"))
        writer.writerows(rows)


if __name__ == "__main__":
    main()
