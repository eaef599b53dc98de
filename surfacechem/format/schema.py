"""JSON Schema of the case format, made from the classes of the laws: for editors that complete and check YAML."""

from __future__ import annotations

import dataclasses
import json
import math
import typing
from collections.abc import Iterable
from typing import Any

from surfacechem import laws, references
from surfacechem import solve as solvers
from surfacechem.contracts.substances import Property
from surfacechem.contracts.terms import (
    BodyEnergy,
    Factor,
    Friction,
    HeatTransfer,
    Law,
    Limit,
    Load,
    Potential,
    RateLaw,
    Spec,
)
from surfacechem.format import TOP_KEYS
from surfacechem.format.conduction import CONDUCTION_KEYS, INSULATED, LUMP
from surfacechem.format.mechanics import MOVING, WAYS
from surfacechem.format.medium import MEDIUM_KEYS, PROPERTIES
from surfacechem.format.run import RUN_KEYS, SPACINGS
from surfacechem.format.scene import BODY_KEYS, BODY_NAME, INTERFACE_KEYS, NODE
from surfacechem.format.sweep import RANGE_KEYS, SWEEP_KEYS
from surfacechem.model.assemble import LOADABLE
from surfacechem.quantities import INTERNAL, VARIABLES
from surfacechem.scene import Conduction, Mounting

Schema = dict[str, Any]

QUANTITY = r"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*(\S.*)?$"
"""A number, with or without a unit."""

CONTRACTS: tuple[type[Law], ...] = (Potential, RateLaw, Friction, HeatTransfer, Limit, Property, Load, Factor)

_TEXTS = {
    "until": "end of the run [s]",
    "outputs": "number of output times, with both ends",
    "spacing": "of the output times",
    "first": "first output time after 0 for logarithmic spacing [s]",
    "times": "output times [s], instead of `until` and `outputs`",
    "accuracy": "relative accuracy wanted, instead of `rtol`",
    "rtol": "relative tolerance of each step",
    "atol": "absolute tolerance relative to the scale of each state",
    "solver": "integrator",
    "max-steps": "most steps",
    "max-seconds": "longest run time [s]",
}


def schema() -> Schema:
    """The JSON Schema (draft 2020-12) of a case file."""
    definitions = {"quantity": _quantity("a number in SI, or a number and a unit")}
    for contract in CONTRACTS:
        definitions |= {_key(contract, law): _law(law) for law in laws.laws(contract).values()}
        definitions[contract.contract] = _any_law(contract)
    definitions["history"] = {
        "anyOf": [_ref("quantity"), _ref(Load.contract), _object({"table": {"anyOf": _csv_tables()}})]
    }
    definitions["temperature"] = {
        "description": "the name of a temperature (bodies that share one are in perfect contact), a value or a history",
        "anyOf": [{"type": "string", "pattern": f"^{NODE.pattern}$"}, _ref("history")],
    }
    properties = _top()
    assert set(properties) == set(TOP_KEYS)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "surfacechem case",
        **_object(properties, required=("bodies", "run")),
        "$defs": definitions,
    }


def _csv_tables() -> list[Schema]:
    """A table from a file, or from its text."""
    column = {"type": "string", "description": "the column of the values, if not named after the variable"}
    texts = {
        "file": "a CSV file beside the case; its first line is like t [s], w_n [um]",
        "csv": "the text of such a file",
    }
    entries = {key: {"type": "string", "description": meaning} for key, meaning in texts.items()}
    return [_object({key: entry, "column": column}, required=(key,)) for key, entry in entries.items()]


