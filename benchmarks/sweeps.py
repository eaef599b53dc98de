"""Sweeps into a store: time of all and of the stepper alone, memory, and the same work by other libraries.

Times are seconds of processors, so that what else a machine does counts as little as can be; each figure is that of a
process of its own. ``python benchmarks/sweeps.py [RUNS]``; peers that are not installed are left out. What is "whole"
keeps ends, extremes and events of all quantities, as sweeps do by default; what is "bare" keeps no balances; what is
"loose" has a tolerance of 1e-5, and takes linearly implicit steps if it is stiff; "alone" means `solver: radau`, by
which the stiff runs of `dna-adhesive` are solved one at a time. The time "s" is that of a clock, on all processors.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

K_0 = "interface.potential.bond-energy.K_0"
ENDS = {"last": ["T", "phi"]}
WHOLE = dict.fromkeys(("last", "max", "min", "events"), "all")
SWEPT = {
    "exothermic": (K_0, 1.0, 300.0, ENDS),
    "exothermic, whole": (K_0, 1.0, 300.0, WHOLE),
    "force-spectroscopy, whole": ("interface.bonding.bell.x_off", 3e-10, 5e-10, WHOLE),
    "exothermic, bare": (K_0, 1.0, 300.0, {**ENDS, "balances": "none"}),
    "exothermic, bare and loose": (K_0, 1.0, 300.0, {**ENDS, "balances": "none"}),
    "shared-load-rupture": ("loading.t_n", 600.0, 1000.0, {"last": ["phi"]}),
    "dna-adhesive": ("heat.conductance.h", 1900.0, 2300.0, {"last": ["T_c", "theta_bond_s"]}),
    "dna-adhesive, bare and loose": (
        *("heat.conductance.h", 1900.0, 2300.0),
        {"last": ["T_c", "theta_bond_s"], "balances": "none"},
    ),
    "dna-adhesive, alone": ("heat.conductance.h", 1900.0, 2300.0, {"last": ["T_c", "theta_bond_s"]}),
    "stick-slip": ("interface.friction.coulomb.mu_s", 0.5, 0.7, {"last": ["u_t"], "events": "all"}),
    "debonding": ("interface.limits.tensile-strength.t_max", 2e7, 1e9, {"last": ["T"], "events": "all"}),
}


def stored(case: str, runs: int) -> dict[str, float]:
    """A sweep into a store, and the same columns without one."""
    import resource

    import numpy as np
    import xarray  # noqa: F401 - how long it takes to import is not that of opening a store

    import surfacechem
    from surfacechem.runs.checking import check
    from surfacechem.solve.radau import stepper

    path, low, high, keep = SWEPT[case]
    section = {"over": {path: {"from": low, "to": high, "points": runs}}, "keep": keep}
    changes = {"sweep": section, **({"run.solver": "radau"} if "alone" in case else {})}
    changes |= {"run.rtol": 1e-5} if "loose" in case else {}
    simulation = surfacechem.load(case.partition(",")[0], changes)
    inside = [0.0]

    def timed(run):
        def running(*given: object) -> None:
            begun = time.thread_time()
            run(*given)
            inside[0] += time.thread_time() - begun

        return running

    stepper.Loop.run = timed(stepper.Loop.run)
    with TemporaryDirectory() as folder:
        stream = simulation.stream(simulation.plan(), Path(folder) / "o.zarr")
        stream.chunks.columns(np.arange(2))  # what is compiled when it is first needed
        inside[0], wall, processors = 0.0, time.perf_counter(), time.process_time()
        store = stream.run()
        found = {"wall": time.perf_counter() - wall, "all": time.process_time() - processors, "stepper": inside[0]}
        found["MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        begun = time.process_time()
        checked = check(stream)
        begun = time.process_time() - begun
        opened = time.perf_counter()
        store.dataset  # noqa: B018
        found |= {"check": begun, "error": checked.error, "open": time.perf_counter() - opened}
    return found


def peer(name: str, runs: int) -> dict[str, float]:
    """End values of exothermic bonding by another library, as its documentation says many runs are made."""
    import numpy as np

    import surfacechem

    case = surfacechem.load("exothermic")
    values = np.linspace(1.0, 300.0, runs)
    some = case.run({K_0: float(values[runs // 2])}).dataset
    end, exact = float(some["time"][-1]), np.array([some["phi"].values[-1], some["T"].values[-1]])
    run = PEERS[name](end)
    run(values[:8])  # what is set up once for all does not count
    begun = time.process_time()
    ends = run(values)
    return {
        "all": time.process_time() - begun,
        "error": float(np.max(np.abs(ends[runs // 2] / exact - 1))),
    }


RATE = 6.6666666666666667e15 / 1e18
"""Bonding coefficient over the density of sites; both bodies together take up 2 J/(m^2 K) times T / T_0."""


def _heyoka(end):
    import heyoka
    import numpy as np

    phi, T = heyoka.make_vars("phi", "T")
    rate = RATE * heyoka.par[0] * (1 - phi)
    heat = heyoka.par[0] * (1 - phi) * rate * 300.0 / (2.0 * T)
    width = heyoka.recommended_simd_size()
    solver = heyoka.taylor_adaptive_batch([(phi, rate), (T, heat)], np.zeros((2, width)), tol=1e-11)

    def run(values):
        found = np.empty((len(values), 2))
        for first in range(0, len(values), width):
            some = np.resize(values[first : first + width], width)
            solver.set_time(0.0)
            solver.state[:] = [np.zeros(width), np.full(width, 300.0)]
            solver.pars[:] = some
            solver.propagate_until(end)
            found[first : first + width] = solver.state.T[: len(found) - first]
        return found

    return run


SBML = """<sbml xmlns="http://www.sbml.org/sbml/level3/version1/core" level="3" version="1"><model>
<listOfParameters><parameter id="phi" value="0" constant="false"/><parameter id="T" value="300" constant="false"/>
<parameter id="K" value="300" constant="true"/><parameter id="r" value="{rate!r}" constant="true"/></listOfParameters>
<listOfRules><rateRule variable="phi"><math xmlns="http://www.w3.org/1998/Math/MathML"><apply><times/><ci>r</ci>
<ci>K</ci><apply><minus/><cn>1</cn><ci>phi</ci></apply></apply></math></rateRule><rateRule variable="T">
<math xmlns="http://www.w3.org/1998/Math/MathML"><apply><divide/><apply><times/><cn>150</cn><ci>r</ci><ci>K</ci><ci>K</ci>
<apply><minus/><cn>1</cn><ci>phi</ci></apply><apply><minus/><cn>1</cn><ci>phi</ci></apply></apply><ci>T</ci></apply>
</math></rateRule></listOfRules></model></sbml>"""


def _roadrunner(end):
    import numpy as np
    import roadrunner

    model = roadrunner.RoadRunner(SBML.format(rate=RATE))
    model.integrator.relative_tolerance, model.integrator.absolute_tolerance = 1e-12, 1e-14

    def run(values):
        found = np.empty((len(values), 2))
        for i, value in enumerate(values):
            model.reset()
            model["K"] = value
            model.simulate(0, end, 2)
            found[i] = model["phi"], model["T"]
        return found

    return run


def _sundae(end):
    import numpy as np
    from numba import njit
    from sksundae.cvode import CVODE

    @njit
    def rates(_t, y, yp, K):
        yp[0] = RATE * K[0] * (1 - y[0])
        yp[1] = 150.0 * K[0] * (1 - y[0]) * yp[0] / y[1]

    @njit
    def jacobian(_t, y, _yp, J, K):
        J[0, 0], J[0, 1] = -RATE * K[0], 0.0
        heat = 150.0 * RATE * K[0] * K[0] * (1 - y[0]) / y[1]
        J[1, 0], J[1, 1] = -2.0 * heat, -heat * (1 - y[0]) / y[1]

    K, start, times = np.zeros(1), np.array([0.0, 300.0]), np.array([0.0, end])
    solver = CVODE(rates, jacfn=jacobian, userdata=K, rtol=1e-12, atol=1e-14)

    def run(values):
        found = np.empty((len(values), 2))
        for i, value in enumerate(values):
            K[0] = value
            found[i] = solver.solve(times, start).y[-1]
        return found

    return run


def _numbalsoda(method, rtol):
    def of_end(end):
        import numba
        import numbalsoda
        import numpy as np

        solve, start, times = getattr(numbalsoda, method), np.array([0.0, 300.0]), np.array([0.0, end])

        @numba.cfunc(numbalsoda.lsoda_sig)
        def rates(_t, y, yp, K):
            yp[0] = RATE * K[0] * (1 - y[0])
            yp[1] = 150.0 * K[0] * (1 - y[0]) * yp[0] / y[1]

        @numba.njit
        def every(address, values):
            found, K = np.empty((len(values), 2)), np.empty(1)
            for i in range(len(values)):
                K[0] = values[i]
                found[i] = solve(address, start, times, K, rtol, 1e-14)[0][-1]
            return found

        return lambda values: every(rates.address, values)

    return of_end


PEERS = {
    "heyoka": _heyoka,
    "numbalsoda dop853": _numbalsoda("dop853", 1e-11),
    "numbalsoda LSODA": _numbalsoda("lsoda", 1e-12),
    "libroadrunner": _roadrunner,
    "scikit-sundae": _sundae,
}


def measured(*what: str) -> dict[str, float] | None:
    """A figure from a process of its own; None where its library is missing."""
    done = subprocess.run([sys.executable, __file__, "--one", *what], capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"{what[0]:28} {done.stderr.strip().splitlines()[-1]}")
        return None
    return json.loads(done.stdout.splitlines()[-1])


def main(runs: int) -> None:
    """Print a row for each case and each peer."""
    print(
        f"{'case':28} {'runs':>8} {'us/run':>8} {'stepper':>8} {'s':>7} {'MB':>6} {'check s':>8} {'open s':>7}  error"
    )
    for case, count in (
        ("exothermic", runs // 10),
        ("exothermic", runs),
        ("exothermic, whole", runs // 20),
        ("force-spectroscopy, whole", runs // 20),
        ("exothermic, bare", runs),
        ("exothermic, bare and loose", runs),
        ("shared-load-rupture", runs // 10),
        ("dna-adhesive", runs // 100),
        ("dna-adhesive, bare and loose", runs // 100),
        ("dna-adhesive, alone", runs // 100),
        ("stick-slip", runs // 100),
        ("debonding", runs // 100),
    ):
        if found := measured(case, str(count)):
            each, alone = (found[name] / count * 1e6 for name in ("all", "stepper"))
            print(
                f"{case:28} {count:8} {each:8.1f} {alone:8.1f} {found['wall']:7.1f} {found['MB']:6.0f}"
                f" {found['check']:8.1f} {found['open']:7.2f}  {found['error']:.0e}"
            )
    for name in PEERS:
        count = max(1000, runs // 100)
        if found := measured(name, str(count)):
            print(f"{name:28} {count:8} {found['all'] / count * 1e6:8.1f} {'':32}  error {found['error']:.0e}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        name, count = sys.argv[2], int(sys.argv[3])
        print(json.dumps(stored(name, count) if name in SWEPT else peer(name, count)))
    else:
        main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000)
