"""``python -m surfacechem.solve``: compile the stepper ahead of the first run."""

import time

from surfacechem.solve.radau import stepper


def main() -> None:
    """Compile what is not compiled yet and keep it."""
    if stepper.LOOP.is_compiled:
        return
    print("compiling the stepper, once on this machine ...", end=" ", flush=True)
    start = time.perf_counter()
    stepper.LOOP.load()
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
