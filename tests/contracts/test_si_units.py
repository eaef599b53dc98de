"""The table of usual units is what Pint says, to the last digit."""

import random
from decimal import Decimal

import pytest

from surfacechem.contracts import si_units, units
from surfacechem.errors import InputError

pytestmark = pytest.mark.around


def by_pint(number, given, unit):
    try:
        return units._by_pint(number, given, unit, "the value", False)
    except InputError as error:
        return str(error)


def base(powers):
    return " ".join(f"{name}^{power}" for name, power in powers.items()) or "1"


def random_unit(source):
    """Names, powers, quotients and parentheses; many of them are no units."""
    text = source.choice(["", "1/", "1/(", "("]) + source.choice(list(si_units.KNOWN))
    for _ in range(source.randrange(4)):
        text += source.choice(["/", " ", "*", "^2", "^-1 ", "**2", " / ", "/("]) + source.choice(list(si_units.KNOWN))
    return text + ")" * (text.count("(") - text.count(")"))


@pytest.mark.parametrize("name", si_units.KNOWN)
def test_every_name_of_the_table(name):
    unit = base(si_units.KNOWN[name][1])
    assert units.parse(f"3.7 {name}", unit) == by_pint("3.7", name, unit)


def test_random_units():
    source, seen = random.Random(5), 0
    for text in (random_unit(source) for _ in range(700)):
        try:
            _, powers = si_units._parsed(text)
        except si_units._LeftToPintError:
            continue
        number = source.choice(["1", "-2.5e-3", "1e18", "123456.789"])
        assert float(Decimal(number) * si_units.factor(text, base(powers))) == by_pint(number, text, base(powers)), text
        seen += 1
    assert seen > 150


@pytest.mark.parametrize(
    "text", ["", "m)", "(m", "m^", "m^9^9", "2 m", "J/m^2 K", "m^(2)", "/m", "kJo", "m^1.5", "1 2", "1^2 m"]
)
def test_what_is_unusual_is_left_to_pint(text):
    assert si_units.factor(text, "m") is None