def text() -> str:
    """The schema as JSON."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def _top() -> dict[str, Schema]:
    variables = {name: {**_ref("history"), "description": _variable(name)} for name in LOADABLE}
    return {
        "title": _string("one line"),
        "source": _string("where the case comes from"),
        "description": _string("what the case shows"),
        "T_0": _quantity("reference temperature [K]"),
        "bodies": _bodies(),
        "interface": _interface(),
        "heat": _list(HeatTransfer, "heat paths"),
        "surroundings": _object({"temperature": _ref("history")}, required=("temperature",)),
        "mechanics": _mechanics(),
        "programme": _programme(),
        "loading": _object(variables, patterns={NODE.pattern: _ref("history")}),
        "initial": _initial(),
        "run": _run(),
        "reference": _reference(),
        "sweep": _sweep(),
    }


def _bodies() -> Schema:
    kinds = laws.laws(BodyEnergy)
    parameters = {name: _parameter(spec) for kind in kinds.values() for name, spec in kind.specs()}
    capacity = {"description": "energy as a function of temperature", "enum": sorted(kinds), "default": "quadratic"}
    stiffness = {
        "stiffness": _quantity("normal stiffness of the body [Pa/m]; both are in series"),
        "E": _quantity("Young's modulus [Pa], with H instead of `stiffness`"),
        "H": _quantity("height [m], with E instead of `stiffness`"),
    }
    properties = {"temperature": _ref("temperature"), "capacity": capacity, "conduction": _conduction(), **stiffness}
    assert set(properties) == set(BODY_KEYS)
    properties |= parameters
    body = _object(properties, required=("temperature",))
    bodies = _object({}, patterns={BODY_NAME.pattern: body})
    return {**bodies, "minProperties": 2, "maxProperties": 2, "description": "the two bodies; the first is body 1"}


def _conduction() -> Schema:
    specs = dict(Conduction.specs())
    accuracy = _object({"accuracy": _quantity("relative accuracy of temperatures")}, required=("accuracy",))
    number = {"type": "integer", "minimum": 2, "multipleOf": 2}
    far = _object({"temperature": _ref("history"), "h": _parameter(specs["h_far"])}, required=("temperature",))
    properties = {
        **{name: _parameter(specs[name]) for name in ("thickness", "conductivity")},
        "cells": {
            "description": "number of cells, or the accuracy wanted",
            "anyOf": [number, accuracy, {"const": LUMP}],
        },
        "grading": {**_quantity("width of the cells at the far side over that at the contact"), "default": 1.0},
        "far": {"description": "far side", "anyOf": [{"const": INSULATED}, far], "default": INSULATED},
    }
    assert set(properties) == set(CONDUCTION_KEYS)
    found = _object(properties, required=("thickness", "conductivity", "cells"))
    return {**found, "description": "heat conduction across the body"}


def _interface() -> Schema:
    density = _quantity("density of bonding sites [1/m^2]")
    bonds = {"type": "array", "items": {"type": "string"}, "description": "species that count as bonds"}
    mechanism = _object(
        {"file": _string("file"), "phase": _string("phase"), "bonds": bonds, "neighbours": _neighbours()},
        required=("file",),
    )
    reference = {"reference": _string("the body whose sites define phi")}
    sides = {**_object(reference), "additionalProperties": density}
    properties = {
        "temperature": _ref("temperature"),
        "sites": {"anyOf": [density, sides]},
        "partition": _shares(),
        "medium": _medium(),
        "potential": _list(Potential, "terms of the free energy"),
        "friction": _list(Friction, "friction laws, whose tractions add up"),
        "bonding": _list(RateLaw, "reactions, whose rates add up"),
        "limits": _list(Limit, "tractions at which the interface gives way"),
        "mechanism": {"description": "Cantera surface mechanism", "anyOf": [{"type": "string"}, mechanism]},
    }
    assert set(properties) == set(INTERFACE_KEYS)
    return _object(properties)


def _neighbours() -> Schema:
    fractions = {"type": "object", "additionalProperties": _quantity("mole fraction [1]")}
    texts = {"pressure": "pressure [Pa]", "electric-potential": "electric potential against the surface [V]"}
    state = _object({name: _quantity(text) for name, text in texts.items()} | {"composition": fractions})
    description = "states in which the phases beside the surface are held, by their names"
    return {"type": "object", "additionalProperties": state, "description": description}


def _mechanics() -> Schema:
    mounting = _object({name: _parameter(spec) for name, spec in Mounting.specs()})
    texts = {
        "normal": "how the normal gap is held",
        "tangential": "how the tangential displacement is held",
        "transverse": "how the displacement across it is held, where not alike; its mass is that of tangential",
    }
    return _object({name: {**mounting, "description": text} for name, text in texts.items()})


def _programme() -> Schema:
    value = {"anyOf": [_ref("quantity"), _object({way: _ref("quantity") for way in WAYS})]}
    waits = {"type": "object", "additionalProperties": value, "minProperties": 1, "maxProperties": 1}
    until = {"anyOf": [{"type": "string"}, waits]}
    rates = {name: _quantity(f"rate of the {_variable(name)}") for name in LOADABLE}
    stage = _object({**rates, "for": _quantity("length of the stage [s]"), "until": until})
    items = {"type": "object", "additionalProperties": stage, "minProperties": 1, "maxProperties": 1}
    return {"type": "array", "description": "stages of the loading, one after the other", "items": items}


def _medium() -> Schema:
    law = {"anyOf": [_ref("quantity"), _ref(Property.contract)]}
    properties = {key: {**law, "description": _variable(name)} for key, name in PROPERTIES.items()}
    fluid = {"fluid": _string("name of a fluid that CoolProp knows"), "pressure": _quantity("pressure [Pa]")}
    fluid["temperatures"] = {"type": "array", "items": _ref("quantity"), "description": "covered from the start [K]"}
    found = _object({**fluid, "thickness": _quantity("thickness, else the normal gap [m]"), **properties})
    assert set(found["properties"]) == set(MEDIUM_KEYS)
    return {**found, "description": "what fills the space between the bodies"}


def _shares() -> Schema:
    fraction = _quantity("fraction of the heat")
    into = {"type": "object", "additionalProperties": fraction}
    text = "fraction of heat into body 1 where there is no medium, or fractions by body, the rest to the surroundings"
    return {"description": text, "anyOf": [fraction, into]}


def _initial() -> Schema:
    coverages = {"type": "object", "additionalProperties": _ref("quantity"), "description": "by species"}
    logarithm = _quantity("logarithm of the bonding state, instead of phi: for survival far below 1e-16")
    properties = {"phi": _quantity("bonding state"), "ln_phi": logarithm, "coverages": coverages}
    properties |= {
        name: _quantity(f"{VARIABLES[name].long_name} [{VARIABLES[name].unit}]") for name in (*MOVING, "theta")
    }
    properties |= {f"profile_{k}": _quantity(f"temperature inside body {k}, which conducts [K]") for k in (1, 2)}
    return _object(properties, patterns={NODE.pattern: _quantity("temperature [K]")})


def _run() -> Schema:
    times = {"type": "array", "items": _ref("quantity"), "minItems": 1}
    whole = {"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string", "pattern": "^[0-9]+$"}]}
    special: dict[str, Schema] = {
        "outputs": whole,
        "max-steps": whole,
        "spacing": {"enum": list(SPACINGS)},
        "times": times,
        "solver": {"enum": [solvers.AUTO, *sorted(solvers.names)]},
    }
    properties = {key: {**special.get(key, _ref("quantity")), "description": _TEXTS[key]} for key in RUN_KEYS}
    return {**_object(properties), "anyOf": [{"required": ["until"]}, {"required": ["times"]}]}


def _reference() -> Schema:
    name = {"enum": references.names()}
    options = {"type": "object", "properties": {"name": name}, "required": ["name"]}
    return {"description": "exact solution to compare with", "anyOf": [name, options]}


def _sweep() -> Schema:
    whole = {"type": "integer", "minimum": 1, "description": "number of values, with both ends"}
    ends = {key: _quantity(text) for key, text in (("from", "first value"), ("to", "last value"))}
    spacing = {"enum": list(SPACINGS), "default": SPACINGS[0]}
    span = _object({**ends, "points": whole, "spacing": spacing}, required=RANGE_KEYS[:3])
    values = {"anyOf": [{"type": "array", "items": _ref("quantity"), "minItems": 1}, span]}
    path = rf"({'|'.join(TOP_KEYS)})(\.[^.]+)*"
    over = {**_object({}, patterns={path: values}), "minProperties": 1, "maxProperties": 2}
    variables = {name: _ref("quantity") for name in VARIABLES if name not in INTERNAL}
    until = {**_object(variables), "minProperties": 1, "maxProperties": 1}
    texts = {"over": "values of one or two parameters, by path", "until": "a prescribed ramp and where each run ends"}
    properties = {"over": {**over, "description": texts["over"]}, "until": {**until, "description": texts["until"]}}
    assert set(properties) == set(SWEEP_KEYS)
    return _object(properties, required=("over",))


def _key(contract: type[Law], law: type[Law]) -> str:
    return f"{contract.contract}.{law.name()}"


def _any_law(contract: type[Law]) -> Schema:
    """One law: ``name: {...}``, or the bare name where nothing is required."""
    found = laws.laws(contract)
    properties = {name: _ref(_key(contract, law)) for name, law in found.items()}
    one = {**_object(properties), "minProperties": 1, "maxProperties": 1}
    bare = [name for name, law in found.items() if not _required(law)]
    return {"anyOf": [one, {"enum": bare}]} if bare else one


def _law(law: type[Law]) -> Schema:
    properties = {name: _option(law, name, meaning) for name, meaning in law.options()}
    properties |= {name: _with_default(law, name, _parameter(spec)) for name, spec in law.specs()}
    description = (law.__doc__ or "").strip().splitlines()[0]
    found = {**_object(properties, required=_required(law)), "description": description}
    return found if _required(law) else {**found, "type": ["object", "null"]}


def _required(law: type[Law]) -> list[str]:
    return [name for name in (*dict(law.options()), *dict(law.specs())) if _default(law, name) is dataclasses.MISSING]


def _default(law: type[Law], name: str) -> Any:
    return next(item.default for item in dataclasses.fields(law) if item.name == name)


def _with_default(law: type[Law], name: str, entry: Schema) -> Schema:
    default = _default(law, name)
    return entry if default in (dataclasses.MISSING, None) else {**entry, "default": default}


def _parameter(spec: Spec) -> Schema:
    limits = {"exclusiveMinimum": spec.above, "minimum": spec.at_least, "maximum": spec.at_most}
    number: Schema = {"type": "number", **{key: value for key, value in limits.items() if math.isfinite(value)}}
    kinds: list[Schema] = [number, {"type": "string", "pattern": QUANTITY}]
    if spec.varies:
        factors = {"type": "array", "items": _ref(Factor.contract)}
        kinds.append(_object({"value": _ref("quantity"), "times": factors}, required=("value",)))
    return {"description": f"{spec.text} [{spec.unit}]", "anyOf": kinds}


def _option(law: type[Law], name: str, meaning: str) -> Schema:
    declared = typing.get_type_hints(law)[name]
    origin, arguments = typing.get_origin(declared), typing.get_args(declared)
    entry: Schema = {}
    if declared is str:
        entry = {"type": "string"}
    elif origin is typing.Literal:
        entry = {"enum": list(arguments)}
    elif origin is tuple and Ellipsis not in arguments:
        entry = {"type": "array", "items": {"type": "string"}, "minItems": len(arguments), "maxItems": len(arguments)}
    elif origin is not None and float in arguments:
        entry = {"type": "array", "items": _ref("quantity")}
    return _with_default(law, name, {**entry, "description": meaning})


def _variable(name: str) -> str:
    return f"{VARIABLES[name].long_name} [{VARIABLES[name].unit}]"


def _list(contract: type[Law], description: str) -> Schema:
    return {"type": ["array", "null"], "items": _ref(contract.contract), "description": description}


def _quantity(description: str) -> Schema:
    return {"description": description, "anyOf": [{"type": "number"}, {"type": "string", "pattern": QUANTITY}]}


def _string(description: str) -> Schema:
    return {"type": "string", "description": description}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _object(
    properties: dict[str, Schema], required: Iterable[str] = (), patterns: dict[str, Schema] | None = None
) -> Schema:
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if patterns:
        found["patternProperties"] = {f"^{pattern}$": entry for pattern, entry in patterns.items()}
    return {**found, "required": list(required)} if list(required) else found
