"""Variation of a parameter with one variable: linear, proportional, polynomial, power, exponential, Arrhenius."""

from __future__ import annotations

from surfacechem.contracts.terms import Factor, parameter
from surfacechem.expressions import Expression, exp
from surfacechem.quantities import GAS_CONSTANT


class Linear(Factor):
    r"""Linear change with any variable.

    .. math:: f = 1 + s\,(x - x_0)

    Source: first-order expansion. Must stay positive if the parameter has to.

    >>> Linear(of="phi", slope=0.5).factor(x=0.5)
    1.25
    """

    slope: float = parameter("1/[x]", "relative change per unit of x", varies=False)
    about: float = parameter("[x]", "x at which the factor is one", default=0.0, varies=False)

    def factor(self, x: Expression) -> Expression:
        """Dimensionless factor."""
        return 1 + self.slope * (x - self.about)


class Proportional(Factor):
    r"""Proportional to any variable, as the strength of bonds is to their number.

    .. math:: f = x / x_0

    Source: definition. Unlike `linear` with the slope 1/x_0 it keeps all digits where x vanishes.

    >>> Proportional(of="phi").factor(x=1e-20)
    1e-20
    """

    about: float = parameter("[x]", "x at which the factor is one", default=1.0, above=0, varies=False)

    def factor(self, x: Expression) -> Expression:
        """Dimensionless factor."""
        return x / self.about


class LinearInTemperature(Factor):
    r"""Linear change with temperature about the reference temperature.

    .. math:: f = 1 + s\,(T - T_0)

    Source: first-order expansion.

    >>> LinearInTemperature(slope=-2e-3).factor(x=350.0, T_0=300.0)
    0.9
    """

    slope: float = parameter("1/K", "relative change per kelvin", varies=False)

    def factor(self, x: Expression, T_0: Expression) -> Expression:
        """Dimensionless factor."""
        return 1 + self.slope * (x - T_0)


class Power(Factor):
    r"""Power of the temperature.

    .. math:: f = (T / T_0)^n

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.2 with n = -2.

    >>> Power(exponent=-2.0).factor(x=600.0, T_0=300.0)
    0.25
    """

    keeps_sign = True

    exponent: float = parameter("1", "exponent of T/T_0", varies=False)

    def factor(self, x: Expression, T_0: Expression) -> Expression:
        """Dimensionless factor."""
        return (x / T_0) ** self.exponent


class Polynomial(Factor):
    r"""Quadratic polynomial of the temperature ratio.

    .. math:: f = c_0 + c_1 \frac{T}{T_0} + c_2 \frac{T^2}{T_0^2}

    Source: the form of K(T) in Sauer, Duong & Mandadapu (2021), eq. e:Psi_bt.

    >>> Polynomial(c_0=1.0, c_2=2.0).factor(x=600.0, T_0=300.0)
    9.0
    """

    c_0: float = parameter("1", "constant coefficient", default=0.0, varies=False)
    c_1: float = parameter("1", "linear coefficient", default=0.0, varies=False)
    c_2: float = parameter("1", "quadratic coefficient", default=0.0, varies=False)

    def factor(self, x: Expression, T_0: Expression) -> Expression:
        """Dimensionless factor."""
        ratio = x / T_0
        return self.c_0 + self.c_1 * ratio + self.c_2 * ratio**2


class Exponential(Factor):
    r"""Exponential decay with temperature, as for the viscosity of a lubricant.

    .. math:: f = e^{-\beta (T - T_0)}

    Source: Reynolds (1886), doi 10.1098/rstl.1886.0005.

    >>> round(Exponential(beta=0.04).factor(x=310.0, T_0=300.0), 6)
    0.67032
    """

    keeps_sign = True

    beta: float = parameter("1/K", "decay per kelvin", varies=False)

    def factor(self, x: Expression, T_0: Expression) -> Expression:
        """Dimensionless factor."""
        return exp(-self.beta * (x - T_0))


class Activated(Factor):
    r"""Arrhenius factor that is one at the reference temperature.

    .. math:: f = \exp\left[ -\frac{E_a}{R_g} \left( \frac1T - \frac1{T_0} \right) \right]

    Source: Arrhenius (1889), doi 10.1515/zpch-1889-0416. T > 0.

    >>> round(Activated(E_a=3e4).factor(x=320.0, T_0=300.0), 6)
    2.120607
    """

    keeps_sign = True

    E_a: float = parameter("J/mol", "activation energy", varies=False)

    def factor(self, x: Expression, T_0: Expression) -> Expression:
        """Dimensionless factor."""
        return exp(-self.E_a / GAS_CONSTANT * (1 / x - 1 / T_0))
