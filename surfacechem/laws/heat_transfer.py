"""Heat transfer: conductance, radiation, open gaps with transition to contact, gas or a table, and contact spots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import ClassVar, Literal

from surfacechem.contracts.terms import HeatTransfer, UnderPressure, option, parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, exp, monotone_cubics, positive, power
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
    the second. Surroundings much larger than the surface have an emissivity of one. A gap must be much wider than the
    thermal wavelength, about 10 um at 300 K: near-field transfer across narrower gaps is stronger.
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


class GapConductance(HeatTransfer):
    r"""Conductance of a gap: contact spots whose part decays exponentially, gas and radiation that take over.

    .. math:: h = h_{rad} + h_{gas} + (h_0 - h_{rad} - h_{gas})\,e^{-C_{trans} g_n}, \quad
              h_{gas} = \frac{k_{gas}}{g_n + g_0}, \quad
              h_{rad} = \frac{\sigma (T_1^2 + T_2^2)(T_1 + T_2)}{1/\varepsilon_1 + 1/\varepsilon_2 - 1}

    In contact (:math:`g_n \le 0`) it is :math:`h_0`; a contribution of the pressure is a separate path. It falls as the
    gap opens only while :math:`h_{gas}(0) + h_{rad} \le h_0`; a scene in which it rises at first gives a warning. Its
    three parts, spots, gas and radiation, are separate fluxes. Any parameter may vary with other variables by factors.
    Source: Sauer, Duong & Mandadapu (2021), section on heat transfer, after Laschet, Jakumeit & Benke (2004).

    >>> law = GapConductance(between=("lower", "upper"), h_0=2e4, C_trans=2e6, k_gas=0.026, g_0=3.7e-7,
    ...                      epsilon_1=0.8, epsilon_2=0.6)
    >>> round(law.conductance(g_n=1e-6, T_from=350.0, T_to=500.0), 9)
    19124.500517079
    """

    h_0: float = parameter("W/(m^2 K)", "conductance at touch", at_least=0)
    C_trans: float = parameter("1/m", "decay of the contact per opening", above=0)
    k_gas: float = parameter("W/(m K)", "conductivity of the gas", at_least=0)
    g_0: float = parameter("m", "gap of the gas at touch: roughness and temperature jumps", above=0)
    epsilon_1: float = parameter("1", "emissivity of the first end", above=0, at_most=1)
    epsilon_2: float = parameter("1", "emissivity of the second end", above=0, at_most=1)

    peaks: ClassVar[Mapping[str, float]] = {"g_n": 0.0}
    """Touch, beyond which the conductance of the contact spots decays within a short distance."""

    def channels(self) -> Mapping[str, Callable[..., Expression]]:
        """Contact spots, gas and radiation."""
        return {"spots": self.spots, "gas": self.gas, "radiation": self.radiation}

    def _contact_fraction(self, g_n: Expression) -> Expression:
        """Fraction of the contact spots that remains."""
        return exp(-self.C_trans * positive(g_n))

    def spots(self, g_n: Expression) -> Expression:
        """Conductance of the contact spots [W/(m^2 K)]."""
        # The three sum to the total formula, so that each is a flux.
        return self.h_0 * self._contact_fraction(g_n)

    def gas(self, g_n: Expression) -> Expression:
        """Conductance of the gas [W/(m^2 K)]."""
        return self.k_gas / (positive(g_n) + self.g_0) * (1 - self._contact_fraction(g_n))

    def radiation(self, g_n: Expression, T_from: Expression, T_to: Expression) -> Expression:
        """Conductance of the radiation [W/(m^2 K)]."""
        black = STEFAN_BOLTZMANN * (T_from**2 + T_to**2) * (T_from + T_to)
        return black / (1 / self.epsilon_1 + 1 / self.epsilon_2 - 1) * (1 - self._contact_fraction(g_n))

    def conductance(self, g_n: Expression, T_from: Expression, T_to: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self.spots(g_n) + self.gas(g_n) + self.radiation(g_n, T_from, T_to)


class GasGap(HeatTransfer):
    r"""Conduction through a gas layer, with temperature jumps at its walls.

    .. math:: h = \frac{k}{Y + g_n + M}, \quad
              M = \left(\frac{2 - \alpha_1}{\alpha_1} + \frac{2 - \alpha_2}{\alpha_2}\right)
              \frac{2 \gamma}{\gamma + 1} \frac{\Lambda}{\mathrm{Pr}}

    :math:`\Lambda` is the mean free path; M of air at 300 K and 1 atm is 0.22 um at best. In contact the gas keeps the
    mean thickness Y of the voids. For a medium that the case names use rarefied-film, which computes M.
    Source: Yovanovich, DeVaal & Hegazy (1982), AIAA paper 82-0888. From continuum to free molecular flow within a few
    per cent, for jumps much smaller than the temperatures.

    >>> law = GasGap(between=("lower", "upper"), k=0.026, M=3.7e-7)
    >>> round(law.conductance(g_n=1e-6), 6)
    18978.10219
    """

    channel = "gas"

    k: float = parameter(
        "W/(m K)", "conductivity of the gas; of a medium that the case names it is in rarefied-film", above=0
    )
    M: float = parameter("m", "temperature jump distance of both walls", default=0.0, at_least=0)
    Y: float = parameter("m", "mean gap at touch, left by the roughness", default=0.0, at_least=0)

    @property
    def positive(self) -> tuple[str, ...]:  # type: ignore[override]
        """The gap, if neither roughness nor temperature jumps bound the conductance as it closes."""
        return () if self.M or self.Y else ("g_n",)

    def conductance(self, g_n: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self.k / (positive(g_n) + self.Y + self.M)


class ConductanceTable(HeatTransfer):
    """Conductances measured at points of one variable; subclasses have the points as a field, and state the law.

    Points are joined by monotone cubics: no overshoot, continuous slope, never below zero.

    Source: Fritsch & Butland (1984), doi 10.1137/0905021.
    """

    over: ClassVar[str]
    """The variable."""
    points: ClassVar[str]
    """The field with its points."""

    conductances: Sequence[float] = option("conductances at the points [W/(m^2 K)]")
    extrapolation: Literal["hold", "linear", "refuse"] = option("beyond the ends of the table", default="hold")

    def __post_init__(self) -> None:
        """Check that the points are finite, increasing, not negative and at least two."""
        super().__post_init__()
        at, values, of = self._at, self.conductances, self.points
        if len(at) != len(values) or len(at) < 2:
            raise InputError(f"a table needs as many {of} ({len(at)}) as conductances ({len(values)}), at least 2.")
        if not all(math.isfinite(x) for x in (*at, *values)) or min(values) < 0:
            raise InputError(f"{of} and conductances of a table must be finite, and the conductances not negative.")
        if any(b <= a for a, b in pairwise(at)):
            raise InputError(f"{of} of a table must increase from each to the next.")

    @property
    def _at(self) -> Sequence[float]:
        found: Sequence[float] = getattr(self, self.points)
        return found

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """From the first to the last point of the table."""
        return {self.over: (self._at[0], self._at[-1])}

    @property
    def peaks(self) -> Mapping[str, Sequence[float]]:
        """The points of the table, between which the value may change arbitrarily."""
        return {self.over: tuple(self._at)}

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The ends of a table that is not extrapolated."""
        return self.ranges if self.extrapolation == "refuse" else {}

    def _interpolated(self, x: Expression) -> Expression:
        """Return the conductance [W/(m^2 K)] at x; beyond the ends it is constant or continues with the end slope."""
        from scipy.interpolate import PchipInterpolator

        at, values, linear = self._at, self.conductances, self.extrapolation == "linear"
        slopes = PchipInterpolator(at, values)((at[0], at[-1]), 1).tolist() if linear else (0.0, 0.0)
        before, beyond = (values[k] + slopes[k] * (x - at[k]) for k in (0, -1))
        result = monotone_cubics(x, at, values, before, beyond)
        return positive(result) if linear else result


