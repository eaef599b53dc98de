"""What load does to a rate coefficient, one formula each, for bonding laws and mechanisms alike.

Every factor is stated as its logarithm: a rate is one exponential of a sum, and a factor of e^1000 is no infinity.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from surfacechem.contracts.terms import RateFactor, RateLaw, Varying, parameter
from surfacechem.expressions import FRACTION_FLOOR, Expression, is_symbolic, log, log_fraction, log_sum, power, where
from surfacechem.quantities import BOLTZMANN


class BellFactor(RateFactor):
    r"""Force lowers the barrier by its work on the way to the transition state.

    .. math:: \ln\frac{k}{k_0} = \frac{f x_\beta}{k_B T}

    Positive x for rupture, negative for formation under load. Source: Bell (1978), Science 200, 618, doi
    10.1126/science.347575; Evans & Ritchie (1997), doi 10.1016/S0006-3495(97)78802-7. While f x stays below
    the barrier.

    >>> round(BellFactor(x_beta=4e-10).log_factor(f=30e-12, T_c=300.0), 6)
    2.897188
    """

    x_beta: float = parameter("m", "distance to the transition state")

    def log_factor(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        return f * self.x_beta / (BOLTZMANN * T_c)


class DemboFactor(RateFactor):
    r"""A bond spring that is stiffer or softer in the transition state.

    .. math:: \ln\frac{k}{k_0} = \frac{(\kappa - \kappa_{ts}) f^2}{2 \kappa^2 k_B T}

    A slip bond for :math:`\kappa_{ts} < \kappa`, an ideal bond where both are equal, a catch bond beyond; f is the
    spring's :math:`\kappa (l - \lambda)`. Source: Dembo, Torney, Saxman & Hammer (1988), Proc. R. Soc. Lond. B 234, 55,
    doi 10.1098/rspb.1988.0038.

    >>> round(DemboFactor(stiffness=2e-3, transition_stiffness=1e-3).log_factor(f=4e-12, T_c=300.0), 6)
    0.482865
    """

    stiffness: float = parameter("N/m", "stiffness of the bond", above=0)
    transition_stiffness: float = parameter("N/m", "stiffness of the bond in the transition state", at_least=0)

    def log_factor(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        softening = self.stiffness - self.transition_stiffness
        return softening * f**2 / (2 * self.stiffness**2 * BOLTZMANN * T_c)


class DemboFormationFactor(RateFactor):
    r"""Formation of a stretched bond: its spring in the transition state has to be stretched first.

    .. math:: \ln\frac{k}{k_0} = -\frac{\kappa_{ts} f^2}{2 \kappa^2 k_B T}

    With the rupture rate of Dembo's spring the two keep detailed balance for the elastic energy
    :math:`f^2 / 2 \kappa`. Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038.

    >>> round(DemboFormationFactor(stiffness=2e-3, transition_stiffness=1e-3).log_factor(f=4e-12, T_c=300.0), 6)
    -0.482865
    """

    stiffness: float = parameter("N/m", "stiffness of the bond", above=0)
    transition_stiffness: float = parameter("N/m", "stiffness of the bond in the transition state", at_least=0)

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """A spring that forms unstretched."""
        return {"f": 0.0}

    def log_factor(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        return -self.transition_stiffness * f**2 / (2 * self.stiffness**2 * BOLTZMANN * T_c)


class TwoPathwayFactor(RateFactor):
    r"""Two ways out of one bound state: force closes the catch pathway and opens the slip pathway.

    .. math:: \frac{k}{k_{slip}} = e^{f x_{slip} / k_B T} + r_c\,e^{-f x_{catch} / k_B T}

    The lifetime is longest at :math:`f^* = \frac{k_B T}{x_{slip} + x_{catch}} \ln\frac{r_c x_{catch}}{x_{slip}}`.
    Source: Pereverzev, Prezhdo, Forero, Sokurenko & Thomas (2005), Biophys. J. 89, 1446, doi
    10.1529/biophysj.105.062158.

    >>> law = TwoPathwayFactor(x_slip=2e-10, x_catch=2e-9, catch_ratio=100.0)
    >>> [round(law.log_factor(f=f, T_c=300.0), 4) for f in (0.0, 10e-12, 50e-12)]
    [4.6151, 0.884, 2.4143]
    """

    x_slip: float = parameter("m", "distance to the barrier of the slip pathway", at_least=0)
    x_catch: float = parameter("m", "distance to the barrier of the catch pathway", at_least=0)
    catch_ratio: float = parameter("1", "rate of the catch pathway over that of the slip pathway, at no force", above=0)

    def log_factor(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        work = f / (BOLTZMANN * T_c)
        return log_sum([work * self.x_slip, log(self.catch_ratio) - work * self.x_catch])


class DudkoFactor(RateFactor):
    r"""Escape over a barrier of a given shape that the force tilts away.

    .. math:: \ln\frac{k}{k_0} = \left(\frac1\nu - 1\right) \ln s + \frac{\Delta G}{k_B T}\left(1 - s^{1/\nu}\right),
              \quad s = 1 - \frac{\nu f x_\beta}{\Delta G}

    :math:`\nu = 1/2` is a cusp, 2/3 a cubic well, 1 the law of Bell. Source: Dudko, Hummer & Szabo (2006), Phys. Rev.
    Lett. 96, 108101, doi 10.1103/PhysRevLett.96.108101. While a barrier above k_B T is left, s^(1/nu) > k_B T / dG;
    beyond, the rate stays at its largest value.

    >>> law = DudkoFactor(x_beta=4e-10, barrier=6e-20, nu=0.5)
    >>> round(law.log_factor(f=50e-12, T_c=300.0), 6)
    4.243938
    """

    x_beta: float = parameter("m", "distance to the transition state at no force", above=0)
    barrier: float = parameter("J", "free energy of activation at no force", above=0)
    nu: float = parameter("1", "shape of the barrier: 1/2 cusp, 2/3 cubic, 1 linear", above=0, at_most=1, varies=False)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Forces below that at which the barrier vanishes."""
        numbers: tuple[Any, ...] = (self.barrier, self.x_beta, self.nu)
        if any(isinstance(number, Varying) for number in numbers):
            return {}
        return {"f": (-math.inf, self.barrier / (self.nu * self.x_beta))}

    def log_factor(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        height = self.barrier / (BOLTZMANN * T_c)
        tilt = 1 - self.nu * f * self.x_beta / self.barrier
        lowest = power((1 - self.nu) / height, self.nu) + FRACTION_FLOOR
        s = where(tilt > lowest, tilt, lowest)
        return (1 / self.nu - 1) * log(s) + height * (1 - s ** (1 / self.nu))


class GapFactor(RateFactor):
    r"""Bonds form where thermal motion stretches their tether across the gap.

    .. math:: \ln\frac{k}{k_0} = -\frac{k_b (g_n - l_0)^2}{2 k_B T}

    Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038, for a transition state as stiff as the
    bond. Any g_n.

    >>> round(GapFactor(stiffness=1e-3, rest_length=2e-8).log_factor(g_n=2.4e-8, T_c=300.0), 6)
    -1.931459
    """

    stiffness: float = parameter("N/m", "stiffness of the tether", at_least=0)
    rest_length: float = parameter("m", "gap at which the tether is not stretched", default=0.0)

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """The gap that does not stretch the tether."""
        return {"g_n": self.rest_length}

    def log_factor(self, g_n: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor."""
        return -self.stiffness * (g_n - self.rest_length) ** 2 / (2 * BOLTZMANN * T_c)


class StatedBothWays(RateLaw):
    """Bonds that form and break at coefficients of their own; subclasses state these."""

    @abstractmethod
    def log_coefficients(self, f: Expression, T_c: Expression) -> tuple[Expression, Expression]:
        """Logarithms of the coefficients of formation and rupture."""

    @property
    def log_ratio(self) -> Callable[..., Expression] | None:
        """Logarithm of the rate of formation over that of rupture; None where no bonds form."""
        k_on = vars(self)["k_on"]
        return self._log_ratio if is_symbolic(k_on) or k_on else None

    def _log_ratio(self, phi: Expression, f: Expression, T_c: Expression) -> Expression:
        on, off = self.log_coefficients(f, T_c)
        return on - off + log_fraction(1 - phi) - log_fraction(phi)
