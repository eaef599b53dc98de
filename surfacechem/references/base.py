r"""Exact solutions: parameters in SI, and exact values of named quantities at any time.

A reference is a frozen dataclass, named by its class. The name of its file is a part of that name, common to a family,
so that looking up one reference imports one file; to add a reference, add its file.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias, dataclass_transform

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.scene_view import SceneView

__all__ = ["Array", "Parameters", "Quantities", "Reference", "SceneView", "read"]

Array: TypeAlias = NDArray[np.float64]
Parameters: TypeAlias = Mapping[str, float | None]
"""Parameters of an exact solution by name; None, or missing, if a scene does not determine one."""

Quantities: TypeAlias = Mapping[str, Array | float]
"""Exact values by the names of the dataset; a constant may be a single number."""


def read(**readings: str) -> dict[str, tuple[str, str]]:
    """Return the table for reading parameters off a scene: for each the reading of the :class:`SceneView` and its name
    there, with a preceding minus if its sign is reversed.

    >>> read(friction="mu", initial="p phi_i=phi", temperature="T_i")["phi_i"]
    ('initial', 'phi')
    """
    found = {}
    for reading, names in readings.items():
        assert hasattr(SceneView, reading), reading
        for name in names.split():
            ours, _, theirs = name.partition("=")
            found[ours] = (reading, theirs or ours)
    return found


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter,))
class Reference(ABC):
    """An exact solution. Subclasses become frozen, keyword-only dataclasses and state `quantities`."""

    name: ClassVar[str]
    """Name of the class in kebab-case, without a final "Solution", which distinguishes it from a law."""
    continuous: ClassVar[bool] = False
    """True if it is for bodies without cells: a scene then satisfies it except for the error of its cells, and only
    `from_scene` decides whether it is the scene's."""
    readings: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Readings of its parameters from a scene, including those of its bases."""
    statistics: ClassVar[tuple[str, ...]] = ()
    """Names of its properties that a sweep compares with the statistics of each run."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        cls.readings = {name: how for kind in cls.__mro__[::-1] for name, how in vars(kind).get("readings", {}).items()}
        cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__.removesuffix("Solution")).lower()
        dataclass(frozen=True, kw_only=True)(cls)

    def __post_init__(self) -> None:
        """Check every parameter against its range."""
        for item in fields(self):  # type: ignore[arg-type]
            item.metadata["spec"].check(f"{self.name}: {item.name}", getattr(self, item.name))

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        """Return the parameters of the solution in a scene; InputError, with the reason, if it cannot be the scene's.

        A test on the scene's equations follows. Subclasses add parameters that need several readings.
        """
        return {name: scene.read(*how) for name, how in cls.readings.items()}

    @property
    def end_time(self) -> float:
        """Last time [s] at which the solution exists."""
        return math.inf

    def solution(self, t: ArrayLike) -> dict[str, Array]:
        """Return exact values of the named quantities.

        Parameters
        ----------
        t
            Times [s] after the start, of any shape.

        Returns
        -------
        dict
            Values in SI by name, each of the shape of `t`.

        Raises
        ------
        InputError
            If a time is before the start or after the end of the solution.
        """
        times = np.asarray(t, dtype=np.float64)
        if not np.all((times >= 0.0) & (times <= self.end_time)):
            raise InputError(f"{self.name}: exact for 0 <= t <= {self.end_time!r} s only.")
        # Formulas evaluate all their branches; NaN is reported below.
        with np.errstate(all="ignore"):
            values = self.quantities(times.reshape(-1))
        table = np.empty((len(values), times.size))
        for row, value in zip(table, values.values(), strict=True):
            row[:] = value
        if np.isnan(table).any():
            j, moment = np.argwhere(np.isnan(table))[0]
            raise InputError(f"{self.name}: {list(values)[j]} has no real value at t = {times.flat[moment]} s.")
        return dict(zip(values, table.reshape(len(values), *times.shape), strict=True))

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Return temperatures of body 1 or 2 at distances from the contact [m], shape (times, places), if
        continuous.
        """
        raise NotImplementedError(f"{self.name} knows no temperatures inside bodies.")

    @abstractmethod
    def quantities(self, t: Array) -> Quantities:
        """Return the exact solution at a vector of times."""
