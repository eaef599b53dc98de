"""The case format: a YAML document becomes a scene, a run and, optionally, an exact solution to compare with.

:mod:`~surfacechem.format.sections` declares every key; reader, JSON Schema and documentation follow from it.
"""

from surfacechem.format.cases import Case, Overrides, Source, load, load_text, names
from surfacechem.format.reader import ExactSolution

__all__ = ["Case", "ExactSolution", "Overrides", "Source", "load", "load_text", "names"]
