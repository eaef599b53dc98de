"""Achieved against requested accuracy over all exact solutions: the worst of every decade, and what it cost.

python benchmarks/accuracy.py [output folder]

Every error is kept in accuracy.csv, in benchmarks/results if no folder is given. Those that have grown beside the ones
kept there before are listed.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from asked import ACCURACIES, EXACT, exact

WORST = 3
KEPT = Path(__file__).parent / "results" / "accuracy.csv"
GROWN, FELT = 2, 0.1
"""An error has grown if it is so many times the one before, and at least this part of the accuracy asked for."""


def grown(now: list[tuple[str, str, float, float, float]]) -> Iterator[str]:
    """A line for each error that has grown, and for each exact solution that is no longer compared."""
    with KEPT.open(newline="") as file:
        before = {(row["exact solution"], row["asked"]): float(row["error"]) for row in csv.DictReader(file)}
    for name, asked, error, _, _ in now:
        was = before.pop((name, asked), error)
        if error > GROWN * was and error > FELT * float(asked):
            yield f"grown: {name} at {asked} from {was:.1e} to {error:.1e}\n"
    yield from (f"missing: {name} at {asked}\n" for name, asked in before)


def main() -> None:
    """A line for the worst of each accuracy; the ratio is to what was asked, or to what rounding of times leaves."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else KEPT.parent
    folder.mkdir(parents=True, exist_ok=True)
    kept = []
    print(f"{len(EXACT)} exact solutions\n{'asked':>8} {'ratio':>8} {'error':>9} {'rounding':>9}  run")
    for accuracy in ACCURACIES:
        found = {name: EXACT[name](accuracy) for name in exact(accuracy)}
        kept += [(name, f"{accuracy:.0e}", run.error, run.rounding, run.rtol) for name, run in found.items()]
        worst = sorted(found, key=lambda name: found[name].ratio(accuracy), reverse=True)[:WORST]
        for name in worst:
            run = found[name]
            print(
                f"{accuracy:8.0e} {run.ratio(accuracy):8.2g} {run.error:9.1e} {run.rounding:9.1e}  {name}: {run.source}"
            )
        within = sum(run.ratio(accuracy) <= 1 for run in found.values())
        tighter = sum(run.rtol < accuracy / 1000 and run.rtol > 1e-13 for run in found.values())
        print(f"{'':8} {within} of {len(found)} within once, {tighter} run again at a tighter tolerance")
    print("".join(grown(kept)) or "no error has grown beside those kept before")
    with (folder / "accuracy.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["exact solution", "asked", "error", "error by rounding of the times", "rtol"])
        rows.writerows(kept)


if __name__ == "__main__":
    main()
