"""Friction that remembers: rate-and-state laws with the aging and the slip form of the contact's age."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from surfacechem.contracts.terms import Friction, UnderPressure, parameter
from surfacechem.expressions import Expression, absolute, asinh_exp, exp, log, sinh_exp, where

SLOWEST = 1e-300
"""Sliding velocity [m/s] that counts as none in a logarithm."""


class RateAndState(UnderPressure, Friction):
    """What both forms share: the traction, regularised at rest."""

    nonnegative = ("p",)
    internal: ClassVar[Mapping[str, str]] = {"ln_theta": "theta"}

    mu_0: float = parameter("1", "steady friction coefficient at v_0", above=0)
    a: float = parameter("1", "direct effect of velocity", above=0)
    b: float = parameter("1", "effect of the age of the contact", at_least=0)
    L: float = parameter("m", "slip over which the contact forgets", above=0)
    v_0: float = parameter("m/s", "velocity of reference", above=0)

    def traction(self, p: Expression, v: Expression, ln_theta: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.driven(p, self.drive(v, ln_theta))

    def driven(self, p: Expression, drive: Expression) -> Expression:
        """Tangential traction [Pa] by how many times it is that of the direct effect."""
        return self.a * p * drive

    def drive(self, v: Expression, ln_theta: Expression) -> Expression:
        """Traction at a velocity in units of the direct effect, a p."""
        return asinh_exp(v / (2 * self.v_0), self._strength(ln_theta))

    def velocity(self, drive: Expression, ln_theta: Expression) -> Expression:
        """Sliding velocity [m/s] at a traction in units of the direct effect: the inverse of :meth:`drive`."""
        return 2 * self.v_0 * sinh_exp(drive, -self._strength(ln_theta))

    def velocity_unit(self) -> Expression:
        """The velocity of reference [m/s]."""
        return self.v_0

    def _strength(self, ln_theta: Expression) -> Expression:
        return (self.mu_0 + self.b * (log(self.v_0 / self.L) + ln_theta)) / self.a

    @abstractmethod
    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""


class RateAndStateAging(RateAndState):
    r"""Rate-and-state friction whose contacts strengthen at rest (Dieterich's aging law).

    .. math:: t_t = a\,p\,\operatorname{arsinh}\left[\frac{v}{2 v_0}
              \exp\frac{\mu_0 + b \ln(v_0\theta/L)}{a}\right], \quad \dot\theta = 1 - \frac{|v|\,\theta}{L}

    For :math:`v > 0` this is :math:`\mu_0 + a\ln(v/v_0) + b\ln(v_0\theta/L)` times p. Velocity-weakening where b > a:
    steady sliding is then unstable below the stiffness :math:`(b - a)\,p / L`.
    Source: Dieterich (1979), doi 10.1029/JB084iB05p02161; Ruina (1983), doi 10.1029/JB088iB12p10359; regularised as in
    Rice & Ben-Zion (1996), doi 10.1073/pnas.93.9.3811. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`.

    >>> law = RateAndStateAging(mu_0=0.6, a=0.01, b=0.015, L=1e-5, v_0=1e-6)
    >>> round(law.traction(p=1e6, v=1e-6, ln_theta=2.302585092994046), 3)
    600000.0
    """

    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""
        return {"ln_theta": exp(-ln_theta) - absolute(v) / self.L}


class RateAndStateSlip(RateAndState):
    r"""Rate-and-state friction whose contacts change by slip only (Ruina's slip law).

    .. math:: t_t = a\,p\,\operatorname{arsinh}\left[\frac{v}{2 v_0}
              \exp\frac{\mu_0 + b \ln(v_0\theta/L)}{a}\right], \quad
              \dot\theta = -\frac{|v|\,\theta}{L} \ln\frac{|v|\,\theta}{L}

    Source: Ruina (1983), doi 10.1029/JB088iB12p10359; regularised as in Rice & Ben-Zion (1996),
    doi 10.1073/pnas.93.9.3811. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`.

    >>> law = RateAndStateSlip(mu_0=0.6, a=0.01, b=0.015, L=1e-5, v_0=1e-6)
    >>> round(law.traction(p=1e6, v=1e-6, ln_theta=2.302585092994046), 3)
    600000.0
    """

    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""
        speed = absolute(v)
        moving = where(speed > SLOWEST, speed, SLOWEST + 0 * speed)
        return {"ln_theta": -speed / self.L * (log(moving / self.L) + ln_theta)}
