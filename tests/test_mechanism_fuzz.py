"""A key that is misspelt anywhere in a mechanism is an error that names it; nothing is ignored."""

import io
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from surfacechem.data import mechanisms
from surfacechem.errors import InputError
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.affinity import AffinityReaction
from surfacechem.mechanism.kinds import kinds

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
    path.name: path.read_text(encoding="utf-8") for path in sorted(mechanisms().glob("*.yaml"))
}
PLAIN = {name: YAML(typ="safe").load(text) for name, text in TEXTS.items()}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("mechanisms") / "fuzzed.yaml"


@pytest.mark.parametrize("name", TEXTS)
def test_the_file_itself_is_read(name, file):
    file.write_text(TEXTS[name], encoding="utf-8")
    assert load_mechanism(file).reactions


@pytest.mark.parametrize("name", TEXTS)
@given(data=st.data())
@settings(max_examples=60)
def test_a_misspelt_key_is_named(name, file, data):
    path = data.draw(st.sampled_from(list(keys(PLAIN[name]))))
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
