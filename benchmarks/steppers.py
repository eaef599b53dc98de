"""Time against achieved error of every solver, in one interleaved run, and the throughput of a sweep.

    python benchmarks/steppers.py [--quick] [--cases P1,P4] [output folder]

Keeps, in benchmarks/results if no folder is given, the times (steppers.csv), how many times longer than ours each
solver takes to the same error (ratios.csv), the machine and the versions (environment.json) and figures. The ratios
are shown beside those that were kept before, and what has become slower against its peers is listed.

P1 is exothermic bonding with 200 outputs (exact solution), P2 a Bell cluster to its rupture, P3 a stick-slip slider
through 24 events, P4 Robertson's problem to 1e11 s. "scipy-LSODA" and "scikit-sundae-CVODE" are the libraries
called directly with a Python right-hand side, as a user would write it today; those of peers.py are called as one who
knows them would. Times are those of the processor. What ours is, is what `solver: auto` chooses: explicit steps on P1
and P3, implicit ones on P2 and P4.
"""

import argparse
import csv
import itertools
import json
import os
import platform
import statistics
import sys
import time
import timeit
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import matplotlib
import numpy as np
from scipy.integrate import solve_ivp
from sksundae.cvode import CVODE

matplotlib.use("Agg")
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from events import (
    DIRECT,
    rupture_batch,
    rupture_direct,
    rupture_error,
    rupture_ours,
    slide_direct,
    slide_error,
    slide_ours,
)
from matplotlib import pyplot as plt
from peers import installed
from solver_problems import (
    PARAMETERS,
    exothermic,
    exothermic_exact,
    exothermic_problem,
    problem,
    robertson_sums,
    solved_as_arrays,
)

from surfacechem.solve import names, solver
from surfacechem.solve.contract import Problem, Result

REPEATS = 3
OURS = {"P1": "dop853", "P2": "radau", "P3": "dop853", "P4": "radau"}
CASES = tuple(OURS)
ERRORS = (1e-4, 1e-6, 1e-7, 1e-8, 1e-10)
PEER_TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-12)
OTHERS = {"heyoka": "heyoka", "numbalsoda": "numbalsoda", "libroadrunner": "roadrunner", "diffrax": "diffrax"}
REGRESSION = 0.7
"""A ratio below this part of the one that was kept is more than the noise of an interleaved run."""
ROBERTSON_END = np.array([2.083340149701255e-08, 8.333360770334713e-14])
Run = Callable[[], np.ndarray]


@dataclass
class Curve:
    """One solver on one problem: a run for each tolerance and the error of its answer."""

    case: str
    name: str
    rtol: float
    run: Run
    error: Callable[[np.ndarray], float]
    seconds: list[float]
    achieved: float = np.nan


def finished(result: Result) -> Result:
    """The result, its numbers void where the run failed."""
    if not result.status.success:
        result.y[:] = np.nan
        result.outputs[:] = np.nan
    return result


def outputs_of(name: str, case: Problem) -> Run:
    """Outputs of a solver of ours."""
    method, case = solver(name), replace(case, explicit=name == "dop853")
    return lambda: finished(method.solve(case)).outputs


def end_of(name: str, case: Problem) -> Run:
    """End state of a solver of ours."""
    method, case = solver(name), replace(case, explicit=name == "dop853")
    return lambda: finished(method.solve(case)).y


def p1_error(outputs: np.ndarray) -> float:
    """Largest relative error at the outputs."""
    times = np.linspace(0.0, 2.5, 201)[1:]
    return float(np.max(np.abs(outputs / exothermic_exact(times) - 1))) if len(outputs) == 200 else np.nan


def p4_error(y: np.ndarray) -> float:
    """Largest relative error of the two small concentrations at the end."""
    return float(np.max(np.abs(y[:2] / ROBERTSON_END - 1)))


def p1_rates(_t: float, y: np.ndarray) -> list[float]:
    """P1 as an explicit system."""
    c, k, t0, _, tau = PARAMETERS.tolist()
    growth = (1 - y[1]) / tau
    return [k * (1 - y[1]) * growth * t0 / (c * y[0]), growth]


