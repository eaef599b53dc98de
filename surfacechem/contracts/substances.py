"""Contracts of the medium between the bodies: a law for one property, and a fluid whose properties have no formula."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from surfacechem.contracts.terms import Law
from surfacechem.expressions import Expression

if TYPE_CHECKING:
    from surfacechem.contracts.fits import Piece


class Property(Law):
    """Property of the medium between the bodies, as a function of temperature and pressure."""

    contract = "property"
    formula = "value"
    quantity: ClassVar[str]
    """Name of the property in the table of quantities."""

    value: ClassVar[Callable[..., Expression]]


@dataclass(frozen=True)
class FluidRange:
    """Temperatures [K] at which a fluid stays what it is, and what happens beyond."""

    low: float
    high: float
    reason_low: str
    reason_high: str


class Fluid(ABC):
    """A substance whose properties have no formula; they are fitted where a scene reads them.

    Properties go by the names of the table of quantities; ``capacity_m`` is the heat capacity per volume over T,
    rho_m cp_m / T [J/(m^3 K^2)].
    """

    name: str
    pressure: float

    @abstractmethod
    def range(self, T: float) -> FluidRange:
        """Temperatures around T [K] at which it has properties; InputError where it has none at T."""

    @abstractmethod
    def fit(self, quantity: str, low: float, high: float) -> tuple[Piece, ...]:
        """A property between two temperatures [K]; InputError where it has none."""
