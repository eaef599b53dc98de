"""Free energies of the bodies: quadratic, constant."""

from __future__ import annotations

from surfacechem.contracts.terms import BodyEnergy, parameter
from surfacechem.expressions import Expression, log


class Quadratic(BodyEnergy):
    r"""Body whose internal energy is quadratic in temperature, so that its capacity grows as T.

    .. math:: F = -\frac{C}{2 T_0}(T - T_0)^2, \quad U = \frac{C}{2 T_0}(T^2 - T_0^2), \quad S = C(T/T_0 - 1)

    Source: Sauer, Duong & Mandadapu (2021), eq. e:Uk0. Any T > 0.

    >>> Quadratic(C=1000.0).energy(T=330.0, T_0=300.0)
    -1500.0
    """

    C: float = parameter("J/(m^2 K)", "heat capacity per area at T_0", above=0)

    def energy(self, T: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return -self.C / (2 * T_0) * (T - T_0) ** 2


class Constant(BodyEnergy):
    r"""Body with a constant heat capacity.

    .. math:: F = C\,[\,T - T_0 - T \ln(T/T_0)\,], \quad U = C(T - T_0), \quad S = C \ln(T/T_0)

    Source: classical thermodynamics. Any T > 0.

    >>> round(Constant(C=1000.0).energy(T=330.0, T_0=300.0), 6)
    -1452.359335
    """

    C: float = parameter("J/(m^2 K)", "heat capacity per area", above=0)

    def energy(self, T: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.C * (T - T_0 - T * log(T / T_0))
