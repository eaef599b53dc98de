"""Properties of a fluid along a run: fitted over a range of temperatures that follows where the run goes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Fluid
from surfacechem.errors import InputError
from surfacechem.tolerances import SQRT_EPS

Array = NDArray[np.float64]

ROOM = 0.1
"""The first range goes beyond the temperatures at the start by this part of them."""

NEAR = SQRT_EPS
"""A run that comes this close to an end, as a part of the range, has reached it: its margin is zero there."""


@dataclass(frozen=True)
class Fit:
    """Properties of a fluid that stand in the equations as polynomials of one temperature.

    Their coefficients are parameters: where a run leaves the range, it is run again with those of a wider one.
    """

    fluid: Fluid
    temperature: str
    """Name of the state or named quantity that they are polynomials of."""
    held: tuple[float, ...]
    """Prescribed temperatures at the start [K]."""
    states: tuple[str, ...]
    """Names of the temperatures that are states."""
    coefficients: Callable[[float, float, float], Mapping[str, float]]
    """Coefficients by path, from the ends of the range and the temperature at which the energy is zero [K]."""
    bounds: tuple[str, str]
    """Paths of the parameters that are the ends of the range."""
    margin: str = "T_c within the range of the fluid"
    """Name of the margins that close there."""

    def started(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values with a range around the temperatures at the start."""
        low, high = self._range(values)
        temperatures = self._temperatures(values)
        if low <= min(temperatures) and max(temperatures) <= high:
            return dict(values)
        low, high, start = first_range(self.fluid, temperatures)
        return {**values, **self.coefficients(low, high, start)}

    def wider(self, values: Mapping[str, float], visited: Array) -> dict[str, float] | None:
        """The values with a range that goes beyond what a run has visited; None where it need not or cannot."""
        try:
            return self._wider(values, visited)
        except InputError:
            return None

    def _wider(self, values: Mapping[str, float], visited: Array) -> dict[str, float] | None:
        low, high = self._range(values)
        coldest, hottest, room = float(np.min(visited)), float(np.max(visited)), high - low
        start = _mean(self._temperatures(values))
        span = self.fluid.range(start)
        if coldest <= low + NEAR * room:
            low = max(min(low, coldest) - room, span.low)
        if hottest >= high - NEAR * room:
            high = min(max(high, hottest) + room, span.high)
        return None if (low, high) == self._range(values) else {**values, **self.coefficients(low, high, start)}

    def reason(self, values: Mapping[str, float], T: float) -> str:
        """Why there are no properties beyond T [K], where a run could not go on."""
        try:
            self._wider(values, np.array([T]))
        except InputError as error:
            return error.message.rstrip(".")
        low, high = self._range(values)
        span = self.fluid.range(_mean(self._temperatures(values)))
        words = span.reason_low if abs(T - low) < abs(T - high) else span.reason_high
        return f"{words} at {self.temperature} = {T:.6g} K"

    def _range(self, values: Mapping[str, float]) -> tuple[float, float]:
        return values[self.bounds[0]], values[self.bounds[1]]

    def _temperatures(self, values: Mapping[str, float]) -> list[float]:
        return [*self.held, *(values[f"initial.{state}"] for state in self.states)]


def first_range(fluid: Fluid, temperatures: Sequence[float]) -> tuple[float, float, float]:
    """Ends of the first range and the temperature at which the energy is zero, from the temperatures at the start."""
    start = _mean(temperatures)
    span = fluid.range(start)
    low, high = min(temperatures) * (1 - ROOM), max(temperatures) * (1 + ROOM)
    return max(low, span.low), min(high, span.high), start


def _mean(temperatures: Sequence[float]) -> float:
    return sum(temperatures) / len(temperatures)
