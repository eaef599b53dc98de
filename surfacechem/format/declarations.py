"""Declaration of a section of the case format: its keys, the content of each, and the default of a key left out.

A section is a class whose fields are its keys; a law is one, too, by its parameters and options. Reader, strict checks
of keys and values, JSON Schema and the tables of the documentation follow from the contents of the keys.

>>> from surfacechem.documents.document import parse
>>> class Oven(Section):
...     T: float = quantity("K", "temperature", REQUIRED, above=0)
...     steps: int = key(Integer(1), "number of steps", 3)
>>> oven = read(Oven, parse("{T: 25 degC}"), Context())
>>> oven.T, oven.steps
(298.15, 3)
"""

from __future__ import annotations

import dataclasses
import math
import re
import typing
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, field
from functools import cache
from typing import Any, ClassVar, NamedTuple, TypeVar

from surfacechem import laws
from surfacechem.contracts.terms import Factor, Law, Load, Spec, Varying, resolved_unit
from surfacechem.contracts.units import TOTAL_UNITS, ZERO_CELSIUS, dimension, quotient
from surfacechem.contracts.units import parse as si
from surfacechem.documents.document import OVERRIDE, Tree
from surfacechem.errors import InputError, Place, placed
from surfacechem.format import data_files
from surfacechem.quantities import INTERNAL, VARIABLES

Schema = dict[str, Any]

# A number, with or without a unit.
QUANTITY = r"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*(\S.*)?$"

# Default of a required key.
REQUIRED = MISSING

# Names of temperatures start with T, so that they never coincide with another quantity.
NODE_NAME = re.compile(r"T[A-Za-z0-9_]*")

# Largest number of laws in a list: all may have the same name, and names are numbered up to a thousand.
MOST_LAWS = 500

# Parameters that are differences of their variable, for which degrees Celsius have no zero.
DIFFERENCES = ("amplitude",)

KELVIN = VARIABLES["T_c"].unit

UNITS = {name: variable.unit for name, variable in VARIABLES.items() if name not in INTERNAL}


class Context(NamedTuple):
    """Names that a case has given, to which its other sections may refer."""

    units: Mapping[str, str] = UNITS
    """Unit of each variable."""
    temperatures: Sequence[str] = ()
    bodies: Sequence[str] = ()
    x: str = "1"
    """Unit for which "[x]" stands."""
    whole: bool = False
    """True if quantities per area elsewhere are those of the whole pair of bodies."""
    remarks: dict[str, None] | None = None
    """What is told of values that may not be meant as they are read, in order; None where nothing is told."""

    def judge(self, tree: Tree, spec: Spec, value: float) -> None:
        """Remark on a temperature without a unit that is below 0 degC: it may be meant in degrees Celsius."""
        # What may be zero kelvin is no temperature but a coefficient.
        absolute, celsius = spec.unit == KELVIN and spec.at_least < 0, value - float(ZERO_CELSIUS)
        if self.remarks is not None and absolute and celsius < 0 < value and not str(tree.value).strip()[-1].isalpha():
            bare = f"{tree.place.path}: {value:g} without a unit is {value:g} K, which is {celsius:.6g} degC"
            self.remarks[f"{bare}; write `{value:g} K`, or `{value:g} degC` if that is meant"] = None


# -- contents of keys -------------------------------------------------------------------------------------------------


class Content(ABC):
    """Content of a key: how it is read and which values are valid."""

    @abstractmethod
    def read(self, tree: Tree, name: str, context: Context) -> Any:
        """Return the value; InputError with its place if it is invalid."""

    definition: ClassVar[str] = ""
    """Name of its definition in the schema."""

    def schema(self) -> Schema:
        """Return the JSON Schema of valid values."""
        return reference(self.definition)