class GapTable(ConductanceTable):
    r"""Measured conductance at given gaps, interpolated by monotone cubics.

    .. math:: h = h(g_n), \quad h(g_j) = h_j

    Beyond its ends the table is constant, continued with its end slopes (never below zero), or refused: then the run
    stops. Source: interpolation of Fritsch & Butland (1984), doi 10.1137/0905021; the values are the user's.

    >>> law = GapTable(between=("lower", "upper"), gaps=[0, 1e-6, 1e-5], conductances=[2e4, 1.9e4, 2.5e3])
    >>> [law.conductance(g_n=g) for g in (0.0, 1e-6, 1.0)]
    [20000.0, 19000.0, 2500.0]
    """

    channel = "gap"
    over = "g_n"
    points = "gaps"

    gaps: Sequence[float] = option("gaps, increasing [m]")

    def conductance(self, g_n: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self._interpolated(g_n)


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


class Conforming(UnderPressure, HeatTransfer):
    """Conductance of conforming rough surfaces that touch in spots."""

    channel = "spots"

    k: float = parameter("W/(m K)", "harmonic mean of the conductivities, 2 k_1 k_2 / (k_1 + k_2)", above=0)
    m: float = parameter("1", "mean absolute slope of the asperities, sqrt(m_1^2 + m_2^2)", above=0)
    sigma: float = parameter("m", "rms roughness, sqrt(sigma_1^2 + sigma_2^2)", above=0)


class CooperMikicYovanovich(Conforming):
    r"""Conductance of conforming rough surfaces whose asperities deform plastically.

    .. math:: h = 1.25\,\frac{k\,m}{\sigma} \left(\frac{p}{H}\right)^{0.95}

    Source: Cooper, Mikic & Yovanovich (1969), doi 10.1016/0017-9310(69)90011-8, in the correlation of Yovanovich
    (1981), AIAA paper 81-1164. About 1.5 % off the full model for 1e-6 <= p/H <= 2.3e-2; a run outside reports it.

    >>> law = CooperMikicYovanovich(between=("lower", "upper"), k=20.0, m=0.1, sigma=1e-6, H=2e9)
    >>> round(law.conductance(p=2e6), 6)
    3531.343862
    """

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


class MikicElastic(Conforming):
    r"""Conductance of conforming rough surfaces whose asperities deform elastically.

    .. math:: h = 1.55\,\frac{k\,m}{\sigma} \left(\frac{\sqrt2\,p}{E' m}\right)^{0.94}

    Source: Mikic (1974), doi 10.1016/0017-9310(74)90082-9. About 2 % off the full model for
    1e-5 <= sqrt(2) p / (E' m) <= 2e-2; a run outside reports it.

    >>> law = MikicElastic(between=("lower", "upper"), k=20.0, m=0.1, sigma=1e-6, E=1.1e11)
    >>> round(law.conductance(p=2e6), 6)
    1308.895166
    """

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


class SongYovanovich(Conforming):
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
        # Powers of bounded exponents, however large factors make the size index.
        exponent = 1 / (1 + 0.071 * self.c_2)
        return power(p / self.c_1, exponent) * self.indent ** (-self.c_2 * exponent)

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
