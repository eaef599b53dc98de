"""YAML documents as trees in which every value knows its place: file, line and dotted path.

Documents are external data: size, depth and number of nodes are limited, tags and repeated keys are refused, and
nothing is evaluated. In a list of laws an item's path is its name, ``interface.friction.coulomb``, and
``interface.friction.coulomb[2]`` for the second of that name.

Overrides such as ``bodies.lower.C=2 kJ/m^2/K`` are applied to a document before it is read.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from io import StringIO
from numbers import Integral, Real
from pathlib import Path
from typing import Any, NamedTuple

from surfacechem.contracts.units import plain_values
from surfacechem.errors import InputError, Place, expect, nearest, refuse_unknown, suggestion

# Largest depth of nested mappings and lists.
MOST_NESTED = 24


class Limits(NamedTuple):
    """Limits on the size of a document."""

    largest: int = 1_000_000
    """Largest size in bytes."""
    most: int = 20_000
    """Largest number of values, with those that aliases repeat; reading them takes some 2 s."""


# Limits of a case; longer tables belong into separate files.
LIMITS = Limits()

# Name of the file in messages about a value that the user has set from outside the document.
OVERRIDE = "override"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*([-_][A-Za-z0-9]+)*")
_INTEGER = re.compile(r"[-+]?[0-9]{1,15}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = {".inf": "inf", "+.inf": "inf", "-.inf": "-inf", ".nan": "nan"}
_SCALAR_WORDS = {"": None, "~": None, "null": None, "true": True, "false": False}


class Tree(NamedTuple):
    """A value and its place: a scalar, a list of trees or a mapping of trees."""

    value: Any
    place: Place

    def plain(self) -> Any:
        """Return the value without places."""
        if isinstance(self.value, dict):
            return {key: tree.plain() for key, tree in self.value.items()}
        if isinstance(self.value, list):
            return [tree.plain() for tree in self.value]
        return self.value

    def error(self, message: str) -> InputError:
        """Return an input error at this place."""
        return InputError(message, self.place)

    @property
    def shown(self) -> str:
        """The value as written in messages."""
        kinds = {dict: "a mapping", list: "a list", type(None): "nothing", bool: str(self.value).lower()}
        return kinds.get(type(self.value)) or f"'{str(self.value)[:40]}'"

    def mapping(
        self, known: Iterable[str] | None = None, what: str = "keys", elsewhere: Mapping[str, str] | None = None
    ) -> dict[str, Tree]:
        """Return the entries of a mapping, which may be empty; InputError for unknown keys, with the place of those
        that belong ``elsewhere``.
        """
        if self.value is None:
            return {}
        allowed = None if known is None else list(known)
        if not isinstance(self.value, dict):
            wanted = f" with the {what} {', '.join(allowed)}" if allowed else ""
            if allowed and len(allowed) == 1 and isinstance(self.value, str):
                wanted = f", `{{{allowed[0]}: {self.value}}}`"
            raise self.error(f"this must be a mapping{wanted}, not {self.shown}.")
        for key, child in self.value.items():
            if allowed is not None and key not in allowed:
                place = replace(child.place, path=self.place.path)
                home = (elsewhere or {}).get(key)
                hint = f" It belongs {home}; see to its indentation." if home else suggestion(key, allowed)
                raise InputError(f"unknown key '{key}'.{hint}", place)
        return dict(self.value)

    def items(self, example: str = "") -> list[Tree]:
        """Return the items of a list, which may be empty."""
        if self.value is None:
            return []
        if not isinstance(self.value, list):
            hint = f", for example `{example}`" if example else ""
            raise self.error(f"this must be a list{hint}, not {self.shown}.")
        return list(self.value)

    def text(self, what: str) -> str:
        """Return a text that is not empty."""
        if self.value is None or (isinstance(self.value, str) and not self.value.strip()):
            raise self.error(f"{what} is empty; give a text, or leave the key out.")
        if not isinstance(self.value, str):
            raise self.error(f"{what} must be a text, not {self.shown}.")
        return self.value

    def choice(self, what: str, known: Iterable[str]) -> str:
        """Return one of some names."""
        options = list(known)
        if self.value is None or isinstance(self.value, dict | list):
            raise self.error(f"the {what} must be a name, not {self.shown}.{suggestion('', options)}")
        if not isinstance(self.value, str) or self.value not in options:
            raise self.error(f"no {what} {self.shown}.{suggestion(str(self.value), options)}")
        return self.value

    def walk(self) -> Iterator[Tree]:
        """Yield every tree below this one, and itself last."""
        children = self.value.values() if isinstance(self.value, dict) else self.value
        for child in children if isinstance(self.value, dict | list) else ():
            yield from child.walk()
        yield self


def read(path: Path, name: str = "", limits: Limits = LIMITS) -> str:
    """Read the text of a file; ``name`` replaces its path in messages."""
    place = Place(name or str(path))
    try:
        if not path.is_file():
            kind = "a folder" if path.is_dir() else "no file" if not path.exists() else "no ordinary file"
            raise InputError(f"this is {kind}; a YAML file is needed.", place)
        with path.open("rb") as file:
            data = file.read(limits.largest + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}.", place) from None
    if len(data) > limits.largest:
        raise InputError(f"larger than {limits.largest} bytes.", place)
    return decoded(data, place)


def decoded(data: bytes, place: Place) -> str:
    """Decode a text in UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        message = "no text in UTF-8; cases are YAML files, tables CSV; a dataset is read by `plot` and `rerun`."
        raise InputError(message, place) from None