@dataclass(frozen=True)
class Number(Content):
    """A number with a unit, in a range, or a word instead of it; a varying number is a value times factors."""

    spec: Spec
    difference: bool = False
    word: str = ""
    wanted: str = ""
    """Description of the expected content, for the message about a mapping."""

    def read(self, tree: Tree, name: str, context: Context) -> float | Varying | str:
        """Return the value in SI, or the word."""
        if self.word and tree.value == self.word:
            return self.word
        if self.word and isinstance(tree.value, str) and tree.value.isalpha():
            raise tree.error(f"{name} is a number with a unit or `{self.word}`, not {tree.shown}.")
        if self.wanted and isinstance(tree.value, dict):
            raise tree.error(f"{self.wanted}, not {tree.shown}.")
        spec = self.spec.resolved(context.x)
        if context.whole:
            spec = spec._replace(unit=TOTAL_UNITS.get(spec.unit, spec.unit))
        if not isinstance(tree.value, dict) or not (spec.varies or "value" in tree.value):
            return number(tree, spec, name, context, difference=self.difference)
        return self._varying(tree, spec, name, context)

    @staticmethod
    def _varying(tree: Tree, spec: Spec, name: str, context: Context) -> float | Varying:
        """Return a value with its factors, which are given by a mapping."""
        if not spec.varies:
            raise tree.error(f"{name} cannot vary; give it a value.")
        parts = tree.mapping(["value", "times"])
        if "value" not in parts:
            raise tree.error(f"{name} needs `value`: {dimension(spec.unit)}.")
        value = number(parts["value"], spec, name, context)
        factors = ListOf(OneLaw(Factor)).read(parts["times"], "times", context) if "times" in parts else None
        return value if factors is None else Varying(value, factors)

    def schema(self) -> Schema:
        """Return the schema: a number in its range or a text with a unit; a value with factors; the word."""
        spec = self.spec
        bare = _bounded({"type": "number"}, exclusiveMinimum=spec.above, minimum=spec.at_least, maximum=spec.at_most)
        kinds: list[Schema] = [bare, {"type": "string", "pattern": QUANTITY}]
        if spec.varies:
            factors = {"type": "array", "items": reference(Factor.contract)}
            kinds.append(closed({"value": reference("quantity"), "times": factors}, required=("value",)))
        kinds += [{"const": self.word}] if self.word else []
        return {"anyOf": kinds} if len(bare) > 1 or len(kinds) > 2 else reference("quantity")


def number(tree: Tree, spec: Spec, name: str, context: Context | None = None, *, difference: bool = False) -> float:
    """Return a number in SI, in the range of its specification."""
    value = si(tree.plain(), spec.unit, tree.place, name, difference=difference)
    with placed(tree.place):
        spec.check(name, value)
    if context is not None and not difference:
        context.judge(tree, spec, value)
    return value


@dataclass(frozen=True)
class Integer(Content):
    """A whole number in a range, or a word instead of it."""

    at_least: int
    at_most: float = math.inf
    step: int = 1
    word: str = ""
    wanted: str = ""
    """Description of the expected content, for the message if it is no number."""

    def read(self, tree: Tree, name: str, context: Context) -> int | str:
        """Return the number, which may be written with an exponent, or the word."""
        if self.word and isinstance(tree.value, str) and not tree.value.isdigit():
            return tree.choice(f"choice of {name}", [self.word])
        if self.wanted and not str(tree.value).strip("+-. ")[:1].isdigit():
            raise tree.error(f"{self.wanted}, not {tree.shown}.")
        value = number(tree, Spec("1", name, at_least=self.at_least, at_most=self.at_most), name)
        if not value.is_integer():
            raise tree.error(f"{name} must be a whole number, got {value:g}.")
        return int(value)

    def schema(self) -> Schema:
        """Return the schema: an integer, or its digits as text."""
        whole = _bounded({"type": "integer"}, minimum=self.at_least, maximum=self.at_most)
        whole |= {"multipleOf": self.step} if self.step > 1 else {}
        word = [{"const": self.word}] if self.word else []
        return {"anyOf": [whole, {"type": "string", "pattern": "^[0-9]+$"}, *word]}


def _bounded(schema: Schema, **limits: float) -> Schema:
    return schema | {name: bound for name, bound in limits.items() if math.isfinite(bound)}


@dataclass(frozen=True)
class Text(Content):
    """A text."""

    def read(self, tree: Tree, name: str, context: Context) -> str:
        """Return the text without surrounding white space."""
        return tree.text(name).strip()

    def schema(self) -> Schema:
        """Return the schema: a string that is not empty."""
        return {"type": "string", "pattern": r"\S"}


