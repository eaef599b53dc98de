"""Rate-and-state friction at a velocity that steps up or down and back again."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Reference


class VelocitySteps(Reference):
    """What both forms of the age share: the velocity, and friction as a function of velocity and age."""

    law: ClassVar[str]

    mu_0: float = parameter("1", "steady friction coefficient at v_0", above=0)
    a: float = parameter("1", "direct effect of velocity", above=0)
    b: float = parameter("1", "effect of the age of the contact", at_least=0)
    L: float = parameter("m", "slip over which the contact forgets", above=0)
    v_0: float = parameter("m/s", "velocity of reference", above=0)
    p: float = parameter("Pa", "contact pressure", at_least=0)
    theta_i: float = parameter("s", "initial age", above=0)
    v_i: float = parameter("m/s", "velocity before and after the steps", above=0)
    v_step: float = parameter("m/s", "velocity between the steps", above=0)
    t_1: float = parameter("s", "time of the first step", at_least=0)
    t_2: float = parameter("s", "time of the second step", at_least=0)

    def __post_init__(self) -> None:
        """Refuse steps in the wrong order."""
        super().__post_init__()
        if self.t_2 < self.t_1:
            raise InputError(f"{self.name}: t_2 must not be below t_1 = {self.t_1!r} s.")

    @abstractmethod
    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        r"""Logarithm of :math:`v\theta/L` after a slip [in units of L] at a constant velocity."""

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        after_1, after_2 = t > self.t_1, t > self.t_2
        v = np.where(after_1 & ~after_2, self.v_step, self.v_i)
        begun = np.where(after_2, self.t_2, np.where(after_1, self.t_1, 0.0))
        ln_1 = self._ln_theta(np.log(self.theta_i), self.v_i, self.t_1)
        ln_2 = self._ln_theta(ln_1, self.v_step, self.t_2 - self.t_1)
        start = np.where(after_2, ln_2, np.where(after_1, ln_1, np.log(self.theta_i)))
        ln_theta = self._ln_theta(start, v, t - begun)
        return {"ln_theta": ln_theta, "theta": np.exp(ln_theta), "v": v, f"t_{self.law}": self._traction(v, ln_theta)}

    def _ln_theta(self, start: Array, v: Array | float, duration: Array | float) -> Array:
        steady = np.log(self.L / v)
        return np.asarray(steady + self.relaxed(np.asarray(start - steady), np.asarray(v * duration / self.L)))

    def _traction(self, v: Array, ln_theta: Array) -> Array:
        exponent = (self.mu_0 + self.b * (np.log(self.v_0 / self.L) + ln_theta)) / self.a
        ln_sinh = np.log(v / (2.0 * self.v_0)) + exponent  # arsinh of a large number, by its logarithm
        return np.asarray(self.a * self.p * (ln_sinh + np.log1p(np.sqrt(1.0 + np.exp(-2.0 * ln_sinh)))))
