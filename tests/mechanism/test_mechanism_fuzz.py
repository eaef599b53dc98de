"""A key that is misspelt anywhere in a mechanism is an error that names it; whatever stands in a file, it is read and
assembled, or refused where it stands.
"""

import io
import re
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutants import garbled, mutated, refusal
from ruamel.yaml import YAML

from mechanisms import SHIPPED
from surfacechem.documents import document, mechanisms
from surfacechem.documents.document import Limits
from surfacechem.errors import InputError, Place
from surfacechem.mechanism import load_mechanism, source
from surfacechem.mechanism.rates import AffinityReaction, kinds

pytestmark = pytest.mark.around

FREE = ("description", "note")
"""Text that is not read."""

RICH = """\
description: Every key that a file may hold.
units: {length: m, quantity: mol, activation-energy: kJ/mol, energy: J}
phases:
- name: surface
  thermo: ideal-surface
  kinetics: surface
  elements: [H]
  species: [A(s), B(s), C(s)]
  reactions: all
  site-density: 1e-9 mol/m^2
  state: {T: 300 K, P: 1 bar, coverages: {A(s): 0.5, B(s): 0.5}}
species:
- name: A(s)
  composition: {H: 1}
  sites: 1
  thermo: {model: constant-cp, T0: 298.15 K, h0: 1 kJ/mol, s0: 1 J/mol/K, cp0: 3 J/mol/K, T-min: 200 K, T-max: 900 K}
- name: B(s)
  composition: {H: 1}
  thermo: {model: NASA7, temperature-ranges: [200.0, 1000.0], data: [[4, 0, 0, 0, 0, 1, 1]], reference-pressure: 1 atm}
- name: C(s)
  composition: {H: 1}
  thermo: {model: Shomate, temperature-ranges: [200.0, 1000.0], data: [[4, 0, 0, 0, 0, 1, 1]]}
  bond: {stiffness: 2 pN/nm, rest-length: 20 nm}
reactions:
- equation: A(s) <=> B(s)
  id: first
  rate-constant: {A: 1e5, b: 0.5, Ea: 3}
  coverage-dependencies:
    A(s): {a: 0.1, m: 0, E: 1}
    B(s): {a: 0.1, m: 0, E: [1, 2]}
- equation: B(s) => C(s)
  type: interface-Arrhenius
  units: {activation-energy: J/mol}
  rate-constant: {A: 1e5, b: 0.5, Ea: 3}
  orders: {B(s): 2}
- equation: C(s) => B(s)
  duplicate: false
  nonreactant-orders: true
  orders: {C(s): 1, A(s): 1}
  rate-constant: {A: 1e5 m^2/mol/s, b: 0.5, Ea: 3}
"""

UNITS = {"m": "0.4 nm", "N/m": "2 pN/nm", "J": "60 kJ/mol", "J/mol": "60 kJ/mol", "1/s": "2 1/s", "1": 0.5}


def of_every_type():
    """A reaction of every rate type with all keys of its class."""
    for kind, law in kinds().items():
        specs = dict(law.specs())
        own = {key: UNITS[specs[name].unit] for key, name in law.own_keys().items()}
        fields = {"rate-constant": "{A: 1e5, b: 0.5, Ea: 3}", **own, "duplicate": "true"}
        lines = "".join(f"  {key}: {value}\n" for key, value in fields.items())
        arrow = "<=>" if issubclass(law, AffinityReaction) else "=>"
        yield f"- equation: C(s) {arrow} A(s)\n  type: {kind.removeprefix('interface-')}\n{lines}"