def p4_rates(_t: float, y: np.ndarray) -> list[float]:
    """P4 as an explicit system."""
    a, b, c = y.tolist()
    slow, fast, last = 0.04 * a, 1e4 * b * c, 3e7 * b * b
    return [fast - slow, slow - fast - last, last]


def direct_lsoda(
    rates: Callable, y0: list[float], end: float, times: np.ndarray | None, rtol: float, atol: float
) -> np.ndarray:
    """SciPy as a user calls it."""
    answer = solve_ivp(rates, (0.0, end), y0, method="LSODA", t_eval=times, rtol=rtol, atol=atol).y.T
    return answer if times is not None else answer[-1]


def direct_cvode(
    rates: Callable, y0: list[float], end: float, times: np.ndarray | None, rtol: float, atol: float
) -> np.ndarray:
    """scikit-sundae as a user calls it."""

    def fill(t: float, y: np.ndarray, out: np.ndarray) -> None:
        out[:] = rates(t, y)

    span = np.concatenate(([0.0], times)) if times is not None else np.array([0.0, end])
    answer = CVODE(fill, rtol=rtol, atol=atol, max_num_steps=100_000).solve(span, np.array(y0)).y
    return answer[1:] if times is not None else answer[-1]


def p1_curves(rtol: float) -> list[Curve]:
    """Every solver on P1."""
    times = np.linspace(0.0, 2.5, 201)[1:]
    case = exothermic_problem(rtol)
    curves = [Curve("P1", name, rtol, outputs_of(name, case), p1_error, []) for name in names]
    for name, direct in (("scipy-LSODA", direct_lsoda), ("scikit-sundae-CVODE", direct_cvode)):
        run = lambda d=direct: d(p1_rates, [300.0, 0.0], 2.5, times, rtol, 0.01 * rtol)  # noqa: E731
        curves.append(Curve("P1", name, rtol, run, p1_error, []))
    return curves


def p4_curves(rtol: float) -> list[Curve]:
    """Every solver on P4."""
    case = problem(robertson_sums(), [1.0, 0.0, 0.0], [0.0, 1e11], rtol, atol=rtol * 1e-10)
    curves = [Curve("P4", name, rtol, end_of(name, case), p4_error, []) for name in names]
    for name, direct in (("scipy-LSODA", direct_lsoda), ("scikit-sundae-CVODE", direct_cvode)):
        run = lambda d=direct: d(p4_rates, [1.0, 0.0, 0.0], 1e11, None, rtol, rtol * 1e-10)  # noqa: E731
        curves.append(Curve("P4", name, rtol, run, p4_error, []))
    return curves


def event_curves(rtol: float) -> list[Curve]:
    """Ours and the libraries on P2 and P3."""
    curves = []
    for case, ours, direct, error in (
        ("P2", rupture_ours, rupture_direct, rupture_error()),
        ("P3", slide_ours, slide_direct, slide_error()),
    ):
        curves += [Curve(case, name, rtol, ours(name, rtol), error, []) for name in {"radau": 0, OURS[case]: 0}]
        curves += [Curve(case, name, rtol, direct(run(rtol, 0.01 * rtol)), error, []) for name, run in DIRECT.items()]
    return curves


def calls(once: float) -> int:
    """Repetitions that fill about a millisecond, so that short runs are timed as warm as long ones."""
    return max(1, min(30, int(1e-3 / once)))


def measure(curves: list[Curve]) -> None:
    """Interleaved, so that a busy moment of the machine hits all alike; the first round warms up."""
    for repeat in range(REPEATS + 1):
        for curve in curves:
            start = time.process_time()
            answer = curve.run()
            once = time.process_time() - start
            if repeat:
                number = calls(once)
                curve.seconds.append(timeit.timeit(curve.run, timer=time.process_time, number=number) / number)
                curve.achieved = curve.error(answer)