@dataclass(frozen=True)
class OneOf(Content):
    """One of some names, which are computed when needed."""

    what: str
    names: Callable[[], Iterable[str]]
    has: Callable[[str], bool] | None = None
    """Test of a single name, if listing all of them takes long."""

    def knows(self, value: object) -> bool:
        """True for one of the names."""
        return isinstance(value, str) and (self.has(value) if self.has else value in self.names())

    def read(self, tree: Tree, name: str, context: Context) -> str:
        """Return the name."""
        return str(tree.value) if self.knows(tree.value) else tree.choice(self.what, self.names())

    def schema(self) -> Schema:
        """Return an enumeration."""
        return {"enum": list(self.names())}


@dataclass(frozen=True)
class ListOf(Content):
    """A list of ``count`` entries, or of any number."""

    content: Content
    example: str = ""
    count: int | None = None
    at_least: int = 0
    """Least number of entries in the schema; the reader gives the reason when they are missing."""

    def read(self, tree: Tree, name: str, context: Context) -> tuple[Any, ...]:
        """Return its entries."""
        law = self.content if isinstance(self.content, OneLaw) else None
        entries = tree.items(law.example if law and not isinstance(tree.value, list) else self.example)
        if self.count is not None and len(entries) != self.count:
            raise tree.error(f"{name} needs {self.count} entries, got {len(entries)}.")
        if law and len(entries) > MOST_LAWS:
            raise entries[MOST_LAWS].error(f"more than {MOST_LAWS} laws in a list.")
        return tuple(self.content.read(entry, f"an entry of {name}", context) for entry in entries)

    def schema(self) -> Schema:
        """Return the schema of an array; one that may be empty may be left out."""
        least = self.count or self.at_least
        limits = {"minItems": least} if least else {}
        limits |= {"maxItems": self.count} if self.count else {}
        return {"type": "array" if least else ["array", "null"], "items": self.content.schema(), **limits}


@dataclass(frozen=True)
class OneLaw(Content):
    """A law of a contract, ``name: {parameters}``, or its name alone if it needs none."""

    contract: type[Law]

    @property
    def example(self) -> str:
        """A law of this contract as in a list, with its required parameters, or with its first one."""
        first = next(iter(laws.laws(self.contract).values()))
        needed = [name for name, declared in law_keys(first).items() if declared.required]
        needed = needed or [name for name, _ in first.specs()][:1]
        return f"- {first.name()}: {{{', '.join(f'{name}: ...' for name in needed)}}}"

    def read(self, tree: Tree, name: str, context: Context) -> Any:
        """Return the law, with its place."""
        if isinstance(tree.value, dict) and len(tree.value) == 1:
            ((law, parameters),) = tree.value.items()
        elif isinstance(tree.value, str) and tree.value:
            law, parameters = tree.value, Tree(None, tree.place)
        else:
            several = ", ".join(map(str, tree.value)) if isinstance(tree.value, dict) else ""
            given = f"several: {several}" if several else tree.shown
            raise tree.error(f"a law is one entry, `name: {{parameters}}`, not {given}.")
        with placed(tree.place):
            found = laws.find(self.contract, law)
        return read_law(found, parameters, context)

    def schema(self) -> Schema:
        """Return a reference to the definition of the contract."""
        return reference(self.contract.contract)


@dataclass(frozen=True)
class Prescribed(Content):
    """A prescribed history of a variable; a bare value is a constant."""

    unit: str = "[x]"
    above_zero: bool = False
    definition: ClassVar[str] = "history"

    def read(self, tree: Tree, name: str, context: Context) -> Load:
        """Return the load."""
        unit = resolved_unit(self.unit, context.x)
        load: Load | None = data_files.table(tree, unit)
        if load is None and isinstance(tree.value, dict):
            load = OneLaw(Load).read(tree, name, context._replace(x=unit))
        elif load is None:
            try:
                level = number(tree, Spec(unit, name), name, context)
            except InputError as error:
                with suppress(InputError):  # a rate instead of a value means a ramp
                    si(tree.plain(), quotient(unit, "s"))
                    hint = f"To change it in time, write `{{ramp: {{rate: {tree.value}}}}}`."
                    error = InputError(f"{error.message} {hint}", tree.place)
                raise error from None
            load = laws.find(Load, "hold")(level=level, place=tree.place)  # type: ignore[call-arg, assignment]
        assert load is not None
        start = load.at_start() if self.above_zero else 1.0
        if not start > 0:
            raise tree.error(f"{start:g} K is not an absolute temperature above zero.")
        return load