def keys(node, path=()):
    """The path of every key that means something."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key not in FREE:
                yield (*path, key)
                yield from keys(value, (*path, key))
    elif isinstance(node, list):
        for i, value in enumerate(node):
            yield from keys(value, (*path, i))


def renamed(text, path, new):
    """The text with the last key of the path renamed, in place."""
    data = YAML(typ="rt").load(text)
    node = data
    for step in path[:-1]:
        node = node[step]
    place = list(node).index(path[-1])
    node.insert(place, new, node.pop(path[-1]))
    out = io.StringIO()
    YAML(typ="rt").dump(data, out)
    return out.getvalue()


@st.composite
def misspelt(draw, word):
    """One letter too many, too few, another, or two in the wrong order."""
    i = draw(st.integers(0, len(word) - 1))
    letter = draw(st.sampled_from("aeEbAqz-"))
    way = draw(st.sampled_from(["more", "less", "other", "turned", "case"]))
    if way == "turned" and i + 1 < len(word):
        return word[:i] + word[i + 1] + word[i] + word[i + 2 :]
    changed = {
        "more": word[:i] + letter + word[i:],
        "less": word[:i] + word[i + 1 :],
        "case": word[:i] + word[i].swapcase() + word[i + 1 :],
    }
    return changed.get(way, word[:i] + letter + word[i + 1 :])


TEXTS = {"every key": RICH, "every rate type": RICH + "".join(of_every_type())} | {
    name: (mechanisms() / name).read_text(encoding="utf-8") for name in SHIPPED
}


@cache
def plain(name):
    """The content of a text, which nothing here changes."""
    return YAML(typ="safe").load(TEXTS[name])


@cache
def every_key():
    return sorted({str(key) for name in TEXTS for path in keys(plain(name)) for key in path if isinstance(key, str)})


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("mechanisms") / "fuzzed.yaml"


WHOLE = ("every key", "every rate type")


@pytest.mark.parametrize("name", WHOLE)
def test_the_file_itself_is_read(name, file):
    file.write_text(TEXTS[name], encoding="utf-8")
    assert load_mechanism(file).reactions


@pytest.mark.parametrize("name", WHOLE)
@given(data=st.data())
@settings(max_examples=8)
def test_a_misspelt_key_is_named(name, file, data):
    path = data.draw(st.sampled_from(list(keys(plain(name)))))
    new = data.draw(misspelt(str(path[-1])).filter(lambda word: word.strip() and word not in siblings(name, path)))
    file.write_text(renamed(TEXTS[name], path, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_mechanism(file)
    assert f"'{new}'" in caught.value.message
    assert caught.value.place.line > 0
    assert caught.value.place.file == str(file)


def siblings(name, path):
    """What may stand there: the key itself, and other keys that would mean something."""
    words = set(re.findall(r"[\w()-]+", TEXTS["every rate type"] + TEXTS[name]))
    return words | {"cp0", "note", "P", "T", *FREE}


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 400),
    st.floats(),
    st.sampled_from([10**400, -1e308, 5e-324, "1e18", "", "A(s)", "300 K", "1 kJ/mol", "-1 mol/m^2", "NASA7", "all"]),
    st.sampled_from(["A(s) => A(s)", "=> B(s)", "A(s) + B(s) =>", "1e9 A(s) <=> B(s)", "A(s)", "Bell", "sticking"]),
    st.text(max_size=6),
    st.sampled_from([[], {}, [[]], [1, 2], {"A": 1}, {"model": "NASA7", "data": [[1]]}, ["A(s)"], [{"x": "all"}]]),
)
ODD = {
    "a control character": b"phases: \x07",
    "no text": b"\x89PNG\r\n\x1a\n\x00\x00",
    "deep nesting": b"phases: " + b"[" * 1000,
    "an alias of itself": b"phases: &a [*a]",
    "aliases that repeat": b"".join(
        b"%c: &%c [%s]\n" % (c, c, b", ".join([b"*%c" % (c - 1)] * 9) if c > 97 else b"1") for c in range(97, 110)
    ),
    "a tag": b"phases: !!python/object:os.system [ls]",
    "two documents": b"phases: []\n---\nphases: []",
    "nothing": b"",
    "a list": b"- 1",
    "a number of reactions": RICH[: RICH.index("reactions:\n")].encode() + b"reactions: 5\n",
    "a number of phases": b"phases: 5",
    "a phase that is a text": b"phases: [surface]",
}


@pytest.mark.parametrize("name", ODD)
def test_what_is_no_mechanism_is_refused(name, file):
    file.write_bytes(ODD[name])
    with pytest.raises(InputError) as caught:
        load_mechanism(file)
    assert caught.value.place.file == str(file)
    assert len(str(caught.value)) < 1000


def test_too_many_values_are_refused(file, monkeypatch):
    monkeypatch.setattr(source, "MECHANISM_LIMITS", Limits(largest=10_000, most=1000))
    file.write_bytes(b"phases: [" + b"1, " * 1000 + b"]")
    with pytest.raises(InputError, match="more than 1000 values"):
        load_mechanism(file)


SOLVERS = st.sampled_from(["radau", "cantera"])
CASE = """\
T_0: 300 K
bodies: {{one: {{temperature: T, C: 1}}, two: {{temperature: T, C: 1}}}}
interface: {{temperature: T, mechanism: {{file: {}, phase: {}}}}}
initial: {{T: 300 K, coverages: {{{}: 1}}}}
run: {{until: 1 s, solver: {}}}
"""


def is_read_or_refused(text, file, solver):
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    phase, species = re.search(r"- name: (\S+)", text), re.search(r"[\w*]+\(s\)", text)
    names = (phase[1] if phase else "surface", species[0] if species else "A(s)")
    error = refusal(CASE.format(file.name, *names, solver), str(file.parent))
    if error is not None:
        assert error.place.file
        assert str(error).isprintable()
        assert len(str(error)) < 2000


@pytest.mark.parametrize("examples", [15, pytest.param(3000, marks=pytest.mark.slow)])
def test_mutated_documents(examples, file):
    @given(name=st.sampled_from(list(TEXTS)), data=st.data())
    @settings(max_examples=examples, derandomize=True, suppress_health_check=list(HealthCheck))
    def run(name, data):
        content = plain(name)
        for _ in range(data.draw(st.integers(1, 3))):
            content = mutated(content, every_key(), VALUES, data)
        is_read_or_refused(document.dump(document.from_plain(content, Place())), file, data.draw(SOLVERS))

    run()


@pytest.mark.parametrize("examples", [15, pytest.param(3000, marks=pytest.mark.slow)])
def test_mutated_texts(examples, file):
    @given(name=st.sampled_from(list(TEXTS)), data=st.data())
    @settings(max_examples=examples, derandomize=True, suppress_health_check=list(HealthCheck))
    def run(name, data):
        is_read_or_refused(garbled(TEXTS[name], data), file, data.draw(SOLVERS))

    run()