def sweep(rtol: float, threads: int = 2, runs: int = 10_000) -> tuple[float, float]:
    """Trajectories a second on randomised P1 and the largest relative error at the end."""
    rng = np.random.default_rng(0)
    parameters = PARAMETERS * rng.uniform(0.5, 1.5, (runs, 1, 5))
    y0 = np.stack([parameters[:, 0, 2], np.zeros(runs)], axis=1)
    atol = np.array([300.0, 1.0]) * rtol
    shared = problem(exothermic(), y0[0], [0.0, 2.5], rtol, atol=atol, parameters=PARAMETERS)
    rates = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        ends, *_ = solved_as_arrays(shared, y0, parameters, threads)
        rates.append(runs / (time.perf_counter() - start))
    exact = np.array([exothermic_exact(2.5, p) for p in parameters[:, 0]])
    return max(rates), float(np.max(np.abs(ends[:, 1:3] / exact - 1)))


def sweep_ruptures(rtol: float, threads: int = 2, runs: int = 10_000) -> tuple[float, float, float]:
    """Trajectories a second on randomised P2 to rupture, the median and the largest relative error of its time."""
    rates = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        found = rupture_batch(rtol, runs, threads)
        rates.append(runs / (time.perf_counter() - start))
    error = np.abs(found / rupture_batch(1e-12, runs, threads) - 1)
    return max(rates), float(np.median(error)), float(np.max(error))


def report(curves: list[Curve], folder: Path) -> None:
    """Table in the terminal and as CSV."""
    with (folder / "steppers.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["case", "solver", "rtol", "error", "microseconds"])
        for curve in curves:
            micro = 1e6 * statistics.median(curve.seconds)
            rows.writerow([curve.case, curve.name, curve.rtol, curve.achieved, micro])
            print(
                f"{curve.case}  {curve.name:20s} rtol {curve.rtol:7.0e}  error {curve.achieved:9.1e}  {micro:12.1f} us"
            )


def plot(curves: list[Curve], folder: Path) -> None:
    """Time against achieved error."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 9))
    for axis, case in zip(axes.flat, CASES, strict=True):
        for name in dict.fromkeys(curve.name for curve in curves):
            mine = [
                curve for curve in curves if (curve.case, curve.name) == (case, name) and np.isfinite(curve.achieved)
            ]
            axis.loglog([c.achieved for c in mine], [statistics.median(c.seconds) for c in mine], "o-", label=name)
        axis.set(title=case, xlabel="achieved relative error", ylabel="time [s]")
        axis.invert_xaxis()
    axes[0, 0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "steppers.png", dpi=150)
    figure.savefig(folder / "steppers.svg")


def seconds_at(curves: list[Curve], case: str, name: str, error: float) -> float:
    """Time to reach an error, interpolated in logarithms along the best runs; NaN if it is not reached."""
    mine = [c for c in curves if (c.case, c.name) == (case, name) and c.achieved > 0]
    points = sorted((c.achieved, statistics.median(c.seconds)) for c in mine)
    if not points or points[0][0] > error:
        return np.nan
    errors, seconds = np.log(np.array(points)).T
    fastest = np.minimum.accumulate(seconds)  # what reaches a smaller error in less time reaches this one too
    return float(np.exp(np.interp(np.log(error), errors, fastest)))


Ratios = dict[tuple[str, str, str], tuple[float, float]]


def ratios(curves: list[Curve]) -> Ratios:
    """By case, error and solver: time at equal error and how many times longer than ours, NaN if it is not reached."""
    found = {}
    for case, error in itertools.product(dict.fromkeys(curve.case for curve in curves), ERRORS):
        ours = seconds_at(curves, case, OURS[case], error)
        for name in dict.fromkeys(curve.name for curve in curves if curve.case == case):
            taken = seconds_at(curves, case, name, error)
            found[case, f"{error:.0e}", name] = 1e6 * taken, taken / ours
    return found


def kept(folder: Path) -> Ratios:
    """The ratios of the last run that was kept."""
    file = folder / "ratios.csv"
    if not file.exists():
        return {}
    with file.open(newline="") as lines:
        rows = list(csv.reader(lines))[1:]
    return {(case, error, name): (float(micro), float(ratio)) for case, error, name, micro, ratio in rows}


def keep(found: Ratios, before: Ratios, folder: Path) -> None:
    """Write the ratios; those of cases that were not run stay."""
    with (folder / "ratios.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["case", "error", "solver", "microseconds", "times ours"])
        for (case, error, name), (micro, ratio) in sorted((before | found).items()):
            rows.writerow([case, error, name, f"{micro:.1f}", f"{ratio:.1f}"])


def compare(found: Ratios, before: Ratios) -> list[str]:
    """The table of ratios beside those that were kept; lines on what has become slower against its peers."""
    slower = []
    for key, (micro, ratio) in found.items():
        case, error, name = key
        line = f"{case} to {error}  {name:20s}"
        if np.isnan(ratio):
            print(f"{line} not reached")
            continue
        old = before.get(key, (np.nan, np.nan))[1]
        change = "" if np.isnan(old) else f"   kept {old:8.1f}x, now / kept {ratio / old:5.2f}"
        print(f"{line} {micro:10.1f} us {ratio:8.1f}x{change}")
        if ratio < REGRESSION * old:
            slower.append(f"{line} {old:.1f}x -> {ratio:.1f}x")
    return slower


def environment() -> dict[str, str]:
    """Date, machine and versions with which this ran."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")
    packages = ["surfacechem", "numpy", "scipy", "numba", "llvmlite", "symengine", "scikit-sundae", "cantera"]
    packages += [name for name, module in OTHERS.items() if find_spec(module)]
    return {
        "date": time.strftime("%Y-%m-%d"),
        "processor": f"{cpu or platform.processor()}, {os.cpu_count()} cores",
        "load of the machine before": f"{os.getloadavg()[0]:.1f}",
        "system": platform.platform(),
        "python": platform.python_version(),
        **{name: version(name) for name in packages},
    }


