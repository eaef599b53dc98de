"""Heat transfer: constant conductance, radiation."""

from __future__ import annotations

from surfacechem.contracts.terms import HeatTransfer, parameter
from surfacechem.expressions import Expression
from surfacechem.quantities import STEFAN_BOLTZMANN


class Conductance(HeatTransfer):
    r"""Linear heat transfer.

    .. math:: q = h\,(T_{hot} - T_{cold})

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:qc_k1 (body to interface medium) and e:qc_t1 (body to body).

    >>> Conductance(between=("lower", "upper"), h=250.0).conductance()
    250.0
    """

    h: float = parameter("W/(m^2 K)", "thermal conductance", at_least=0)

    def conductance(self) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self.h


class Radiation(HeatTransfer):
    r"""Radiation between two parallel grey diffuse surfaces, exact in the temperatures.

    .. math:: h = \frac{\sigma (T_1^2 + T_2^2)(T_1 + T_2)}{1/\varepsilon_1 + 1/\varepsilon_2 - 1}, \quad
              q = \frac{\sigma (T_1^4 - T_2^4)}{1/\varepsilon_1 + 1/\varepsilon_2 - 1}

    :math:`T_1` and :math:`\varepsilon_1` belong to the first end of the path, :math:`T_2` and :math:`\varepsilon_2` to
    the second. Surroundings that are large against the surface have an emissivity of one. A gap must be wide against
    the thermal wavelength, about 10 um at 300 K: near-field transfer across narrower ones is stronger.
    Source: Stefan-Boltzmann law; Sauer, Duong & Mandadapu (2021), section on heat transfer.

    >>> law = Radiation(between=("lower", "upper"), epsilon_1=0.8, epsilon_2=0.6)
    >>> round(law.conductance(T_from=350.0, T_to=500.0), 12)
    9.36721200217
    """

    channel = "radiation"

    epsilon_1: float = parameter("1", "emissivity of the first end", above=0, at_most=1)
    epsilon_2: float = parameter("1", "emissivity of the second end", default=1.0, above=0, at_most=1)

    def conductance(self, T_from: Expression, T_to: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        black = STEFAN_BOLTZMANN * (T_from**2 + T_to**2) * (T_from + T_to)
        return black / (1 / self.epsilon_1 + 1 / self.epsilon_2 - 1)
