"""Where the laws hold: the ends of their domains that gaps may pass as they look for their next equilibrium."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function, compile_function
from surfacechem.model.system import System

Array = NDArray[np.float64]


class Domain:
    """The margins of a system at which a law ends and which gaps in equilibrium move, compiled when first needed."""

    def __init__(self, system: System) -> None:
        gaps = {state.symbol for state in system.states if state.name in {e.state for e in system.equilibria}}
        ends = [(system.expand(item.expression), item.reason) for item in system.margins if item.domain]
        self.inputs = system.inputs
        self.ends = {reason: end for end, reason in ends if end.free_symbols & gaps}

    @cached_property
    def _margins(self) -> Function:
        return compile_function(self.inputs, list(self.ends.values()))

    def beyond(self, inputs: Array) -> str:
        """Why a law does not hold at the inputs, where the gaps have left its domain; empty where all hold."""
        values = self._margins(inputs) if self.ends else np.empty(0)
        return next((reason for value, reason in zip(values, self.ends, strict=True) if not value > 0), "")