def peer_curves(cases: list[str]) -> list[Curve]:
    """The libraries as one who knows them would call them."""
    errors = {"P1": p1_error, "P2": rupture_error(), "P3": slide_error(), "P4": p4_error}
    return [
        Curve(case, name, rtol, make(case, rtol), errors[case], [])
        for name, (make, fits) in installed().items()
        for case in fits
        if case in cases
        for rtol in PEER_TOLERANCES
    ]


def all_curves(cases: list[str]) -> list[Curve]:
    """Every solver at every tolerance on the chosen cases."""
    curves = peer_curves(cases)
    if "P1" in cases:
        curves += [c for rtol in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-10, 1e-11, 1e-12) for c in p1_curves(rtol)]
    if "P4" in cases:
        curves += [c for rtol in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12) for c in p4_curves(rtol)]
    if {"P2", "P3"} & set(cases):
        both = [c for rtol in (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-11, 1e-12) for c in event_curves(rtol)]
        curves += [c for c in both if c.case in cases]
    return curves


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="no sweeps")
    parser.add_argument("--cases", default=",".join(CASES), help="some of the problems, with commas between")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent / "results")
    choice = parser.parse_args()
    folder, cases = choice.folder, choice.cases.split(",")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "environment.json").write_text(json.dumps(environment(), indent=2) + "\n")
    curves = all_curves(cases)
    measure(curves)
    report(curves, folder)
    plot(curves, folder)
    found, before = ratios(curves), kept(folder)
    slower = compare(found, before)
    keep(found, before, folder)
    if not choice.quick:
        sweeps()
    print("\n".join(["against the ratios that were kept, slower:", *slower] if slower else ["nothing is slower"]))


def sweeps() -> None:
    """Throughput of the batch loop."""
    for rtol in (1e-3, 1e-4, 1e-5, 1e-6):
        rate, error = sweep(rtol)
        print(f"sweep of P1, 2 threads, rtol {rtol:7.0e}: {rate:9.0f} trajectories/s, largest error {error:.1e}")
    for rtol in (1e-3, 1e-4, 1e-6):
        rate, median, error = sweep_ruptures(rtol)
        print(
            f"sweep of P2, 2 threads, rtol {rtol:7.0e}: {rate:9.0f} trajectories/s, "
            f"error of the time of rupture {median:.1e} in the median, {error:.1e} at most"
        )


if __name__ == "__main__":
    main()
