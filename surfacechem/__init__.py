"""Contact interfaces that bond, slide, break and heat.

>>> import surfacechem
>>> solution = surfacechem.run("exothermic")
>>> solution.status
'finished'

``load`` reads a case and returns a :class:`~surfacechem.runs.simulation.Simulation`, which compiles once and runs with
any values of its parameters; ``run`` does both, ``sweep`` runs many at once, ``precision`` measures error against run
time, ``steady`` finds where a mechanism comes to rest and what controls that, ``register`` makes a law of one's own
known.
Theory: Sauer, Duong & Mandadapu (2021), doi 10.1177/10812865211032723.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from surfacechem.laws import register
    from surfacechem.runs.simulation import Simulation, load, run, sweep
    from surfacechem.studies.precision import precision
    from surfacechem.studies.steady import steady

__all__ = ["Simulation", "load", "precision", "register", "run", "steady", "sweep"]


def __getattr__(name: str) -> Any:
    if name == "precision":
        from surfacechem.studies import precision

        return precision.precision
    if name == "steady":
        from surfacechem.studies import steady

        return steady.steady
    if name == "register":
        from surfacechem import laws

        return laws.register
    if name in __all__:
        from surfacechem.runs import simulation

        return getattr(simulation, name)
    raise AttributeError(f"module 'surfacechem' has no attribute {name!r}")
