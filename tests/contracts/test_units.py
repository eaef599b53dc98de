"""Quantities with units become SI, as Pint does it to the last digit, or an error that says what is needed."""

import random
import subprocess
import sys
from contextlib import suppress
from decimal import Decimal

import cantera
import pytest
from hypothesis import given
from hypothesis import strategies as st

from surfacechem.contracts import units
from surfacechem.contracts.terms import BodyEnergy, Factor, Friction, HeatTransfer, Load, Potential, RateLaw
from surfacechem.errors import InputError, Place
from surfacechem.quantities import VARIABLES


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (3, "m", 3.0),
        ("3", "m", 3.0),
        ("1e18", "1/m^2", 1e18),
        ("-2.5e-3", "1", -2.5e-3),
        ("10 pN", "N", 1e-11),
        ("300K", "K", 300.0),
        ("25 degC", "K", 298.15),
        ("77 degF", "K", 298.15),
        ("2 h", "s", 7200.0),
        ("3 s-1", "1/s", 3.0),
        ("2 W m-2 K-1", "W/(m^2 K)", 2.0),
        ("5 1/nm2", "1/m^2", 5e18),
        ("1 kT", "J", 1.380649e-23 * 298.15),
        ("1 kT/nm", "N", 1.380649e-14 * 298.15),
        ("1 kT", "J/mol", 8.31446261815324 * 298.15),
        ("1 day", "s", 86400.0),
        ("3 W", "W", 3.0),
        ("3 µm", "m", 3e-6),
        ("3 μm", "m", 3e-6),
        ("1 kJ/m^2/K", "J/(m^2 K)", 1e3),
        ("1 kJ/m^2/degC", "J/(m^2 K)", 1e3),
        ("1/um^2", "1/m^2", 1e12),
        ("100 1/um^2", "1/m^2", 1e14),
        ("1e18 m**-2", "1/m^2", 1e18),
        ("3.3e12 1/J/s", "1/(J s)", 3.3e12),
        ("2.5e38 1/(J s m^2)", "1/(J s m^2)", 2.5e38),
        ("50 %", "1", 0.5),
        ("5 percent", "1", 0.05),
        ("180 deg", "rad", 3.141592653589793),
        ("1 kcal/mol", "J/mol", 4184.0),
        ("1 eV", "J/mol", 96485.33212331),
        ("1 eV", "J", 1.602176634e-19),
        ("96485.33212331 J/mol", "J", 1.602176634e-19),
        ("2 N/m", "J/m^2", 2.0),
        ("1 mPa s", "Pa s", 1e-3),
        ("1 K/min", "(K)/s", 1 / 60),
    ],
)
def test_si_value(value, unit, si):
    assert units.parse(value, unit) == pytest.approx(si, rel=1e-13, abs=0.0)


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("3 nm/s", "m", "3 nm/s is a velocity; g_n needs a length [m]."),
        ("25 C", "K", '25 C is an electric charge; write "25 degC" or 298.15 K.'),
        ("77 F", "K", '77 F is a capacitance; write "77 degF" or 298.15 K.'),
        ("3 nN", "N/s", "3 nN is a force; g_n needs a quantity in N/s."),
        ("3 J", "J/mol", "3 J is an energy; g_n needs a molar energy [J/mol]."),
        ("3 kg m^7", "1", "3 kg m^7 is a quantity in kg * m ** 7; g_n needs a pure number."),
        ("3 kBT", "J", 'no unit \'kBT\'. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("3 kJo", "J", "no unit 'kJo'. Did you mean 'kJ'?"),
        ("3 1/Np", "m", 'no unit \'delta_neper\'. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("3 m)", "m", '\'m)\' is not a unit. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("3 m^9^9^9^9", "m", '\'m^9^9^9^9\' is not a unit. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("3 m^(9^9^9)", "m", '\'m^(9^9^9)\' is not a unit. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("1 2 m", "m", '\'2 m\' is not a unit. Write it like "J/(m^2 K)" or "1/um^2".'),
        ("long", "m", "'long' is not a number with a unit; g_n needs a length [m]."),
        ("", "m", "'' is not a number with a unit; g_n needs a length [m]."),
        (None, "m", "g_n needs a length [m], got nothing."),
        (True, "m", "g_n needs a length [m], got true."),
        ([1], "m", "g_n needs a length [m], got a list."),
        (float("nan"), "m", "g_n must be finite, got 'nan'."),
        ("-inf", "m", "g_n must be finite, got -inf."),
        ("1e999", "m", "g_n must be finite, got '1e999'."),
        (10**400, "m", f"g_n must be finite, got '1{'0' * 36}...'."),
    ],
)
def test_message(value, unit, message):
    with pytest.raises(InputError) as error:
        units.parse(value, unit, Place("a.yaml", 3, "interface.gap"), "g_n")
    assert str(error.value) == f"a.yaml:3: interface.gap: {message}"


def test_a_difference_has_no_offset():
    assert units.parse("5 delta_degC", "K", difference=True) == 5.0
    with pytest.raises(InputError, match="a difference of temperatures; give it in K"):
        units.parse("5 degC", "K", name="amplitude", difference=True)


