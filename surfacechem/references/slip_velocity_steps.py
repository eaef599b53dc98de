"""Velocity steps of rate-and-state friction, slip law."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from surfacechem.references._velocity_steps import VelocitySteps
from surfacechem.references.base import Array


class SlipVelocitySteps(VelocitySteps):
    r"""Rate-and-state friction with the slip law at a velocity that steps from one value to another and back.

    .. math:: \ln\frac{v\theta}L=\ln\frac{v\theta_i}L\,e^{-vt/L},\qquad
        t_t=a\,p\,\operatorname{arsinh}\Big[\frac v{2v_0}\exp\frac{\mu_0+b\ln(v_0\theta/L)}a\Big]

    at each velocity, t counted from its beginning. Any ages and positive velocities. Friction approaches its steady
    value exponentially with slip, alike after a step up and a step down.

    Source: Ruina (1983), doi 10.1029/JB088iB12p10359, integrated.

    >>> rock = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
    >>> steps = SlipVelocitySteps(**rock, theta_i=10.0, v_i=1e-6, v_step=1e-5, t_1=10.0, t_2=20.0)
    >>> " ".join(f"{t:.3f}" for t in steps.solution([10.0, 11.0, 20.0, 30.0])["t_rate_and_state_slip"])
    '3000000.000 3005965.901 2942443.213 2936472.355'
    """

    name: ClassVar[str] = "slip-velocity-steps"
    law: ClassVar[str] = "rate_and_state_slip"

    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        return np.asarray(ln_age * np.exp(-slip))
