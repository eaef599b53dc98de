"""What every formula of every law gives at fixed points of usual size, for the approved table of these values.

    python tests/law_values.py

writes the table anew. A difference to the one before is a change of a formula, to be held against its source.
"""

import inspect
import json
import math
import random
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import partial
from pathlib import Path
from typing import Any

from surfacechem.contracts.terms import Law, Load
from surfacechem.laws import FAMILIES, laws
from surfacechem.quantities import VARIABLES

TABLE = Path(__file__).with_suffix(".json")
POINTS = 8
FAR = 6
"""Points at which what may have either sign is a thousand times as large or as small, or of usual size."""
CONTRACTS = tuple(FAMILIES)
USUAL = {
    "K": 300.0, "m": 1e-9, "N": 1e-11, "J": 1e-20, "J/mol": 2e4, "1/m^2": 1e18, "N/m": 1e-3, "Pa": 1e5, "m/s": 1e-3,
    "1/K": 1e-3, "Pa s": 0.1, "W/(m K)": 0.1, "J/(mol K)": 8.0, "J/m^2": 0.1, "m^2": 1e-12, "Pa/m": 1e14,
}  # fmt: skip
"""Size of the numbers that are drawn, by unit; others are about one."""
MORE_UNITS = {"r": "m", "mu": "J", "N_c": "1/m^2"}
MORE_UNITS |= dict.fromkeys(("T_0", "T", "T_from", "T_to", "T_1", "T_2", "x"), "K")
SIGNED = {"v", "v_2", "v_n", "v_t", "g_n", "g_t", "u_t", "f", "mu", "t_n", "dmu_dphi", "direction", "direction_2"}
AT = {"times": 1.0, "pressures": 1e5, "gaps": 1e-9}
LISTS = {name: (0.0, 0.8 * size, 1.6 * size) for name, size in AT.items()}
LISTS |= dict.fromkeys(("values", "conductances"), (1.0, 2.5, 0.5))
NAMES = {"between": ("lower", "upper"), "closure": "direct", "of": "T_c", "extrapolation": "hold"}
OPTIONS = LISTS | NAMES | {"release": "joint", "violation": "warn", "breaks": ""}
OPTIONS |= {"shear": "parallel", "pressure": "net", "distances": (1e-10, 3e-10, 1e-9), "energies": (4e-21, 1e-21, 0.0)}
GRID = {"x": range(6), "y": range(6), "z": [0.0] * 36}
NUMERIC = ("foot", "starts", "derivatives", "parts")
"""Methods that take arrays of points, or give laws."""


def every() -> dict[str, type[Law]]:
    """All laws that are formulas, by contract and name."""
    found = {f"{contract.contract} {name}": law for contract in FAMILIES for name, law in laws(contract).items()}
    return {name: law for name, law in found.items() if name != "shape heights"}


def instance(law: type[Law], draw: random.Random, far: bool = False) -> Law:
    """A law with parameters of usual size, or at their largest where they have one."""
    values = {}
    for name, spec in law.specs():
        ends = max(spec.above, spec.at_least, 0.0), min(spec.at_most, math.inf)
        usual = USUAL.get(spec.unit, 1.0) * draw.uniform(0.3, 0.9)
        inside = usual if ends[0] <= usual <= ends[1] else ends[0] + draw.uniform(0.3, 0.9)
        values[name] = spec.at_most if far and math.isfinite(spec.at_most) else inside
    made = law(**values, **{name: OPTIONS[name] for name, _ in law.options()})
    return made.bind(made.piece(0.5)) if isinstance(made, Load) else made


def argument(law: Law, name: str, draw: random.Random, far: bool = False) -> float:
    """A value of a variable: a fraction where it is one, of either sign where it may be."""
    known = VARIABLES.get(name)
    unit = MORE_UNITS.get(name) or (known.unit if known else "1")
    size = USUAL.get(unit, 1.0) * draw.uniform(0.7, 1.6)
    if name in ("phi", "sticking"):
        return size / 2
    if name in SIGNED and far:
        size *= draw.choice((1e-3, 1, 1e3))
    either = name in SIGNED and name not in (*law.positive, *law.nonnegative)
    return size * draw.choice((1, 1, -1)) if either else size


NO_FORMULAS = ("breakpoints", "jumps", "piece", "stoichiometry", "is_default", "refine", *NUMERIC)


def formulas(law: Law) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Everything that a law computes from variables."""
    base = next(c for c in CONTRACTS if isinstance(law, c))
    own = {name for c in type(law).__mro__ if c is not base and issubclass(c, base) for name in vars(c)}
    for name in sorted(own | {"log_rate", "log_ratio", "channels"}):
        if name.startswith("_") or isinstance(inspect.getattr_static(law, name, None), classmethod | staticmethod):
            continue
        item = getattr(law, name, None)
        if name == "channels" and item is not None:
            yield from item().items()
        elif name in ("ranges", "limits"):
            yield name, partial(copy, item)
        elif callable(item) and name not in NO_FORMULAS:
            yield name, item


def parts(value: Any) -> Iterator[Any]:
    """What a formula states, one by one."""
    if isinstance(value, Mapping):
        value = [value[key] for key in sorted(value)]
    if isinstance(value, tuple | list):
        for item in value:
            yield from parts(item)
    else:
        yield value


def computed(law: type[Law]) -> dict[str, list[float]]:
    """All values of a law, by formula."""
    result: dict[str, list[float]] = {}
    for seed in range(POINTS + FAR):
        draw = random.Random(f"{law.name()}{seed}")
        far = seed >= POINTS
        made = instance(law, draw, far)
        for name, formula in formulas(made):
            arguments = {x: argument(made, x, draw, far) for x in inspect.signature(formula).parameters}
            result.setdefault(name, []).extend(map(float, parts(formula(**arguments))))
    return result


if __name__ == "__main__":
    rows = [f"{json.dumps(name)}: {json.dumps(computed(law))}" for name, law in every().items()]
    TABLE.write_text("{\n" + ",\n".join(rows) + "\n}\n")
