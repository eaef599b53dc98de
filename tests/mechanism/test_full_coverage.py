"""Coverages that start at exactly nothing or everything: chemical potentials are infinite there, the books are not."""

import pytest

import surfacechem

CASE = """
bodies:
  lower: {{temperature: T, C: 1 kJ/m^2/K, capacity: constant}}
  upper: {{temperature: T, C: 1 kJ/m^2/K, capacity: constant}}
interface: {{temperature: T, mechanism: {{file: {file}, bonds: [{bond}]}}}}
T_0: 300 K
initial: {{T: 300 K, coverages: {coverages}}}
run: {{until: 10 s, rtol: {rtol}}}
"""
STARTS = [
    ("dna-tethers.yaml", "bond(s)", "{free(s): 1}"),
    ("dna-tethers.yaml", "bond(s)", "{bond(s): 1}"),
    ("dna-film.yaml", "AB(s)", "{AB(s): 1}"),
    ("dna-film.yaml", "AB(s)", "{A(s): 0.5, B(s): 0.5}"),
    ("selectin.yaml", "PL(s)", "{PL(s): 1}"),
    ("selectin.yaml", "PL(s)", "{P(s): 0.5, L(s): 0.5}"),
]


@pytest.mark.parametrize(("file", "bond", "coverages"), STARTS)
@pytest.mark.parametrize("rtol", [1e-7, 1e-9])
def test_the_books_close_from_empty_and_full_coverages(file, bond, coverages, rtol, tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(CASE.format(file=file, bond=bond, coverages=coverages, rtol=rtol))
    books = surfacechem.load(path).run(error="balances").audit
    assert books.entropy_error < 100 * rtol
    assert books.energy_error < 100 * rtol
    assert books.violations == ()