@dataclass(frozen=True)
class Temperature(Content):
    """The name of a temperature that is solved for, or a history."""

    definition: ClassVar[str] = "temperature"

    def read(self, tree: Tree, name: str, context: Context) -> str | Load:
        """Return the name or the load."""
        value = tree.value
        if not is_name(tree):
            return Prescribed("K", above_zero=True).read(tree, name, context)
        if not NODE_NAME.fullmatch(value) or value == "T_0":
            plain = "use T, followed by letters from A to Z, digits or _, for example T_plate"
            hint = "T_0 is the reference temperature" if value == "T_0" else plain
            raise tree.error(f"'{value}' cannot name a temperature: {hint}.")
        return str(value)


def is_name(tree: Tree | None) -> bool:
    """True if a temperature is given by name."""
    return tree is not None and isinstance(tree.value, str) and tree.value.isidentifier()


@dataclass(frozen=True)
class Nested(Content):
    """A section inside another, or the parameters of a law of a known class."""

    cls: type[Section] | type[Law]
    per_area: bool = False
    """True if its quantities per area are so in every scene."""

    def read(self, tree: Tree, name: str, context: Context) -> Any:
        """Return the section or the law."""
        context = context._replace(whole=False) if self.per_area else context
        return read(self.cls, tree, context) if issubclass(self.cls, Section) else read_law(self.cls, tree, context)

    def schema(self) -> Schema:
        """Return the schema of its keys."""
        return schema_of(self.cls)


@dataclass(frozen=True)
class Entries(Content):
    """A mapping whose keys are names: of bodies, variables, species, stages.

    ``each`` has the keys known beforehand, ``others`` the content under a name of the case, which ``names`` lists. A
    quantity in "[x]" is in the unit of the variable that is its key.
    """

    each: Mapping[str, Key] = field(default_factory=dict)
    others: Content | None = None
    names: Callable[[Context], Iterable[str]] | None = None
    pattern: str | Callable[[], str] = ""
    """Regular expression of these other names."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Units of names that are no variables of the case."""
    what: str = "keys"
    by_scene: bool = False
    """True if the scene refuses unknown names, as it knows which ones it has."""
    at_most: int | None = None
    """Largest number of entries; if it is given, at least one is needed."""
    wanted: str = ""
    """Description of the expected entries, for the message if there are none or too many."""
    words: str = "mapping"

    def read(self, tree: Tree, name: str, context: Context) -> dict[str, Any]:
        """Return the values by name."""
        if self.wanted:
            self._check_count(tree)
        known = [*self.each, *self.names(context)] if self.names else None if self.others else [*self.each]
        units, found = {**self.units, **context.units}, {}
        for key, child in tree.mapping(None if self.by_scene else known, self.what).items():
            content = self.each[key].content if key in self.each else self.others
            if content is None or (known is not None and key not in known):
                found[key] = math.nan  # the scene refuses it with a better message
            else:
                found[key] = content.read(child, key, context._replace(x=units.get(key, "1")))
        return found

    def _check_count(self, tree: Tree) -> None:
        count = len(tree.value) if isinstance(tree.value, dict) else 0 if tree.value is None else 1
        if not (isinstance(tree.value, dict) and 1 <= count <= (self.at_most or math.inf)):
            got = "; none is given" if not count else f"; {count} are given" if count > 1 else f", not {tree.shown}"
            raise tree.error(f"{self.wanted}{got}.")

    def schema(self) -> Schema:
        """Return the schema of an object with these names."""
        found = closed({name: key.schema() for name, key in self.each.items()})
        if self.others is not None and self.pattern:
            pattern = self.pattern if isinstance(self.pattern, str) else self.pattern()
            found["patternProperties"] = {f"^{pattern}$": self.others.schema()}
        elif self.others is not None:
            found["additionalProperties"] = self.others.schema()
        return found if self.at_most is None else {**found, "minProperties": 1, "maxProperties": self.at_most}


