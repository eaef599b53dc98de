"""Growth of the cost of a scene with its size: reactions, species, cells, events, outputs, length, cases.

    python benchmarks/growth.py [part of a name]

Prints times of the processor, the least of three, and the power of the size with which the last two of them grow, and
keeps them in benchmarks/results/growth.csv, from which the documentation draws its figure.
"""

import csv
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import surfacechem
from mechanisms import CASE, mechanism
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.radau.stepper import LOOP

RESULTS = Path(__file__).parent / "results" / "growth.csv"
REPEATS = 3
CHAIN = """
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


def chain(size: int) -> str:
    """A mechanism of so many species, each of which turns into the next and back."""
    names = [f"A{i}" for i in range(size)]
    return CHAIN.format(
        names=", ".join(names),
        species="\n".join(f"- {{name: {n}, composition: {{H: 1}}, thermo: {{model: constant-cp}}}}" for n in names),
        reactions="\n".join(
            f"- {{equation: {a} <=> {b}, rate-constant: {{A: {1 + i % 7}, b: 0, Ea: 0}}}}"
            for i, (a, b) in enumerate(itertools.pairwise(names))
        ),
    )


def least(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Time of the processor that it takes [s]."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def scene(name: str, *changes: str) -> Callable[[int], Simulation]:
    """A shipped case, changed by its size."""
    return lambda size: surfacechem.load(name, [change.format(size=size, length=3.0 * size) for change in changes])


def of_mechanism(text: Callable[[int], str]) -> Callable[[int], Simulation]:
    """A case whose mechanism has a size."""

    def load(size: int) -> Simulation:
        folder = Path(tempfile.mkdtemp())
        (folder / "surface.yaml").write_text(text(size))
        (folder / "case.yaml").write_text(CASE.format(file="surface.yaml"))
        return surfacechem.load(folder / "case.yaml")

    return load


def costs(load: Callable[[int], Simulation], size: int) -> dict[str, float]:
    """Costs of getting a scene ready, and of its steps alone, once it is."""
    fresh = load(size)
    begun = time.process_time()
    fresh.model  # noqa: B018
    return {"ready": time.process_time() - begun} | steps(fresh)


def steps(simulation: Simulation) -> dict[str, float]:
    """Cost of the steps of a run in compiled code."""
    model, run = simulation.model, simulation.case.run
    model.solve(run)
    return {"steps": least(lambda: model.solve(run))}


def shown(simulation: Simulation) -> dict[str, float]:
    """Costs of the steps, and of a run with its error, its audit and its dataset."""
    return steps(simulation) | {"run and dataset": least(lambda: simulation.run().dataset)}


def stored(size: int) -> dict[str, float]:
    """Costs of so many runs in a store."""
    simulation = surfacechem.load("exothermic", ["sweep.keep={last: [T, phi]}"])
    plan = simulation.plan({"interface.potential.bond-energy.K_0": np.linspace(1.0, 300.0, size)})

    def sweep() -> None:
        with tempfile.TemporaryDirectory() as folder:
            simulation.stream(plan, Path(folder) / "sweep.zarr").run()

    sweep()
    return {"stored": least(sweep)}


GROWTH: dict[str, tuple[tuple[int, ...], Callable[[int], dict[str, float]]]] = {
    "reactions": ((10, 30, 100, 300), lambda size: costs(of_mechanism(mechanism), size)),
    "species": ((10, 30, 100, 300), lambda size: costs(of_mechanism(chain), size)),
    "cells": (
        (20, 60, 200, 600, 2000),
        lambda size: costs(scene("sudden-contact", "bodies.epoxy.conduction.cells={size}"), size),
    ),
    "slips": ((1, 3, 10, 30), lambda size: steps(scene("stick-slip", "run.until={length}")(size))),
    "outputs": ((100, 1000, 10_000, 100_000), lambda size: shown(scene("exothermic", "run.outputs={size}")(size))),
    "length": ((1, 10, 100, 1000), lambda size: steps(scene("exothermic", "run.until={length}")(size))),
    "runs": ((1000, 10_000, 100_000), stored),
}
"""Sizes, and the costs [s] at each."""


def measured(chosen: str) -> Iterator[tuple[str, str, int, float]]:
    """Yield the name of what grows, which cost, the size and the cost [s]."""
    for name, (sizes, cost) in GROWTH.items():
        if chosen in name:
            for size in sizes:
                for what, seconds in cost(size).items():
                    yield name, what, size, seconds


def main() -> None:
    """Measure, print and keep."""
    chosen = sys.argv[1] if len(sys.argv) > 1 else ""
    before = list(csv.reader(RESULTS.open()))[1:] if RESULTS.exists() else []
    rows = [row for row in before if chosen not in row[0]]
    LOOP.load()
    # Scenes are compiled anew, and what is compiled once for all is there.
    os.environ["SURFACECHEM_CACHE"] = tempfile.mkdtemp()
    last: dict[tuple[str, str], tuple[int, float]] = {}
    for name, what, size, seconds in measured(chosen):
        power = ""
        if (name, what) in last:
            size_before, seconds_before = last[name, what]
            power = f"  power {np.log(seconds / seconds_before) / np.log(size / size_before):5.2f}"
        print(f"{name:10} {size:8}  {what:16} {1e3 * seconds:10.3f} ms{power}", flush=True)
        last[name, what] = size, seconds
        rows.append([name, what, str(size), f"{seconds:.6g}"])
    with RESULTS.open("w", newline="") as file:
        csv.writer(file).writerows([["grows", "cost", "size", "seconds"], *rows])


if __name__ == "__main__":
    main()
