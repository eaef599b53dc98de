"""What holds for every law without naming one, beside what `surfacechem laws --check` asks of a law of one's own."""

import dataclasses
import inspect
import json
import math
import random

import law_values
import mpmath
import pytest
import symengine
import thermodynamics

from surfacechem.contracts.terms import Friction, Law, Load, reads
from surfacechem.errors import InputError
from surfacechem.expressions import derivative
from surfacechem.laws import FAMILIES, find, laws
from surfacechem.runs.check import READABLE

EVERY = [law for contract in FAMILIES for law in laws(contract).values()]
OPTIONS = law_values.OPTIONS | law_values.GRID
SAMPLES = 20
APPROVED = json.loads(law_values.TABLE.read_text())

each_law = pytest.mark.parametrize("law", EVERY, ids=lambda law: f"{law.contract}-{law.name()}")


def example(law: type[Law], seed: int) -> Law:
    """An instance with random admissible parameters."""
    draw = random.Random(f"{law.name()}{seed}")
    values = {name: draw.uniform(0.1, 0.9) + max(spec.above, spec.at_least, 0) for name, spec in law.specs()}
    return law(**values, **{name: OPTIONS[name] for name, _ in law.options()})


def point(formula, seed: int) -> dict[str, float]:
    draw = random.Random(seed)
    return {name: draw.uniform(0.1, 0.9) for name in reads(formula)}


@pytest.mark.parametrize("name", law_values.every())
def test_every_formula_keeps_its_approved_values(name):
    """A new law gets its values by `python tests/law_values.py`."""
    found = law_values.computed(law_values.every()[name])
    assert found.keys() == APPROVED[name].keys()
    for formula, values in found.items():
        assert values == pytest.approx(APPROVED[name][formula], rel=1e-11, abs=0), formula


@pytest.mark.parametrize("name", law_values.every())
def test_derivatives_of_every_formula_are_its_slopes(name):
    """By differences in 60 digits."""
    law = law_values.every()[name]
    for seed in range(2):
        draw = random.Random(f"{name}{seed}")
        made = law_values.instance(law, draw)
        for _formula, method in law_values.formulas(made):
            symbols = {x: symengine.Symbol(x) for x in inspect.signature(method).parameters}
            point = {s: mpmath.mpf(law_values.argument(made, x, draw)) for x, s in symbols.items()}
            for expression in law_values.parts(method(**symbols) if symbols else ()):
                value = abs(thermodynamics.number(expression, point))
                for x in symbols.values():
                    found = thermodynamics.number(derivative(expression, x), point)
                    rounding = 1e-12 * value / abs(point[x])  # of constants that differentiation multiplies
                    assert mpmath.almosteq(found, thermodynamics.slope(expression, x, point), 1e-12, rounding)


@pytest.mark.parametrize("law", [law for law in laws(Friction).values() if hasattr(law, "limit")])
def test_sticking_bears_a_traction_at_rest(law):
    for seed in range(SAMPLES):
        instance = example(law, seed)
        values = point(instance.limit, seed)
        assert set(values) <= READABLE - {"v"}, "what sticks has no velocity"
        assert instance.limit(**values) >= 0


@each_law
def test_refuses_what_is_not_finite_or_out_of_range(law):
    good = example(law, 0)
    fields = {item.name: getattr(good, item.name) for item in dataclasses.fields(good) if item.name != "place"}
    for name, spec in law.specs():
        bad = [math.nan, math.inf]
        bad += [spec.above] * math.isfinite(spec.above) + [spec.at_least - 1] * math.isfinite(spec.at_least)
        for value in bad:
            with pytest.raises(InputError, match=name):
                law(**fields | {name: value})


def test_a_law_is_found_by_name_and_an_unknown_one_is_answered_with_the_nearest():
    assert find(Friction, "coulomb").name() == "coulomb"
    with pytest.raises(InputError, match=r"no friction law 'colomb'\. Did you mean 'coulomb'\? Known: "):
        find(Friction, "colomb")


def test_a_table_of_time_holds_its_ends():
    table = find(Load, "table")(times=(0.0, 1.0, 3.0), values=(1.0, 2.0, 5.0))
    found = [table.bind(table.piece(t)).value(t) for t in (-1.0, 0.5, 2.0, 3.0, 9.0)]
    assert found == [1.0, 1.5, 3.5, 5.0, 5.0]
