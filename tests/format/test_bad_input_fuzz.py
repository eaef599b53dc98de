"""Whatever stands in a case file, it loads and assembles or is an input error; nothing else escapes."""

from contextlib import suppress
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutants import garbled, mutated, refusal

from surfacechem.documents import document
from surfacechem.errors import InputError, Place
from surfacechem.format import load, names

pytestmark = pytest.mark.around

VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 400),
    st.floats(),
    st.sampled_from([10**400, -1e308, 5e-324, 1e18, "1e18"]),
    st.sampled_from(
        ["", "T", "T_1", "T_2", "T_c", "T_a", "phi", "300 K", "25 C", "1 kJ/m^2/K", "3 m", "0 s", "-1", "."]
    ),
    st.sampled_from(["coulomb", "lower", "interface", "logarithmic", "constant", "power", "[", "{", "a: b", "*", "&"]),
    st.text(max_size=6),
    st.sampled_from([[], {}, [[]], {"value": 3}, {"value": 1, "times": []}, {"ramp": {"rate": 1}}, ["coulomb"]]),
    st.just({"hold": {"level": 300}}),
    st.just({"harmonic": {"amplitude": 3, "frequency": "1 Hz"}}),
)
KEYS = [
    *("T_0", "bodies", "interface", "temperature", "sites", "partition", "potential", "friction", "bonding", "heat"),
    *("loading", "initial", "run", "until", "T", "T_1", "phi", "v", "p", "g_n", "J_c", "Q_1", "coulomb", "value", "C"),
    *("times", "of", "between", "h", "mechanism", "coverages", "reference", "capacity", "surroundings", "", "a.b"),
    *("medium", "fluid", "pressure", "thickness", "viscosity", "closure", "radiation", "vogel"),
]
SAMPLES = [name for name in names() if "kappa" not in name]


@cache
def sample(name):
    """The text of a case and its plain data, which nothing here changes."""
    text = load(name).text
    return text, document.parse(text).plain()


def loads_or_is_refused(text):
    error = refusal(text)
    if error is not None:
        assert error.place.file.endswith(".yaml"), error  # the mechanism's, where the mistake is in there
        assert error.place.line or "the file is empty" in error.message or "not YAML" in error.message, error
        assert str(error).isprintable()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"lo\\nading": {}', r"fuzz.yaml:1: unknown key 'lo\nading'. Did you mean 'loading'? Known: "),
        ("? |\n  bodies\n: {}", r"fuzz.yaml:1: unknown key 'bodies\n'. Did you mean 'bodies'? Known: "),
        (
            'run: {until: 1 s}\nbodies: "lower:\n\n  1"',
            r"fuzz.yaml:2: bodies: this must be a mapping, not 'lower:\n1'.",
        ),
        ('"T\\e[2J\\u2028": 3', r"fuzz.yaml:1: unknown key 'T\x1b[2J\u2028'. Known: "),
        ('title: "\\ud800"\n"\\ud800": 1', r"unknown key '\ud800'"),
    ],
)
def test_a_message_is_one_line_whatever_it_quotes(text, message):
    error = refusal(text)
    assert message in str(error)
    assert str(error).isprintable()
    assert error.message.isprintable()


@given(name=st.sampled_from(SAMPLES), data=st.data())
@settings(max_examples=60, derandomize=True, suppress_health_check=list(HealthCheck))
def test_mutated_documents(name, data):
    _, plain = sample(name)
    for _ in range(data.draw(st.integers(1, 3))):
        plain = mutated(plain, KEYS, VALUES, data)
    loads_or_is_refused(document.dump(document.from_plain(plain, Place())))


@given(name=st.sampled_from(SAMPLES), data=st.data())
@settings(max_examples=60, derandomize=True, suppress_health_check=list(HealthCheck))
def test_mutated_texts(name, data):
    text, _ = sample(name)
    loads_or_is_refused(garbled(text, data))


@given(st.text())
def test_any_text(text):
    with suppress(InputError):
        document.parse(text)


@given(name=st.sampled_from(SAMPLES), path=st.lists(st.sampled_from(KEYS), max_size=4), value=VALUES)
def test_any_override(name, path, value):
    with suppress(InputError):
        load(name, {".".join(path): value}).system()
    with suppress(InputError):
        load(name, [f"{'.'.join(path)}={value}"]).system()
