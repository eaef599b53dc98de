"""JSON Schema of the case format, made from its declarations, for editors that complete and check YAML."""

from __future__ import annotations

import json

from surfacechem import laws
from surfacechem.contracts.terms import BodyEnergy, Load, Shape
from surfacechem.format.data_files import KEY_MEANINGS
from surfacechem.format.declarations import NODE_NAME, QUANTITY, Schema, closed, law_keys, reference, schema_of
from surfacechem.format.sections import Document

# The parameters of a body's energy are among its other keys.
CONTRACTS = [contract for contract in laws.FAMILIES if contract is not BodyEnergy]


def schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a case file."""
    entries = {name: {"type": "string", "description": meaning} for name, meaning in KEY_MEANINGS.items()}
    # A table by its file, or by its text.
    tables = [closed({name: entries[name], "column": entries["column"]}, [name]) for name in ("file", "csv")]
    definitions: dict[str, Schema] = {
        "quantity": {
            "description": "a number in SI, or a number and a unit",
            "anyOf": [{"type": "number"}, {"type": "string", "pattern": QUANTITY}],
        },
        "history": {"anyOf": [reference("quantity"), reference(Load.contract), closed({"table": {"anyOf": tables}})]},
        "temperature": {
            "description": "the name of a temperature (bodies that share one are in perfect contact), a value or a "
            "history",
            "anyOf": [{"type": "string", "pattern": f"^{NODE_NAME.pattern}$"}, reference("history")],
        },
    }
    for contract in CONTRACTS:
        found = laws.laws(contract)
        # Laws that need no parameter may be given by their bare names.
        bare = [name for name, law in found.items() if not any(key.required for key in law_keys(law).values())]
        for name, law in found.items():
            kind = {"type": ["object", "null"]} if name in bare else {}
            definitions[f"{contract.contract}.{name}"] = {**schema_of(law), **kind}
        one = closed({name: reference(f"{contract.contract}.{name}") for name in found})
        one |= {"minProperties": 1, "maxProperties": 1}
        definitions[contract.contract] = {"anyOf": [one, {"enum": bare}]} if bare else one
    # Heights from a file replace the parameters of the law before it is read.
    heights = f"{Shape.contract}.heights"
    measured = {"type": "string", "description": "a CSV or netCDF file of x, y and z beside the case"}
    definitions[heights] = {"anyOf": [definitions[heights], closed({"file": measured}, ["file"])]}
    document = schema_of(Document)
    document["properties"]["bodies"] |= {"minProperties": 2, "maxProperties": 2}
    document["properties"]["run"]["anyOf"] = [{"required": ["until"]}, {"required": ["times"]}]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "surfacechem case",
        **document,
        "$defs": definitions,
    }


def text() -> str:
    """Return the schema as JSON text."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"
