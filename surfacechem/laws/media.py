"""Properties of a medium: Vogel and Roelands viscosity."""

from __future__ import annotations

import math
from collections.abc import Mapping

from surfacechem.contracts.terms import Property, parameter
from surfacechem.expressions import Expression, exp, log, power


class Vogel(Property):
    r"""Viscosity of a liquid that falls with temperature.

    .. math:: \eta = a\,e^{b / (T_c - c)}

    Three measured viscosities determine a, b and c. Source: Vogel (1921), Physikalische Zeitschrift 22, 645.
    :math:`T_c > c`; a run that reaches c stops.

    >>> round(Vogel(a=6e-5, b=900.0, c=165.0).value(T_c=313.15), 9)
    0.026088989
    """

    quantity = "eta_m"

    a: float = parameter("Pa s", "viscosity at infinite temperature", above=0)
    b: float = parameter("K", "how fast it falls", at_least=0)
    c: float = parameter("K", "temperature at which it would be infinite", at_least=0, varies=False)

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The pole of the formula."""
        return {"T_c": (self.c, math.inf)}

    def value(self, T_c: Expression) -> Expression:
        """Viscosity [Pa s]."""
        return self.a * exp(self.b / (T_c - self.c))


class Roelands(Property):
    r"""Viscosity of an oil as a function of temperature and contact pressure.

    .. math:: \eta = \eta_0 \exp\left\{ (\ln \eta_0 + 9.67) \left[ \left(1 + \frac{p}{p_0}\right)^{Z}
              \left(\frac{T_c - 138}{T_0 - 138}\right)^{-S_0} - 1 \right] \right\}, \quad p_0 = 0.196\ \mathrm{GPa}

    with temperatures in K and :math:`\eta_0` in Pa s at the reference temperature :math:`T_0`. Source: Roelands (1966),
    thesis, TU Delft, in the form of Houpert (1985), Journal of Tribology 107, 241. Pressures up to about 0.5 GPa;
    :math:`T_c > 138` K, else the run stops.

    >>> law = Roelands(eta_0=0.04, Z=0.6, S_0=1.1)
    >>> [round(law.value(T_c=313.15, p=p, T_0=313.15), 9) for p in (0.0, 1e8)]
    [0.04, 0.244499904]
    """

    quantity = "eta_m"

    eta_0: float = parameter("Pa s", "viscosity at T_0 without pressure", above=0)
    Z: float = parameter("1", "index of the pressure", default=0.0, at_least=0)
    S_0: float = parameter("1", "index of the temperature", default=0.0, at_least=0)

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The pole of the formula."""
        return {"T_c": (138.0, math.inf)}

    def value(self, T_c: Expression, p: Expression, T_0: Expression) -> Expression:
        """Viscosity [Pa s]."""
        thinned = power((T_c - 138) / (T_0 - 138), -self.S_0)
        pressed = power(1 + p / 0.196e9, self.Z)
        return self.eta_0 * exp((log(self.eta_0) + 9.67) * (pressed * thinned - 1))
