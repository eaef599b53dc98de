"""Every shipped case is valid by its schema, loads, assembles and says where it comes from."""

import json

import case_runs
import jsonschema
import pytest

from surfacechem import documents as data
from surfacechem import references
from surfacechem.documents import document
from surfacechem.format import names, schema

pytestmark = pytest.mark.around

VALIDATOR = jsonschema.Draft202012Validator(schema.schema())


def plain(name):
    return document.parse(document.read(data.cases() / f"{name}.yaml")).plain()


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(json.loads(schema.text()))


def test_every_law_has_its_entry():
    from surfacechem.laws import laws

    definitions = schema.schema()["$defs"]
    for contract in schema.CONTRACTS:
        for name, law in laws(contract).items():
            entry = definitions[f"{contract.contract}.{name}"]
            entry, *_ = entry.get("anyOf", [entry])  # what a file holds may be given by its name, too
            assert set(entry["properties"]) == set(dict(law.specs())) | set(dict(law.options()))
            assert entry["description"]


@pytest.mark.parametrize("name", names())
def test_case(name):
    case = case_runs.load(name).case
    assert case.title != name
    assert case.source
    assert case_runs.load(name).system.warnings == ()
    assert case.reference is None or case.reference.name in references.names()
    assert [error.message for error in VALIDATOR.iter_errors(plain(name))] == []


def test_no_object_takes_keys_that_are_not_declared():
    assert [entry for entry in objects(schema.schema()) if "additionalProperties" not in entry] == []


def objects(entry):
    """Every schema of an object inside this one."""
    if isinstance(entry, dict) and isinstance(entry.get("properties"), dict) and "type" in entry:
        yield entry
    for child in entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else ():
        yield from objects(child)


@pytest.mark.parametrize(
    "changed",
    [
        {"bodies": {"lower": {"temperature": "T"}}},
        {"interface": {"friction": [{"coulomb": {"mu": -1}}]}},
        {"interface": {"friction": [{"coulomb": {"mu": 1}, "viscous": {"eta": 1}}]}},
        {"loading": {"w": 1}},
        {"run": {"outputs": 3}},
        {"run": {"until": "five seconds"}},
        {"reference": "slidin"},
    ],
)
def test_wrong_values_do_not_validate(changed):
    assert not VALIDATOR.is_valid({**plain("sliding-dry"), **changed})
