"""Check of a user's own law against the requirements on every law: documentation, units, equal results for floats and
symbols, and the second law.
"""

from __future__ import annotations

import doctest
import inspect
import math
import random
import sys
from collections.abc import Iterator
from typing import Any

import symengine

from surfacechem.contracts.terms import Friction, HeatTransfer, Law, Load, RateLaw, reads
from surfacechem.contracts.units import dimension
from surfacechem.errors import InputError, suggestion
from surfacechem.quantities import BOLTZMANN, VARIABLES
from surfacechem.tolerances import NO_AMOUNT, TINY

DRAWS = 20
"""Number of random draws of parameters and variables; a choice."""

RANGE_PARTS, ROOM = (0.1, 0.9), 600.0
"""Fractions of a range between which values are drawn, and twice the room temperature [K]."""

READABLE = {*VARIABLES, "x", "T", "N_c", "M", "u", "r"}
"""Names that formulas may read in every scene, in addition to temperatures and coverages by name."""

GIVEN, VALUES = (0.0, 1.0, 3.0), (1.0, 2.0, 0.5)
OPTIONS: dict[str, Any] = {
    "between": ("lower", "upper"),
    "of": "T_c",
    **dict.fromkeys(("times", "pressures", "gaps"), GIVEN),
    **dict.fromkeys(("values", "conductances"), VALUES),
}
"""Values of options without a default."""

DOCUMENTED = {
    ".. math::": "no formula: write it under `.. math::` in the docstring",
    "Source:": "no source: write `Source: ...` into the docstring, with the range of validity",
    ">>> ": "no worked number: write one into the docstring, after `>>>`",
}


def problems(law: type[Law]) -> list[str]:
    """Return the requirements that a law violates, in words; empty if there are none."""
    found = [message for mark, message in DOCUMENTED.items() if mark not in (inspect.getdoc(law) or "")]
    found += [f"{name} has no meaning: say what it is" for name, spec in law.specs() if not spec.text]
    for name, spec in law.specs():
        try:
            dimension(spec.unit.replace("[x]", "1"))
        except InputError as error:
            found.append(f"{name}: {error.message}")
    read = reads(getattr(law, law.formula))[1:]
    unknown = [name for name in read if name not in READABLE and not name.startswith(("T", "theta_"))]
    found += [f"it reads '{name}', which no scene has.{suggestion(name, READABLE)}" for name in unknown]
    return found or [*worked_numbers(law), *first_error(law)]


def worked_numbers(law: type[Law]) -> Iterator[str]:
    """Run the worked numbers of the docstring in the namespace of the law's module, and yield those that fail."""
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    known = vars(sys.modules[law.__module__])
    for example in doctest.DocTestFinder(recurse=False).find(law, law.__name__, globs=known):
        said: list[str] = []
        if runner.run(example, out=said.append).failed:
            lines = [line.strip() for line in "".join(said).splitlines() if line.strip()]
            yield f"its worked number is another: {' '.join(lines[-4:])}"


def first_error(law: type[Law]) -> Iterator[str]:
    """Yield the first error at random parameters and states, if any."""
    for seed in range(DRAWS):
        draw = random.Random(seed)
        try:
            made = _instance(law, draw)
            # Temperatures about that of a room, all else about one.
            names = reads(made.statement)
            values = {name: draw.uniform(*RANGE_PARTS) * (ROOM if name.startswith("T") else 1.0) for name in names}
            wrong = _differs(made, values) or second_law_violation(made, values)
        except (InputError, ArithmeticError, TypeError, ValueError, RuntimeError) as error:
            wrong = f"its formula fails: {type(error).__name__}: {error}"
        if wrong:
            yield wrong
            return  # one example is enough: the same error usually occurs everywhere


def _instance(law: type[Law], draw: random.Random) -> Any:
    """Return the law with random parameters within their ranges."""
    values = {name: option for name, option in OPTIONS.items() if name in dict(law.options())}
    for name, spec in law.specs():
        low = max(spec.above, spec.at_least)
        start = low if math.isfinite(low) else 0.0
        values[name] = start + draw.uniform(*RANGE_PARTS) * min(1.0, spec.at_most - start)
    made = law(**values)
    return made.bind(made.piece(0.5)) if isinstance(made, Load) else made


def _differs(law: Law, values: dict[str, float]) -> str:
    """Return a disagreement of floats and symbols, or a result that is not finite, in words; empty if there is none."""
    symbols = {name: symengine.Symbol(name) for name in values}
    number = law.statement(**values)
    if isinstance(number, tuple):  # a point in space, which tests of its law check
        return ""
    if not isinstance(number, int | float) or not math.isfinite(number):
        return f"its formula gives {number} at {_shown(values)}"
    other = float(symengine.sympify(law.statement(**symbols)).subs({symbols[x]: value for x, value in values.items()}))
    if abs(other - number) > NO_AMOUNT * max(abs(number), TINY):
        return f"floats give {number:.17g}, symbols {other:.17g} at {_shown(values)}: use `surfacechem.expressions`"
    return ""


def second_law_violation(law: Law, values: dict[str, float]) -> str:
    """Return a violation of the second law in words, of a law that drives instead of resisting; empty if none."""
    if isinstance(law, Friction) and "v" in values:
        for v in (0.7, -0.7):
            own = values | {"v": v} | ({"direction": math.copysign(1.0, v)} if "direction" in values else {})
            if law.statement(**own) * v < 0:
                return f"it drives sliding at {_shown(own)}: traction * v must not be below zero"
    if isinstance(law, RateLaw) and "mu" in values:
        for mu in (BOLTZMANN * ROOM, -BOLTZMANN * ROOM):
            if -mu * law.statement(**values | {"mu": mu}) < 0:
                return f"it runs uphill at mu = {mu:g} J: -mu * rate must not be below zero"
    if isinstance(law, HeatTransfer) and law.statement(**values) < 0:
        return f"heat flows from cold to hot at {_shown(values)}: a conductance must not be below zero"
    return ""


def _shown(values: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:.3g}" for name, value in values.items())


def report(found: list[type[Law]]) -> tuple[str, bool]:
    """Return the errors of each law as text, and True if there are none."""
    lines, well = [], True
    for law in found:
        wrong = problems(law)
        well = well and not wrong
        lines += [f"{law.name()} ({law.contract}): {'keeps what a law has to keep' if not wrong else ''}".rstrip()]
        lines += [f"  {text}" for text in wrong]
    return "\n".join(lines), well