def is_file(path: Path) -> bool:
    """True if there is a file; also for paths that are invalid."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def file_in(folder: Path, name: str, place: Place) -> Path | None:
    """Return the file of a name in a folder, None if there is none.

    A document may come from an untrusted source, so that a file that it names is read only from its folder or below; a
    file elsewhere must be named by the user.
    """
    path = folder / name
    if not is_file(path):
        return None
    if place.file != OVERRIDE and not path.resolve().is_relative_to(folder.resolve()):
        remedy = f"Put it there, or name it yourself: --set {place.path}=..."
        raise InputError(f"{name} lies outside the folder of the case. {remedy}", place)
    return path


def named(tree: Tree, base: str | Path, what: str) -> Path:
    """Return the file in a folder that a value names; InputError, with the description ``what``, if there is none."""
    name = tree.text(what)
    path = file_in(Path(base), name, tree.place)
    if path is None:
        like = nearest(name, [other.name for other in Path(base).glob(f"*{Path(name).suffix}")])
        raise tree.error(f"no file {name} beside the case.{like}")
    return path


def parse(text: str, file: str = "") -> Tree:
    """Parse a YAML document into a tree.

    >>> parse("bodies: {lower: {C: 1e3}}").plain()
    {'bodies': {'lower': {'C': 1000.0}}}
    """
    return with_paths(build(text, file))


def build(text: str, file: str = "", limits: Limits = LIMITS) -> Tree:
    """Build the tree of a YAML document without paths."""
    if len(text) > limits.largest:
        raise InputError(f"larger than {limits.largest} bytes.", Place(file))
    return _Builder(text, file, limits).document()


def dump(tree: Tree) -> str:
    """Return the tree as YAML text."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    plain = tree.plain()
    # ruamel breaks long lines of multi-line texts, of source code for instance, and some come back with an extra space.
    yaml.width = sys.maxsize if "\\n" in repr(plain) else 120
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    stream = StringIO()
    yaml.dump(plain, stream)
    return stream.getvalue()


def scalar(text: str) -> Any:
    """Return the value of an unquoted scalar by the core schema of YAML 1.2.

    >>> scalar("1e18"), scalar("no"), scalar("3 m")
    (1e+18, 'no', '3 m')
    """
    low = text.lower()
    if low in _SCALAR_WORDS:
        return _SCALAR_WORDS[low]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    return float(_NOT_FINITE[low]) if low in _NOT_FINITE else text


