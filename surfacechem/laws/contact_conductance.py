"""Conductance of contact spots: pressure power law, plastic and elastic asperities, table of the pressure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from surfacechem.contracts.terms import HeatTransfer, UnderPressure, option, parameter
from surfacechem.expressions import Expression, power
from surfacechem.laws.heat import ConductanceTable


class PressureConductance(UnderPressure, HeatTransfer):
    r"""Conductance of contact spots that grow with the pressure.

    .. math:: h = h_0 + h_c \left(\frac{p}{H}\right)^q

    Without pressure, and in tension, it is :math:`h_0`. Any parameter may vary with other variables by factors.
    Source: Sauer, Duong & Mandadapu (2021), eq. e:h_spot. 0 <= p <= H.

    >>> law = PressureConductance(between=("lower", "upper"), h_0=500.0, h_c=8e3, H=2e9)
    >>> round(law.conductance(p=2e9), 9)
    8500.0
    """

    channel = "spots"

    h_0: float = parameter("W/(m^2 K)", "conductance without pressure", default=0.0, at_least=0)
    h_c: float = parameter("W/(m^2 K)", "conductance added at p = H", at_least=0)
    H: float = parameter("Pa", "hardness of the softer body", above=0)
    q: float = parameter("1", "exponent of the pressure", default=0.95, above=0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """At p = H the contact is complete."""
        return {"p": (0.0, self.at_reference().H)}

    def conductance(self, p: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self.h_0 + self.h_c * power(p / self.H, self.q)


class BondedPressureConductance(UnderPressure, HeatTransfer):
    r"""Conductance of contact spots, different where they are bonded.

    .. math:: h = h_0 + h_c \left(\frac{p}{H}\right)^q, \quad
              h_0 = \phi h_0^b + (1 - \phi) h_0^{ub}, \quad h_c = \phi h_c^b + (1 - \phi) h_c^{ub}

    Source: Sauer, Duong & Mandadapu (2021), eq. e:h_spot and the one after it. 0 <= p <= H.

    >>> law = BondedPressureConductance(
    ...     between=("lower", "upper"), h_0_b=3e3, h_0_ub=500.0, h_c_b=2e4, h_c_ub=8e3, H=2e9)
    >>> round(law.conductance(p=2e9, phi=0.5), 9)
    15750.0
    """

    channel = "spots"

    h_0_b: float = parameter("W/(m^2 K)", "conductance without pressure, bonded", at_least=0)
    h_0_ub: float = parameter("W/(m^2 K)", "conductance without pressure, unbonded", default=0.0, at_least=0)
    h_c_b: float = parameter("W/(m^2 K)", "conductance added at p = H, bonded", at_least=0)
    h_c_ub: float = parameter("W/(m^2 K)", "conductance added at p = H, unbonded", at_least=0)
    H: float = parameter("Pa", "hardness of the softer body", above=0)
    q: float = parameter("1", "exponent of the pressure", default=0.95, above=0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """At p = H the contact is complete."""
        return {"p": (0.0, self.at_reference().H)}

    def conductance(self, p: Expression, phi: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        h_0 = phi * self.h_0_b + (1 - phi) * self.h_0_ub
        h_c = phi * self.h_c_b + (1 - phi) * self.h_c_ub
        return h_0 + h_c * power(p / self.H, self.q)


class CooperMikicYovanovich(UnderPressure, HeatTransfer):
    r"""Conductance of conforming rough surfaces whose asperities deform plastically.

    .. math:: h = 1.25\,\frac{k\,m}{\sigma} \left(\frac{p}{H}\right)^{0.95}

    Source: Cooper, Mikic & Yovanovich (1969), doi 10.1016/0017-9310(69)90011-8, in the correlation of Yovanovich
    (1981), AIAA paper 81-1164. About 1.5 % off the full model for 1e-6 <= p/H <= 2.3e-2; a run outside reports it.

    >>> law = CooperMikicYovanovich(between=("lower", "upper"), k=20.0, m=0.1, sigma=1e-6, H=2e9)
    >>> round(law.conductance(p=2e6), 6)
    3531.343862
    """

    channel = "spots"

    k: float = parameter("W/(m K)", "harmonic mean of the conductivities, 2 k_1 k_2 / (k_1 + k_2)", above=0)
    m: float = parameter("1", "mean absolute slope of the asperities, sqrt(m_1^2 + m_2^2)", above=0)
    sigma: float = parameter("m", "rms roughness, sqrt(sigma_1^2 + sigma_2^2)", above=0)
    H: float = parameter("Pa", "micro-hardness of the softer body", above=0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Range in which the correlation was fitted."""
        # A varying hardness is taken at its reference value: the range only serves a warning.
        hardness = self.at_reference().H
        return {"p": (1e-6 * hardness, 2.3e-2 * hardness)}

    def conductance(self, p: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return 1.25 * self.k * self.m / self.sigma * power(p / self.H, 0.95)


class MikicElastic(UnderPressure, HeatTransfer):
    r"""Conductance of conforming rough surfaces whose asperities deform elastically.

    .. math:: h = 1.55\,\frac{k\,m}{\sigma} \left(\frac{\sqrt2\,p}{E' m}\right)^{0.94}

    Source: Mikic (1974), doi 10.1016/0017-9310(74)90082-9. About 2 % off the full model for
    1e-5 <= sqrt(2) p / (E' m) <= 2e-2; a run outside reports it.

    >>> law = MikicElastic(between=("lower", "upper"), k=20.0, m=0.1, sigma=1e-6, E=1.1e11)
    >>> round(law.conductance(p=2e6), 6)
    1308.895166
    """

    channel = "spots"

    k: float = parameter("W/(m K)", "harmonic mean of the conductivities, 2 k_1 k_2 / (k_1 + k_2)", above=0)
    m: float = parameter("1", "mean absolute slope of the asperities, sqrt(m_1^2 + m_2^2)", above=0)
    sigma: float = parameter("m", "rms roughness, sqrt(sigma_1^2 + sigma_2^2)", above=0)
    E: float = parameter("Pa", "effective modulus E', 1 / [(1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2]", above=0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Range in which the correlation was fitted."""
        law = self.at_reference()
        hardness = law.E * law.m / math.sqrt(2)
        return {"p": (1e-5 * hardness, 2e-2 * hardness)}

    def conductance(self, p: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        relative = math.sqrt(2) * p / (self.E * self.m)
        return 1.55 * self.k * self.m / self.sigma * power(relative, 0.94)


class SongYovanovich(UnderPressure, HeatTransfer):
    r"""Conductance of plastic asperities whose hardness depends on the size of the indents.

    .. math:: h = 1.25\,\frac{k\,m}{\sigma} \left(\frac{p}{H_c}\right)^{0.95}, \quad
              \frac{p}{H_c} = \left[\frac{p}{c_1 (1.62\,\sigma / (\sigma_0 m))^{c_2}}\right]^{1/(1 + 0.071 c_2)}

    The Vickers micro-hardness of the softer body is :math:`c_1 (d / \sigma_0)^{c_2}` with the diagonal d of the indent
    and :math:`\sigma_0` = 1 um. Source: Song & Yovanovich (1988), Journal of Thermophysics and Heat Transfer 2, 43,
    with the correlation of cooper-mikic-yovanovich. Range 1e-6 <= p/H_c <= 2.3e-2; a run outside reports it.

    >>> law = SongYovanovich(between=("lower", "upper"), k=20.0, m=0.1, sigma=1e-6, c_1=6e9, c_2=-0.26)
    >>> round(law.relative_pressure(2e6), 9)
    0.000599615
    >>> round(law.conductance(p=2e6), 6)
    2172.293834
    """

    channel = "spots"

    k: float = parameter("W/(m K)", "harmonic mean of the conductivities, 2 k_1 k_2 / (k_1 + k_2)", above=0)
    m: float = parameter("1", "mean absolute slope of the asperities, sqrt(m_1^2 + m_2^2)", above=0)
    sigma: float = parameter("m", "rms roughness, sqrt(sigma_1^2 + sigma_2^2)", above=0)
    c_1: float = parameter("Pa", "Vickers hardness at an indent of 1 um", above=0)
    c_2: float = parameter("1", "size index of the hardness, negative where small indents are harder", above=-10)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Range in which the correlation was fitted."""
        law = self.at_reference()
        size = law.c_1 * law.indent**law.c_2
        exponent = 1 + 0.071 * law.c_2
        return {"p": (size * 1e-6**exponent, size * 2.3e-2**exponent)}

    @property
    def indent(self) -> Expression:
        """Size of an indent in um."""
        return 1.62e6 * self.sigma / self.m

    def relative_pressure(self, p: Expression) -> Expression:
        """Pressure relative to the hardness at the size of the contact spots."""
        return power(p / (self.c_1 * self.indent**self.c_2), 1 / (1 + 0.071 * self.c_2))

    def conductance(self, p: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return 1.25 * self.k * self.m / self.sigma * power(self.relative_pressure(p), 0.95)


class PressureTable(UnderPressure, ConductanceTable):
    r"""Measured conductance at given pressures, interpolated by monotone cubics.

    .. math:: h = h(p), \quad h(p_j) = h_j

    Beyond its ends the table is held, continued by its end slopes (never below zero), or refused: then the run stops.
    Source: interpolation of Fritsch & Butland (1984), doi 10.1137/0905021; the values are the user's.

    >>> law = PressureTable(between=("lower", "upper"), pressures=[0, 1e6, 3e6], conductances=[500, 1500, 2000])
    >>> [law.conductance(p=p) for p in (0.0, 1e6, 9e6)]
    [500.0, 1500.0, 2000.0]
    """

    channel = "spots"
    over = "p"
    points = "pressures"

    pressures: Sequence[float] = option("pressures, increasing [Pa]")

    def conductance(self, p: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self._interpolated(p)
