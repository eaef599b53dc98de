"""Overrides such as ``bodies.lower.C=2 kJ/m^2/K``, applied to a document before it is read."""

from __future__ import annotations

import json
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace

from surfacechem.documents.document import OVERRIDE, Tree, from_plain, labels, parse, with_paths
from surfacechem.errors import InputError, Place, refuse_unknown, suggestion

# Keys of a value that may also be given without its key.
VALUE_KEYS = ("level", "value", "rises-to")

# Values that remove a key or a law.
EMPTY_VALUES = (None, "")

# Sections that may be a single value, and the key for which that stands.
SHORTHAND_KEYS = {"interface.mechanism": "file"}


def apply(tree: Tree, overrides: str | Sequence[str] | Mapping[str, object]) -> Tree:
    """Return the tree with the given values; texts are "path=value" with the value in YAML.

    A number for a varying parameter replaces its value and keeps its factors. An empty value, or null, removes the key
    or the law.

    >>> apply(parse("run: {until: 5 s, rtol: 1e-6}"), ["run.until=7 s", "run.rtol="]).plain()
    {'run': {'until': '7 s'}}
    """
    for path, value in _pairs(overrides):
        place = Place(OVERRIDE, 0, path)
        tree = _set(tree, path.split("."), value, place)
    return with_paths(tree)


def assignments(texts: Sequence[str]) -> dict[str, object]:
    """Return texts "path=value" as plain values; InputError if a path is given twice.

    >>> assignments(["f=3 pN", "g=[1, 2]"])
    {'f': '3 pN', 'g': [1, 2]}
    """
    found: dict[str, object] = {}
    for path, tree in _pairs(texts):
        if path in found:
            raise InputError("it is given twice.", Place(OVERRIDE, 0, path))
        found[path] = tree.plain()
    return found


def as_texts(overrides: str | Sequence[str] | Mapping[str, object]) -> list[str]:
    """Return overrides as texts "path=value" with the same effect.

    >>> as_texts({"f": 3e-12, "reference": None, "loading.v": {"level": "3 nm/s"}})
    ['f=3e-12', 'reference=null', 'loading.v={"level": "3 nm/s"}']
    """
    if not isinstance(overrides, Mapping):
        return [overrides] if isinstance(overrides, str) else list(overrides)
    # Texts are read as YAML, of which JSON is a subset; from_plain converts NumPy's numbers to plain ones.
    plain = {p: v if isinstance(v, str) else json.dumps(from_plain(v, Place()).plain()) for p, v in overrides.items()}
    return [f"{path}={text}" for path, text in plain.items()]


def parameter_path(path: str, known: Container[str]) -> str:
    """Return the known path of a parameter, whose value may be given with or without its key.

    >>> parameter_path("loading.v", {"loading.v.level"}), parameter_path("friction.mu.value", {"friction.mu"})
    ('loading.v.level', 'friction.mu')
    """
    above, _, last = path.rpartition(".")
    others = [path, f"{path}.level", *([above] if last in VALUE_KEYS else [])]
    if path.startswith("mechanism."):  # the path in datasets of version 0.1
        others.append(f"interface.mechanism.reactions.{path.removeprefix('mechanism.')}")
    return next((other for other in others if other in known), path)


def _pairs(overrides: str | Sequence[str] | Mapping[str, object]) -> Iterator[tuple[str, Tree]]:
    given: list[tuple[str, object]] = list(overrides.items()) if isinstance(overrides, Mapping) else []
    for text in () if isinstance(overrides, Mapping) else as_texts(overrides):
        path, equals, after = text.partition("=")
        if not equals or not path.strip():
            raise InputError(f"'{text}' is not of the form path=value, for example `run.until=5 s`.", Place(OVERRIDE))
        given.append((path.strip(), after))
    for path, value in given:
        place = Place(OVERRIDE, 0, path)
        try:
            plain = parse(value).plain() if isinstance(value, str) and value.strip() else value
        except InputError as error:
            raise InputError(error.message, place) from None
        yield path, from_plain(plain, place)


def _set(tree: Tree, keys: Sequence[str], new: Tree, place: Place) -> Tree:
    """Return the tree with a new value below it, or with the value removed if the new one is empty."""
    if not keys:  # a number for a varying parameter keeps its factors
        varies = isinstance(tree.value, dict) and {"value", "times"} >= set(tree.value) >= {"value"}
        bare = not isinstance(new.value, dict | list)
        return replace(tree, value={**tree.value, "value": new}) if varies and bare else new
    if isinstance(tree.value, list):
        return _set_item(tree, keys, new, place)
    (first, *rest), removes = keys, len(keys) == 1 and new.value in EMPTY_VALUES
    if not rest and first in VALUE_KEYS and not (isinstance(tree.value, dict) or removes):
        return new  # a value without key is, for example, the level of a constant history
    known = _entries(tree, place)
    if not removes:
        return replace(tree, value={**known, first: _set(known.get(first, Tree(None, place)), rest, new, place)})
    refuse_unknown([first], known, "there is no '{}' to remove", place)
    kept = dict(known)
    del kept[first]
    return replace(tree, value=kept)


def _entries(tree: Tree, place: Place) -> Mapping[str, Tree]:
    """Return the keys of a mapping, also of a single value that stands for one, or of nothing."""
    if isinstance(tree.value, str) and tree.place.path in SHORTHAND_KEYS:
        return {SHORTHAND_KEYS[tree.place.path]: tree}
    if tree.value is not None and not isinstance(tree.value, dict):
        raise InputError(f"{tree.place.path or 'the document'} is a value, not a mapping.", place)
    return tree.value or {}


def _set_item(tree: Tree, keys: Sequence[str], new: Tree, place: Place) -> Tree:
    """Set a value below an item ``name: {...}`` or a bare name of a list, which is found by its label."""
    known = labels(tree.value)
    wanted = keys[0].removesuffix("[1]")
    if wanted not in known:
        names = [label for label in known if label]
        raise InputError(f"nothing is called '{keys[0]}' in {tree.place.path}.{suggestion(keys[0], names)}", place)
    index = known.index(wanted)
    item, changed = tree.value[index], [] if new.value in EMPTY_VALUES else [new]
    if len(keys) > 1:
        whole = item.value if isinstance(item.value, dict) else {item.value: Tree(None, item.place)}
        ((name, inner),) = whole.items()
        changed = [replace(item, value={name: _set(inner, keys[1:], new, place)})]
    return replace(tree, value=[*tree.value[:index], *changed, *tree.value[index + 1 :]])