class _Builder:
    """Builder of a tree from the events of the parser, so that limits apply before anything is expanded."""

    def __init__(self, text: str, file: str, limits: Limits) -> None:
        self.file, self.most = file, limits.most
        self.events = self._events(text)
        self.anchors: dict[str, tuple[Tree, int]] = {}
        self.count = 0

    def _events(self, text: str) -> Iterator[Any]:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import MarkedYAMLError
        from ruamel.yaml.reader import ReaderError
        from ruamel.yaml.scanner import ScannerError

        try:
            yield from YAML(typ="safe", pure=True).parse(StringIO(text))
        except ReaderError as error:
            line = text.count("\n", 0, error.position) + 1
            raise InputError("a control character, which YAML does not allow.", Place(self.file, line)) from None
        except MarkedYAMLError as error:
            # What the scanner misses it misses later: of a `key:value` without a space in the next line.
            begun = error.context_mark if isinstance(error, ScannerError) else None
            mark = begun or error.problem_mark or error.context_mark
            message = " ".join(", ".join(part for part in (error.context, error.problem) if part).split())
            place = Place(self.file, mark.line + 1 if mark else 0)
            raise InputError(f"not YAML: {message.rstrip('.')}.", place) from None
        except Exception as error:  # only the parser runs here, and it may also fail by assertions
            message = " ".join(str(error).split())
            raise InputError(f"not YAML: {message.rstrip('.')}.", Place(self.file)) from None

    def document(self) -> Tree:
        """Return the only document of the text."""
        next(self.events)
        if type(next(self.events)).__name__ == "StreamEndEvent":
            raise InputError("the file is empty.", Place(self.file))
        tree = self._value(next(self.events), 0)
        next(self.events)
        extra = next(self.events)
        if type(extra).__name__ != "StreamEndEvent":
            raise InputError("more than one document.", self._place(extra))
        return tree

    def _place(self, event: Any) -> Place:
        return Place(self.file, event.start_mark.line + 1, column=event.start_mark.column)

    def _value(self, event: Any, depth: int) -> Tree:
        place, before, kind = self._place(event), self.count, type(event).__name__
        self.count += 1
        if self.count > self.most:
            remedy = "Tables belong into CSV files, `table: {file: NAME.csv}`; of outputs give a number, `outputs: N`."
            raise InputError(f"more than {self.most} values. {remedy}", place)
        if depth > MOST_NESTED:
            raise InputError(f"nested deeper than {MOST_NESTED} levels.", place)
        if getattr(event, "tag", None) is not None:
            raise InputError(f"a tag ({event.tag}), which is not allowed.", place)
        if kind == "AliasEvent":
            if event.anchor not in self.anchors:
                raise InputError(f"the alias *{event.anchor} has no anchor before it.", place)
            known, size = self.anchors[event.anchor]
            self.count += size  # repeated values count like written ones
            if self.count > self.most:
                raise InputError(f"aliases repeat more than {self.most} values.", place)
            return known._replace(place=place)
        if kind == "ScalarEvent":
            tree = Tree(scalar(event.value) if event.implicit[0] else event.value, place)
        elif kind == "SequenceStartEvent":
            tree = Tree([], place)
            while type(item := next(self.events)).__name__ != "SequenceEndEvent":
                tree.value.append(self._value(item, depth + 1))
        else:
            tree = Tree(self._mapping(depth), place)
        if event.anchor is not None:  # registered only now, so that nothing contains itself
            self.anchors[event.anchor] = tree, self.count - before
        return tree

    def _mapping(self, depth: int) -> dict[str, Tree]:
        """Return the entries of a mapping; the place of a value is that of its key."""
        result: dict[str, Tree] = {}
        while type(event := next(self.events)).__name__ != "MappingEndEvent":
            place = self._place(event)
            if type(event).__name__ != "ScalarEvent":
                raise InputError("a key must be a name.", place)
            if event.value in result:
                first = result[event.value].place.line
                raise InputError(f"the key '{event.value}' is given twice, first in line {first}.", place)
            result[event.value] = self._value(next(self.events), depth + 1)._replace(place=place)
        return result


def labels(items: Iterable[Tree]) -> list[str | None]:
    """Return the name of each list item in paths: that of a law, numbered from the second of a name on; else None."""
    seen: dict[str, int] = {}
    result: list[str | None] = []
    for item in items:
        single = isinstance(item.value, dict) and len(item.value) == 1
        name = next(iter(item.value)) if single else item.value
        if not (isinstance(name, str) and _NAME.fullmatch(name)):
            result.append(None)
            continue
        seen[name] = seen.get(name, 0) + 1
        result.append(name if seen[name] == 1 else f"{name}[{seen[name]}]")
    return result


def with_paths(tree: Tree, path: str = "") -> Tree:
    """Return the tree with the path of every value."""
    place = replace(tree.place, path=path)
    if isinstance(tree.value, dict):
        return Tree({key: with_paths(child, join(path, key)) for key, child in tree.value.items()}, place)
    if not isinstance(tree.value, list):
        return Tree(tree.value, place)
    items = []
    for i, (item, label) in enumerate(zip(tree.value, labels(tree.value), strict=True), start=1):
        own = join(path, label or f"[{i}]")
        if isinstance(item.value, dict) and len(item.value) == 1:  # a law, whose parameters are below its label
            ((name, inner),) = item.value.items()
            items.append(Tree({name: with_paths(inner, own)}, replace(item.place, path=own)))
        else:
            items.append(with_paths(item, own))
    return Tree(items, place)


