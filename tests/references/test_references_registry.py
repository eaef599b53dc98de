"""Names, files and laziness of the exact solutions."""

import subprocess
import sys
from dataclasses import fields

import pytest

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.references import Reference


def test_every_file_holds_the_solution_it_is_named_after():
    for name, kind in references.all().items():
        assert issubclass(kind, Reference)
        assert kind.name == name
        assert kind.__module__.rpartition(".")[2] == name.replace("-", "_")


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
    assert (
        "no exact solution 'endotermic-bonding'. Did you mean 'endothermic-bonding'? Known: adiabatic-arrhenius,"
        in str(error.value)
    )


def test_one_name_imports_one_file_and_no_scipy():
    script = """
import sys
from surfacechem.references import get
get("sliding")
loaded = [m.rpartition(".")[2] for m in sys.modules if m.startswith("surfacechem.references.") and "._" not in m]
print(sorted(loaded), "scipy" in sys.modules)
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "['base', 'sliding'] False"


def test_times_of_any_shape():
    sliding = references.get("sliding")(C_1=1.0, C_2=1.0, T_0=300.0, T_i=300.0, D=1.0)
    for t, shape in ((1.0, ()), ([0.0, 1.0], (2,)), ([[0.0, 1.0, 2.0]], (1, 3))):
        assert all(value.shape == shape for value in sliding.solution(t).values())
    with pytest.raises(InputError, match="exact for 0 <= t"):
        sliding.solution(-1.0)
