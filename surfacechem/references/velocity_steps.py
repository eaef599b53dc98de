"""Rate-and-state friction at a velocity that steps up or down and back again, with the aging and the slip law."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Quantities, Reference, read


class VelocitySteps(Reference):
    """A velocity that steps, with friction as a function of velocity and age; subclasses have the law of the age."""

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

    readings = read(friction="mu_0 a b L v_0", initial="p theta_i=theta v_i=v")

    def __post_init__(self) -> None:
        """Refuse steps in the wrong order."""
        super().__post_init__()
        if self.t_2 < self.t_1:
            raise InputError(f"{self.name}: t_2 must not be below t_1 = {self.t_1!r} s.")

    @abstractmethod
    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        r"""Return the logarithm of :math:`v\theta/L` after a slip [in units of L] at a constant velocity."""

    def quantities(self, t: Array) -> Quantities:
        def ln_theta(start: Array, v: Array | float, duration: Array | float) -> Array:
            steady = np.log(self.L / v)
            return np.asarray(steady + self.relaxed(np.asarray(start - steady), np.asarray(v * duration / self.L)))

        after_1, after_2, ln_0 = t > self.t_1, t > self.t_2, np.log(self.theta_i)
        v = np.where(after_1 & ~after_2, self.v_step, self.v_i)
        ln_1 = ln_theta(ln_0, self.v_i, self.t_1)
        ln_2 = ln_theta(ln_1, self.v_step, self.t_2 - self.t_1)
        begun = np.where(after_2, self.t_2, np.where(after_1, self.t_1, 0.0))
        now = ln_theta(np.where(after_2, ln_2, np.where(after_1, ln_1, ln_0)), v, t - begun)
        # Traction from the logarithm of the hyperbolic sine, which may overflow.
        ln_sinh = np.log(v / (2.0 * self.v_0)) + (self.mu_0 + self.b * (np.log(self.v_0 / self.L) + now)) / self.a
        traction = self.a * self.p * (ln_sinh + np.log1p(np.sqrt(1.0 + np.exp(-2.0 * ln_sinh))))
        return {"ln_theta": now, "theta": np.exp(now), "v": v, f"t_{self.law}": traction}


class AgingVelocitySteps(VelocitySteps):
    r"""Rate-and-state friction with the aging law at a velocity that steps from one value to another and back.

    .. math:: \theta=\frac Lv+\Big(\theta_i-\frac Lv\Big)e^{-vt/L},\qquad
        t_t=a\,p\,\operatorname{arsinh}\Big[\frac v{2v_0}\exp\frac{\mu_0+b\ln(v_0\theta/L)}a\Big]

    at each velocity, t counted from its beginning. Any ages and positive velocities.

    Source: Dieterich (1979), doi 10.1029/JB084iB05p02161, and Ruina (1983), doi 10.1029/JB088iB12p10359, integrated.

    >>> rock = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
    >>> steps = AgingVelocitySteps(**rock, theta_i=10.0, v_i=1e-6, v_step=1e-5, t_1=10.0, t_2=20.0)
    >>> " ".join(f"{t:.3f}" for t in steps.solution([10.0, 11.0, 20.0, 30.0])["t_rate_and_state_aging"])
    '3000000.000 3052021.636 2942466.011 2969843.586'
    """

    law: ClassVar[str] = "rate_and_state_aging"

    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        return np.asarray(np.logaddexp(np.log(-np.expm1(-slip)), ln_age - slip))


class SlipVelocitySteps(VelocitySteps):
    r"""Rate-and-state friction with the slip law at a velocity that steps from one value to another and back.

    .. math:: \ln\frac{v\theta}L=\ln\frac{v\theta_i}L\,e^{-vt/L},\qquad
        t_t=a\,p\,\operatorname{arsinh}\Big[\frac v{2v_0}\exp\frac{\mu_0+b\ln(v_0\theta/L)}a\Big]

    at each velocity, t counted from its beginning. Any ages and positive velocities. Friction approaches its steady
    value exponentially with slip, in the same way after a step up and a step down.

    Source: Ruina (1983), doi 10.1029/JB088iB12p10359, integrated.

    >>> rock = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
    >>> steps = SlipVelocitySteps(**rock, theta_i=10.0, v_i=1e-6, v_step=1e-5, t_1=10.0, t_2=20.0)
    >>> " ".join(f"{t:.3f}" for t in steps.solution([10.0, 11.0, 20.0, 30.0])["t_rate_and_state_slip"])
    '3000000.000 3005965.901 2942443.213 2936472.355'
    """

    law: ClassVar[str] = "rate_and_state_slip"

    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        return np.asarray(ln_age * np.exp(-slip))
