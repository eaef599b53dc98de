"""No shipped case gives anything else than before, unseen."""

import json

import golden_values
import pytest
from case_runs import solved

from surfacechem.format import names

every_case = pytest.mark.parametrize("name", names())


def golden(name):
    return json.loads(golden_values.path(name).read_text(encoding="utf-8"))


@every_case
def test_a_case_gives_what_it_gave(name):
    """After a change that is meant: `python tests/golden_values.py`, and look at the difference."""
    assert list(golden_values.differences(name, golden(name), solved(name))) == []


@every_case
def test_the_equations_of_a_case_keep_their_values(name):
    assert golden_values.equations(name) == pytest.approx(
        golden(name)["equations"], rel=golden_values.EQUATIONS, abs=1e-40
    )


def test_every_file_is_that_of_a_case():
    assert {file.stem for file in golden_values.FOLDER.glob("*.json")} == set(names())


def test_a_difference_names_case_variable_time_and_both_values():
    kept = golden("stick-slip")
    kept["variables"]["E_total"]["values"][3] *= 1 + 1e-6
    value = kept["variables"]["E_total"]["values"][3]
    (told,) = golden_values.differences("stick-slip", kept, solved("stick-slip"))
    assert told.startswith("stick-slip: E_total at t = ")
    assert f"kept is {value!r}" in told