@dataclass(frozen=True)
class ByShape(Content):
    """Content that depends on its shape: a mapping, a list, or a value."""

    value: Content | None = None
    mapping: Content | None = None
    items: Content | None = None
    wanted: str = ""
    """Description of the expected content, for the message if it has none of these shapes."""

    @property
    def contents(self) -> list[Content]:
        """Contents of all shapes."""
        return [content for content in (self.value, self.items, self.mapping) if content is not None]

    def read(self, tree: Tree, name: str, context: Context) -> Any:
        """Return the value, read by its shape."""
        shape = self.mapping if isinstance(tree.value, dict) else self.items if isinstance(tree.value, list) else None
        content = shape or self.value or self.items
        assert content is not None
        if self.wanted and isinstance(content, OneOf) and not content.knows(tree.value):
            # With several names the nearest one is a better hint than the shapes.
            misspelt = isinstance(tree.value, str) and len(list(content.names())) > 1
            if not misspelt:
                raise tree.error(f"{self.wanted}, not {tree.shown}.")
        return content.read(tree, name, context)

    def schema(self) -> Schema:
        """Return the schema of any of the shapes."""
        return {"anyOf": [content.schema() for content in self.contents]}


@dataclass(frozen=True)
class Deferred(Content):
    """Content whose units are known only when the scene is assembled."""

    content: Content

    def read(self, tree: Tree, name: str, context: Context) -> Tree:
        """Return the tree unchanged."""
        return tree

    def schema(self) -> Schema:
        """Return the schema of the final content."""
        return self.content.schema()


# -- keys and sections ------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class Key:
    """A key of a section: its content, its meaning, and its default."""

    content: Content
    text: str = ""
    default: Any = None
    name: str = ""
    attribute: str = field(default="", init=False)
    """Field of its class; empty for a key that is no field."""

    def __post_init__(self) -> None:
        """Take over the description of the parameter or the section if no other is given."""
        if not self.text and isinstance(self.content, Number):
            self.text = self.content.spec.text
        elif not self.text and isinstance(self.content, Nested):
            self.text = _first_line(self.content.cls)

    def __set_name__(self, owner: type, attribute: str) -> None:
        """Take the name of the field unless another one is given."""
        self.name, self.attribute = self.name or attribute, attribute

    @property
    def required(self) -> bool:
        """True if the key must be given."""
        return self.default is REQUIRED

    @property
    def unit(self) -> str:
        """Unit of a number; empty for other contents."""
        return self.content.spec.unit if isinstance(self.content, Number) else ""

    def meaning(self, x: str = "x") -> str:
        """Return the meaning with the unit of a number; ``x`` replaces "[x]", the unit of another variable."""
        return f"{self.text} [{resolved_unit(self.unit, x)}]" if self.unit else self.text

    def schema(self) -> Schema:
        """Return the JSON Schema of the value, with meaning and default."""
        found = {**self.content.schema(), "description": self.meaning()}
        return {**found, "default": self.default} if isinstance(self.default, str | float | int) else found


# A key as the default of its field; the annotation of the field has the type of its content.
key: Any = Key


def amount(unit: str, text: str = "", **limits: float) -> Number:
    """Return a number with a unit, in a range; ``limits`` are those of :class:`Spec`."""
    return Number(Spec(unit, text, varies=False, **limits))  # type: ignore[arg-type]


def quantity(unit: str, text: str, default: Any = None, *, name: str = "", **limits: float) -> Any:
    """Return a key for a number with a unit, in a range."""
    return Key(amount(unit, text, **limits), text, default, name)


class Section:
    """A section of a case, whose fields are its keys."""

    called: ClassVar[str] = ""
    """Subject of messages; by default the key of the section."""

    tree = Tree(None, Place())
    """The section as a tree."""
    more: Mapping[str, Any] = {}
    """Values of keys other than those that the class declares."""

    def __init__(self, **values: Any) -> None:
        for declared in keys(type(self)).values():
            setattr(self, declared.attribute, values.get(declared.attribute, declared.default))

    @classmethod
    def more_keys(cls, tree: Tree | None) -> Mapping[str, Key]:
        """Return keys in addition to those of the class: for the tree of a section, or all possible ones."""
        return {}

    @property
    def values(self) -> dict[str, Any]:
        """Values of the keys that the class declares, by field."""
        return {declared.attribute: getattr(self, declared.attribute) for declared in keys(type(self)).values()}

    def has(self, *names: str) -> bool:
        """True if any of these keys is given."""
        return isinstance(self.tree.value, dict) and any(name in self.tree.value for name in names)

    def place(self, *names: str) -> Place:
        """Return the place of one of the given keys, preferably one set from outside, else the first; without any that
        of the section.
        """
        given: list[Tree] = [self.tree.value[name] for name in names if self.has(name)]
        return min([*given, self.tree][: len(given) or 1], key=lambda tree: tree.place.file != OVERRIDE).place

    def error(self, message: str, *names: str) -> InputError:
        """Return an input error at the place of these keys."""
        return InputError(message, self.place(*names))