def join(path: str, key: str) -> str:
    """Return the path of a key below a path."""
    return path + key if key.startswith("[") or not path else f"{path}.{key}"


def from_plain(value: object, place: Place) -> Tree:
    """Return a tree of plain Python data at one place, in which keys of mappings continue its path."""
    if hasattr(value, "ndim"):  # an array of NumPy, xarray or Pint
        value = plain_values(value)
    if isinstance(value, Mapping):
        entries = ((str(key), item) for key, item in value.items())
        return Tree({key: from_plain(item, replace(place, path=join(place.path, key))) for key, item in entries}, place)
    if isinstance(value, list | tuple):
        return Tree([from_plain(item, place) for item in value], place)
    if isinstance(value, Real) and not isinstance(value, bool):  # NumPy's numbers too
        return Tree(int(value) if isinstance(value, Integral) else float(value), place)
    if value is not None and not isinstance(value, str | bool):
        message = f"a case holds numbers, texts, lists and mappings, not {type(value).__name__}."
        raise InputError(message, place)
    return Tree(value, place)


# Keys of a value that may also be given without its key.
VALUE_KEYS = ("level", "value", "rises-to")

# Values that remove a key or a law.
EMPTY_VALUES = (None, "")

# Sections that may be a single value, and the key for which that stands.
SHORTHAND_KEYS = {"interface.mechanism": "file"}


CHANGES = "changes are texts `path=value`, or values by path"
"""What messages say of changes that are something else."""


def overridden(tree: Tree, overrides: str | Sequence[str] | Mapping[str, object]) -> Tree:
    """Return the tree with the given values; texts are "path=value" with the value in YAML.

    A number for a varying parameter replaces its value and keeps its factors. An empty value, or null, removes the key
    or the law.

    >>> overridden(parse("run: {until: 5 s, rtol: 1e-6}"), ["run.until=7 s", "run.rtol="]).plain()
    {'run': {'until': '7 s'}}
    """
    for path, value in _pairs(overrides):
        tree = _set(tree, path.split("."), value, Place(OVERRIDE, 0, path))
    return with_paths(tree)


def assignments(texts: str | Sequence[str] | Mapping[str, object]) -> dict[str, object]:
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
    expect(path, str, CHANGES, Place(OVERRIDE))
    above, _, last = path.rpartition(".")
    others = [path, f"{path}.level", *([above] if last in VALUE_KEYS else [])]
    return next((other for other in others if other in known), path)


def _pairs(overrides: str | Sequence[str] | Mapping[str, object]) -> Iterator[tuple[str, Tree]]:
    expect(overrides, (str, Collection), CHANGES, Place(OVERRIDE))
    given: list[tuple[str, object]] = list(overrides.items()) if isinstance(overrides, Mapping) else []
    for text in () if isinstance(overrides, Mapping) else as_texts(overrides):
        expect(text, str, CHANGES, Place(OVERRIDE))
        path, equals, after = text.partition("=")
        if not equals or not path.strip():
            raise InputError(f"'{text}' is not of the form path=value, for example `run.until=5 s`.", Place(OVERRIDE))
        given.append((path.strip(), after))
    for path, value in given:
        expect(path, str, CHANGES, Place(OVERRIDE))
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
        return tree._replace(value={**tree.value, "value": new}) if varies and bare else new
    if isinstance(tree.value, list):
        return _set_item(tree, keys, new, place)
    (first, *rest), removes = keys, len(keys) == 1 and new.value in EMPTY_VALUES
    if not rest and first in VALUE_KEYS and not (isinstance(tree.value, dict) or removes):
        return new  # a value without key is, for example, the level of a constant history
    known = _entries(tree, place)
    if not removes:
        return tree._replace(value={**known, first: _set(known.get(first, Tree(None, place)), rest, new, place)})
    refuse_unknown([first], known, "there is no '{}' to remove", place)
    kept = dict(known)
    del kept[first]
    return tree._replace(value=kept)


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
    refuse_unknown([wanted], [*filter(None, known)], f"nothing is called '{{}}' in {tree.place.path}", place)
    index = known.index(wanted)
    item, changed = tree.value[index], [] if new.value in EMPTY_VALUES else [new]
    if len(keys) > 1:
        whole = item.value if isinstance(item.value, dict) else {item.value: Tree(None, item.place)}
        ((name, inner),) = whole.items()
        changed = [item._replace(value={name: _set(inner, keys[1:], new, place)})]
    return tree._replace(value=[*tree.value[:index], *changed, *tree.value[index + 1 :]])
