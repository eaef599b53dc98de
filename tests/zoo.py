"""Every scene that the tests share, by name and with tags: what holds for all of them is tested on all in test_zoo.py.

A member of the zoo is a scene built in Python with the modes in which its equations are tested, or a shipped case. A
new scene is added to its list, in scenes.py or scenes_mechanics.py, and a new case to cases/: nothing else is edited.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import case_runs
import pytest
import scenes
import scenes_mechanics

from surfacechem.documents import cases
from surfacechem.model.assemble import assemble
from surfacechem.model.system import System
from surfacechem.results import spatial
from surfacechem.scene import Scene


@dataclass(frozen=True)
class Member:
    """A scene in some of its modes."""

    name: str
    scene: Callable[[], Scene]
    modes: Mapping[str, float] = field(default_factory=dict)
    tags: frozenset[str] = frozenset()

    @property
    def system(self) -> System:
        """The assembled scene, once in a worker for all its modes; bodies in few cells."""
        return _system(self.scene)

    @property
    def digits(self) -> int:
        """To which the laws of thermodynamics hold: constants of mechanisms are doubles."""
        return 12 if "mechanism" in self.tags else 40


@cache
def _system(scene: Callable[[], Scene]) -> System:
    return assemble(spatial.few(scene()))


@dataclass(frozen=True)
class OfCase:
    """The scene of a shipped case."""

    name: str

    def __call__(self) -> Scene:
        return case_runs.load(self.name).case.scene


def _members() -> Iterator[Member]:
    for scene in scenes.ALL:
        yield Member(scene.__name__, scene, {}, frozenset({"scene", "at rest"}))
    for moving in scenes_mechanics.ALL:
        for modes in moving.modes:
            yield Member(
                f"{moving.__name__} {list(modes.values())}", moving.scene, modes, frozenset({"scene", "moving"})
            )
    for path in sorted(cases().glob("*.yaml")):
        text, found = path.read_text(), {"  mechanism:": "mechanism", "\nreference:": "exact"}
        tags = {tag for words, tag in found.items() if words in text}
        yield Member(path.stem, OfCase(path.stem), {}, frozenset({"case", *tags}))


MEMBERS = {(member.name if "scene" in member.tags else f"case {member.name}"): member for member in _members()}


def each(*tags: str, cases: int = 1) -> Any:
    """Parametrise ``member`` by those that have all tags; one of so many cases is quick, the others are slow."""
    chosen = {name: member for name, member in MEMBERS.items() if {*tags} <= member.tags}
    shipped = [name for name, member in chosen.items() if "case" in member.tags]
    slow = {name for k, name in enumerate(shipped) if k % cases}
    marks = {name: [pytest.mark.slow] if name in slow else [] for name in chosen}
    return pytest.mark.parametrize("member", [pytest.param(m, id=n, marks=marks[n]) for n, m in chosen.items()])


def pairwise(first: Sequence[Any], second: Sequence[Any], third: Sequence[Any]) -> list[tuple[Any, Any, Any]]:
    """Triples in which any two values of different axes meet; no axis is longer than the one before.

    >>> len(pairwise("abc", "xyz", "pq"))
    9
    """
    return [(a, b, third[(i + j) % len(third)]) for i, a in enumerate(first) for j, b in enumerate(second)]
