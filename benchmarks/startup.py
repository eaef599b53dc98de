"""Processor time of each part of a command-line run, in a fresh process each time.

    python benchmarks/startup.py [case] [repetitions]

Processor time is little moved by what else the machine does; the least of the repetitions is printed, with the modules
that each part imports.
"""

import json
import subprocess
import sys

PARTS = """
import json, sys, tempfile, time
known, last, rows = set(sys.modules), time.process_time(), []
def done(part):
    global known, last
    now = time.process_time()
    new = [name.partition(".")[0] for name in set(sys.modules) - known]
    rows.append((part, 1e3 * (now - last), {name: new.count(name) for name in new}))
    known, last = set(sys.modules), time.process_time()
rows.append(("the interpreter", 1e3 * last, {}))
import numpy, symengine; done("import numpy, symengine")
import surfacechem.cli.main; done("import the command line (typer)")
import ruamel.yaml; done("import ruamel.yaml")
import surfacechem.contracts.units, pint; done("import pint")
import surfacechem.runs.simulation; done("import the package")
simulation = surfacechem.runs.simulation.load(sys.argv[1]); done("read and check the case")
simulation.system; done("assemble the equations")
simulation.model; done("compile the equations")
from surfacechem.solve.radau import stepper; stepper.LOOP.load(); done("load the stepper")
solution = simulation.run(); done("solve, and again for the error")
with tempfile.TemporaryDirectory() as folder:
    solution.write(folder + "/run.nc"); done("write the dataset (netCDF4)")
print(json.dumps(rows))
"""


def measured(case: str) -> list[tuple[str, float, dict[str, int]]]:
    """Parts of one run in a process of its own: name, milliseconds, modules imported by package."""
    command = [sys.executable, "-c", PARTS, case]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Print the table."""
    case = sys.argv[1] if len(sys.argv) > 1 else "exothermic"
    runs = [measured(case) for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 5)]
    total = 0.0
    for rows in zip(*runs, strict=True):
        part, least, modules = min(rows, key=lambda row: row[1])
        total += least
        most = sorted(modules.items(), key=lambda item: -item[1])[:4]
        print(f"{part:34s} {least:7.1f} ms  {', '.join(f'{name} {count}' for name, count in most)}")
    print(f"{'all':34s} {total:7.1f} ms")


if __name__ == "__main__":
    main()
