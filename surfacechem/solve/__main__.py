"""``python -m surfacechem.solve``: compile the stepper ahead of the first run, or for a wheel."""

import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from surfacechem.compile.cache import ship
from surfacechem.solve.radau import stepper


def main() -> None:
    """Compile the stepper if it is not cached; with a folder as argument, compile it into that folder for all
    processors of this platform.
    """
    if len(sys.argv) > 1:
        with TemporaryDirectory() as cache:
            os.environ["SURFACECHEM_CACHE"] = cache
            ship(stepper.sources(), Path(sys.argv[1]), stepper.LOOP.load)
        return
    if stepper.LOOP.is_compiled:
        return
    print("compiling the stepper, once on this machine ...", end=" ", flush=True)
    start = time.perf_counter()
    stepper.LOOP.load()
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