@given(st.text(max_size=30), st.sampled_from(["m", "K", "J/mol", "1"]))
def test_any_text_is_a_number_or_an_input_error(text, unit):
    for value in (text, f"1 {text}", f"1 m{text}", f"1 1/{text}"):
        with suppress(InputError):
            units.parse(value, unit)


def test_works_where_the_cache_cannot_be_written(tmp_path):
    locked = tmp_path / "file"
    locked.touch()
    code = "from surfacechem.contracts.units import parse; assert parse('3 um', 'm') == 3e-6"
    environment = {"XDG_CACHE_HOME": str(locked / "cache"), "HOME": str(locked)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def declared_units():
    found = {quantity.unit for quantity in VARIABLES.values()}
    for contract in (BodyEnergy, Factor, Friction, HeatTransfer, Load, Potential, RateLaw):
        from surfacechem.laws import laws

        for law in laws(contract).values():
            found |= {spec.unit for _, spec in law.specs() if "[x]" not in spec.unit}
    return sorted(found)


@pytest.mark.parametrize("unit", declared_units())
def test_every_unit_of_the_code_is_a_unit_in_si(unit):
    assert units.parse(f"2 {unit}", unit) == 2.0
    assert units.parse("2", unit) == 2.0
    assert unit == "1" or units.dimension(unit).endswith((f"[{unit}]", f"a quantity in {unit}"))


PREFIXES = ["", "G", "M", "k", "c", "m", "u", "n", "p", "f"]
NAMES = [
    *("m", "g", "s", "min", "hr", "angstrom", "K", "A", "C", "N", "J", "cal"),
    *("eV", "W", "Pa", "bar", "atm", "mol", "V", "ohm", "Hz", "L", "day"),
]
COMPOUND = ["J/mol", "kcal/mol", "kJ/m^2/K", "1/cm^2", "mol/cm^2", "m^3/kmol/s", "Pa*s", "J/s/m^2/K", "1/um^2", "m^-2"]


def base(unit):
    """The same dimension in SI base units, in a form that both understand."""
    return f"{units._registry().Quantity(1, units._unit(unit)).to_base_units().units:~C}".replace("**", "^")


def test_cantera_agrees_on_every_unit_that_both_know():
    system, seen = cantera.UnitSystem({"quantity": "mol"}), 0
    for unit in [*(prefix + name for prefix in PREFIXES for name in NAMES), *COMPOUND]:
        try:
            ours, to = units._unit(unit), base(unit)
            theirs = system.convert_to(f"3.7 {unit}", to)
        except (InputError, cantera.CanteraError):
            continue
        assert units.parse(f"3.7 {unit}", to) == pytest.approx(theirs, rel=1e-12), f"{unit}: {ours}"
        seen += 1
    assert seen > 100


@pytest.mark.parametrize("given", ["60 rpm", "3 rad/s", "1 deg/s", "1 cycle/s"])
def test_an_angular_velocity_is_no_frequency(given):
    with pytest.raises(InputError, match="counts an angle"):
        units.parse(given, "1/s", name="frequency")
    assert units.parse("60 Hz", "1/s") == 60.0
    assert units.parse("180 deg", "rad") == pytest.approx(3.141592653589793)


pytestmark = pytest.mark.around


def by_pint(number, given, unit):
    try:
        return units._by_pint(number, given, unit, "the value", False)
    except InputError as error:
        return str(error)


def as_unit(powers):
    return " ".join(f"{name}^{power}" for name, power in powers.items()) or "1"


def random_unit(source):
    """Names, powers, quotients and parentheses; many of them are no units."""
    text = source.choice(["", "1/", "1/(", "("]) + source.choice(list(units.KNOWN))
    for _ in range(source.randrange(4)):
        text += source.choice(["/", " ", "*", "^2", "^-1 ", "**2", " / ", "/("]) + source.choice(list(units.KNOWN))
    return text + ")" * (text.count("(") - text.count(")"))


@pytest.mark.parametrize("name", units.KNOWN)
def test_every_name_of_the_table(name):
    unit = as_unit(units.KNOWN[name][1])
    assert units.parse(f"3.7 {name}", unit) == by_pint("3.7", name, unit)


def test_random_units():
    source, seen = random.Random(5), 0
    for text in (random_unit(source) for _ in range(700)):
        try:
            _, powers = units._parsed(text)
        except units._LeftToPintError:
            continue
        number = source.choice(["1", "-2.5e-3", "1e18", "123456.789"])
        assert float(Decimal(number) * units.si_factor(text, as_unit(powers))) == by_pint(
            number, text, as_unit(powers)
        ), text
        seen += 1
    assert seen > 150


@pytest.mark.parametrize(
    "text", ["", "m)", "(m", "m^", "m^9^9", "2 m", "J/m^2 K", "m^(2)", "/m", "kJo", "m^1.5", "1 2", "1^2 m"]
)
def test_what_is_unusual_is_left_to_pint(text):
    assert units.si_factor(text, "m") is None
