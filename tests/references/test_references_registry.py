"""Names, files and laziness of the exact solutions."""

import importlib.util
import sys
from dataclasses import fields
from pathlib import Path

import pytest

import surfacechem
from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.format.schema import schema
from surfacechem.references import Reference


def test_every_solution_is_found_by_its_name():
    for name, kind in references.all().items():
        assert issubclass(kind, Reference)
        assert references.get(name) is kind
    assert not references.known("bell-bond")  # a base of two


@pytest.mark.parametrize("name", references.names())
def test_every_solution_says_what_it_is(name):
    kind = references.get(name)
    assert kind.__doc__
    for part in (".. math::", "Source:", ">>> "):
        assert part in kind.__doc__
    assert all(item.metadata["spec"].unit and item.metadata["spec"].text for item in fields(kind))


def test_unknown_name():
    with pytest.raises(InputError) as error:
        references.get("endotermic-bonding")
    assert "no exact solution 'endotermic-bonding'. Did you mean 'endothermic-bonding'? Nearest of" in str(error.value)


def test_times_of_any_shape():
    sliding = references.get("sliding")(C_1=1.0, C_2=1.0, T_0=300.0, T_i=300.0, D=1.0)
    for t, shape in ((1.0, ()), ([0.0, 1.0], (2,)), ([[0.0, 1.0, 2.0]], (1, 3))):
        assert all(value.shape == shape for value in sliding.solution(t).values())
    with pytest.raises(InputError, match="exact for 0 <= t"):
        sliding.solution(-1.0)


ADDED = '''
"""A body that a reservoir cools."""

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference, read


class NewtonCooling(Reference):
    r"""A body of constant capacity that relaxes to the temperature of a reservoir.

    .. math:: T = T_a + (T_i - T_a)\\,e^{-ht/C}

    Any t >= 0. Source: Newton (1701), integrated.
    """

    C: float = parameter("J/(m^2 K)", "heat capacity", above=0)
    h: float = parameter("W/(m^2 K)", "conductance to the reservoir", at_least=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    T_a: float = parameter("K", "temperature of the reservoir", above=0)

    readings = read(capacity="C", total_conductance="h", temperature="T_i", surroundings_temperature="T_a")

    def quantities(self, t: Array):
        return {"T": self.T_a + (self.T_i - self.T_a) * np.exp(-self.h * t / self.C)}
'''


@pytest.fixture
def added(tmp_path, monkeypatch):
    """One more file beside those of the package."""
    (tmp_path / "newton_cooling.py").write_text(ADDED)
    monkeypatch.setattr(references, "__path__", [*references.__path__, str(tmp_path)])
    yield
    sys.modules.pop("surfacechem.references.newton_cooling", None)


CHANGES = ["bodies.body.capacity=constant", "reference=newton-cooling"]


def test_an_exact_solution_is_added_by_its_file_alone(added):
    """It is found, listed, offered by the schema, shown in the documentation, read off the scene and compared."""
    assert "newton-cooling" in references.names()
    assert references.get("newton-cooling").name == "newton-cooling"
    names, _ = schema()["properties"]["reference"]["anyOf"]
    assert "newton-cooling" in names["enum"]
    solution = surfacechem.run("reservoir-exchange", CHANGES)
    assert solution.accuracy.source == "exact solution newton-cooling"
    assert solution.accuracy.error < 1e-9
    assert {"T_1", "T_1_exact"} <= set(solution.dataset)
    hooks = Path(__file__).parents[2] / "docs" / "hooks.py"
    spec = importlib.util.spec_from_file_location("hooks_of_the_documentation", hooks)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert "## `newton-cooling` { #newton-cooling }" in made.made_references()
