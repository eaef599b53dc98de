"""Cost of the force between two curved surfaces: errors, pairs of points and processor time over accuracy and gap.

    python benchmarks/surfaces.py

prints three tables and keeps them in benchmarks/results/surfaces.csv: a sphere over a plane at gaps of a thousandth of
its radius and more, against the closed form; pairs of other shapes; and the error of each rule of the quadrature. A
fourth, in surface_curves.csv, is what the force over a range of approaches costs, which a case integrates once.
"""

import csv
import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from surfacechem.contracts.terms import Shape
from surfacechem.errors import InputError
from surfacechem.laws.free_energy import EquilibriumBonds
from surfacechem.laws.longrange import InversePower, LennardJonesPair
from surfacechem.surfaces import inner_sums, patches
from surfacechem.surfaces.forces import PairForces, interaction
from surfacechem.surfaces.inner_sums import table
from surfacechem.surfaces.potential import CurvedSurfaces
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Paraboloid, Plane, Sphere, Torus, Wavy

TARGET = Path(__file__).parent / "results" / "surfaces.csv"
LAW = InversePower(n_1=1.0, n_2=1.0, psi_0=1.0, r_0=1.0, m=6)
ROUND = {
    "sphere, plane": (Sphere(R=1.0), Plane()),
    "sphere, sphere": (Sphere(R=1.0), Sphere(R=2.0)),
    "sphere in a cavity": (Cavity(R=3.0), Sphere(R=1.0)),
    "paraboloid, plane": (Paraboloid(R=1.0), Plane()),
    "torus, plane": (Torus(hole=1.0, r=0.5), Plane()),
    "parallel cylinders": (Cylinder(R=1.0, length=2.0), Cylinder(R=2.0)),
}
PLATES = (Plane(length=1.0, width=0.7), Plane(length=0.8, width=1.0, tilt=0.2))
REPEAT = 3


def measured(shapes: Sequence[Shape], d: float, rtol: float) -> tuple[PairForces, float]:
    """The forces at a gap, and the least processor time of a few evaluations [ms]."""
    times = []
    for _ in range(REPEAT):
        table.cache_clear()
        begin = time.process_time()
        found = interaction(Surface(shapes[0]), Surface(shapes[1], True, d), [LAW], rtol)
        times.append(time.process_time() - begin)
    return found, 1e3 * min(times)


def sphere_over_plane(d: float) -> float:
    """Energy for r^-6 and a radius of one."""
    return math.pi**2 / 3 * (d**-3 - (d + 2) ** -3)


def rows() -> Iterator[tuple[str, float, str, float, int, float]]:
    """Pair of shapes, gap, accuracy or rule, error, pairs of points and processor time."""
    for d in (1e-3, 1e-2, 1e-1, 1.0):
        for digits in (2, 4, 6, 8, 10, 12):
            found, cost = measured(ROUND["sphere, plane"], d, 10.0**-digits)
            error = abs(float(found.energy[0]) / sphere_over_plane(d) - 1)
            yield "sphere, plane", d, f"{10.0**-digits:.0e}", error, found.pairs, cost
    for name, shapes in ROUND.items():
        found, cost = measured(shapes, 0.1, 1e-9)
        yield name, 0.1, "1e-09", found.error, found.pairs, cost
    for rtol in (1e-2, 1e-3, 1e-4):
        found, cost = measured(PLATES, 0.6, rtol)
        yield "tilted plates", 0.6, f"{rtol:.0e}", found.error, found.pairs, cost
    yield from rules()


def rules() -> Iterator[tuple[str, float, str, float, int, float]]:
    """The error of each rule of Gauss alone, against the closed form."""
    usual = inner_sums.ORDERS
    for order in usual:
        # A rule that is asked for twice agrees with itself.
        inner_sums.ORDERS = patches.ORDERS = (order,) * len(usual)
        table.cache_clear()
        found, cost = measured(ROUND["sphere, plane"], 0.01, 1e-12)
        error = abs(float(found.energy[0]) / sphere_over_plane(0.01) - 1)
        yield "sphere, plane", 0.01, f"{order} points", error, found.pairs, cost
    inner_sums.ORDERS = patches.ORDERS = usual
    table.cache_clear()


CURVES: dict[str, tuple[tuple[Shape, Shape], str, tuple[float, ...]]] = {
    "sphere, plane": ((Sphere(R=50e-9), Plane()), "pair", (1e-3, 1e-6, 1e-9)),
    "sphere in a cavity": ((Cavity(R=75e-9), Sphere(R=50e-9)), "pair", (1e-3, 1e-6, 1e-9)),
    "sphere, tilted plate": ((Sphere(R=50e-9), Plane(length=2e-7, width=2e-7, tilt=0.09)), "pair", (1e-2, 1e-3, 1e-4)),
    "crossed cylinders": (
        (Cylinder(R=50e-9, length=3e-7), Cylinder(R=50e-9, length=3e-7, turn=math.pi / 2)),
        "pair",
        (1e-1, 1e-2),
    ),
    "waves, plane": ((Wavy(amplitude=2e-9, wavelength=5e-8, length=2e-7, width=2e-7), Plane()), "pair", (1e-2, 1e-3)),
    "sphere, plane: bonds": ((Sphere(R=50e-9), Plane()), "gap", (1e-3, 1e-6, 1e-9)),
}
"""Shapes, what acts between them, and accuracies of the force over approaches from 1 to 20 nm."""


def curves() -> Iterator[tuple[str, str, str, float]]:
    """Shapes, accuracy asked for, the error that is claimed, and processor time [s]."""
    pair = [LennardJonesPair(n_1=5e18, n_2=5e18, psi_0=4e-21, g_0=3e-10)]
    bonds = [EquilibriumBonds(N=1e16, K=50.0, k_b=1e-3, T=300.0)]
    for name, (shapes, acting, accuracies) in CURVES.items():
        laws = {"pairs": pair} if acting == "pair" else {"gap_laws": bonds}
        for accuracy in accuracies:
            both = CurvedSurfaces(shapes=shapes, approach=(1e-9, 2e-8), accuracy=accuracy, **laws)
            parts = [part for law in both.pairs for _, part in both.parts(law)]
            table.cache_clear()
            begin = time.process_time()
            found = both.integrated(parts)  # not what the cache keeps
            yield name, f"{accuracy:.0e}", f"{max(curve.error for curve in found):.1e}", time.process_time() - begin


def main() -> None:
    """Print the tables and keep them."""
    found = []
    print(f"{'shapes':20s} {'gap/R':>6s} {'asked':>9s} {'error':>8s} {'pairs':>9s} {'ms':>8s}")
    try:
        for name, d, asked, error, pairs, cost in rows():
            print(f"{name:20s} {d:6g} {asked:>9s} {error:8.1e} {pairs:9d} {cost:8.1f}", flush=True)
            found.append((name, d, asked, f"{error:.1e}", pairs, f"{cost:.1f}"))
    except InputError as error:
        print(error)
    keep(TARGET, [("shapes", "gap", "asked", "error", "pairs", "ms"), *found])
    whole = [("shapes", "asked", "claimed", "seconds")]
    for name, asked, claimed, cost in curves():
        print(f"{name:22s} {asked:>9s} {claimed:>8s} {cost:8.1f} s", flush=True)
        whole.append((name, asked, claimed, f"{cost:.1f}"))
    keep(TARGET.with_name("surface_curves.csv"), whole)


def keep(path: Path, rows: Sequence[tuple[object, ...]]) -> None:
    """Write a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