S = TypeVar("S", bound=Section)
L = TypeVar("L", bound=Law)


def keys(cls: type[Section]) -> Mapping[str, Key]:
    """Return the keys that a section declares, by name."""
    return {declared.name: declared for declared in vars(cls).values() if isinstance(declared, Key)}


@cache
def law_keys(law: type[Law]) -> Mapping[str, Key]:
    """Return the keys of a law by name: its options, then its parameters."""
    hints, defaults = typing.get_type_hints(law), {item.name: item.default for item in dataclasses.fields(law)}
    found = {}
    for name, meaning in law.options():
        found[name] = Key(_content_of(hints[name], name, meaning), meaning, defaults[name])
    for name, spec in law.specs():
        found[name] = Key(Number(spec, name in DIFFERENCES), spec.text, defaults[name])
    return found


def _content_of(declared: Any, name: str, meaning: str) -> Content:
    """Return the content of an option of a law, by the type of its field; the unit of numbers follows its meaning."""
    origin, arguments = typing.get_origin(declared), typing.get_args(declared)
    if declared is str:
        return Text()
    if origin is typing.Literal:
        return OneOf(name, lambda: arguments)
    if origin is tuple and Ellipsis not in arguments:
        return ListOf(Text(), count=len(arguments))
    if origin is not None and float in arguments:
        unit = re.search(r"\[([^\]]*)\]$", meaning)
        unit_text = "1" if unit is None else "[x]" if unit[1] == "x" else unit[1]
        return ListOf(Number(Spec(unit_text, name, varies=False)))
    raise TypeError(f"{name}: nothing reads {declared} off a case")


def read(cls: type[S], tree: Tree, context: Context) -> S:
    """Read a section from the mapping of its keys."""
    own, more = keys(cls), cls.more_keys(tree)
    found = _values({**own, **more}, tree, context, cls.called)
    section = cls(**{own[name].attribute: value for name, value in found.items() if name in own})
    section.tree = tree
    section.more = {name: value for name, value in found.items() if name in more}
    return section


def read_law(law: type[L], tree: Tree, context: Context) -> L:
    """Read a law from the mapping of its parameters."""
    if issubclass(law, Factor):
        of = tree.mapping().get("of", Tree(law_keys(law)["of"].default, tree.place))
        context = context._replace(x=context.units[of.choice("variable", context.units)])
    # Errors of the law as a whole are those of an entry set from outside, else its own.
    entries = tree.value.values() if isinstance(tree.value, dict) else ()
    with placed(next((entry.place for entry in entries if entry.place.file == OVERRIDE), tree.place)):
        return law(**_values(law_keys(law), tree, context, law.name()), place=tree.place)


def _values(declared: Mapping[str, Key], tree: Tree, context: Context, called: str) -> dict[str, Any]:
    """Return the values of the given keys; all of them must be known, and no required one missing."""
    given = tree.mapping(declared)
    for name, item in declared.items():
        if item.required and name not in given:
            subject = called or tree.place.path.rpartition(".")[2]
            raise tree.error(f"{subject} needs `{name}`: {item.meaning(context.x)}.")
    return {name: item.content.read(given[name], name, context) for name, item in declared.items() if name in given}


# -- JSON Schema ------------------------------------------------------------------------------------------------------


def schema_of(cls: type[Section] | type[Law]) -> Schema:
    """Return the JSON Schema of a section or of the parameters of a law."""
    declared = {**keys(cls), **cls.more_keys(None)} if issubclass(cls, Section) else law_keys(cls)
    properties = {name: item.schema() for name, item in declared.items()}
    found = closed(properties, [name for name, item in declared.items() if item.required])
    return {**found, "description": _first_line(cls)}


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").strip().splitlines()[0]


def closed(properties: Mapping[str, Schema], required: Sequence[str] = ()) -> Schema:
    """Return the schema of an object with these keys and no others."""
    found: Schema = {"type": "object", "properties": dict(properties), "additionalProperties": False}
    return {**found, "required": list(required)} if required else found


def reference(name: str) -> Schema:
    """Return a reference to a definition."""
    return {"$ref": f"#/$defs/{name}"}
