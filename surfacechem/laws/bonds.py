"""Bonds under load: Bell, Dembo spring, two pathways, Dudko-Hummer-Szabo, attachment across a gap.

The effect of load on a rate coefficient is one formula each, for bonding laws and mechanisms alike: ``log_on`` of
formation and ``log_off`` of rupture. Each is a logarithm, so that a rate is one exponential of a sum, and a factor of
e^1000 does not overflow. ``rate_types`` lists the formulas that mechanisms may use.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

from surfacechem.contracts.terms import RateLaw, RateType, parameter
from surfacechem.expressions import (
    Expression,
    is_symbolic,
    log,
    log_fraction,
    log_sum,
    power,
    scaled_exp,
    scaled_expm1,
    where,
)
from surfacechem.quantities import BOLTZMANN
from surfacechem.tolerances import FRACTION_FLOOR


class BondRates(RateLaw):
    """Bonds with rate coefficients of formation and of rupture; subclasses state the effect of load on each."""

    keeps_range = True
    off: ClassVar[str] = "k_off"
    """Parameter that is the rate of rupture at zero force."""

    def log_on(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor of the force on formation: zero, no effect."""
        return 0

    @abstractmethod
    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor of the force on rupture."""

    def rate(self, phi: Expression, n_c: Expression, f: Expression, T_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        numbers = vars(self)
        on = scaled_exp(numbers["k_on"], self.log_on(f, T_c))
        return n_c * (on * (1 - phi) - scaled_exp(numbers[self.off], self.log_off(f, T_c)) * phi)

    def log_coefficients(self, f: Expression, T_c: Expression) -> tuple[Expression, Expression]:
        """Logarithms of the coefficients of formation and rupture."""
        numbers = vars(self)
        return (
            log_fraction(numbers["k_on"]) + self.log_on(f, T_c),
            log_fraction(numbers[self.off]) + self.log_off(f, T_c),
        )

    @property
    def log_ratio(self) -> Callable[..., Expression] | None:
        """Logarithm of the rate of formation over that of rupture; None if no bonds form."""
        # A symbol is a number that a run may change, so that bonds may form.
        k_on = vars(self)["k_on"]
        return self._log_ratio if is_symbolic(k_on) or k_on else None

    def _log_ratio(self, phi: Expression, f: Expression, T_c: Expression) -> Expression:
        on, off = self.log_coefficients(f, T_c)
        return on - off + log_fraction(1 - phi) - log_fraction(phi)


class Bell(BondRates):
    r"""Slip bond: force speeds up rupture, and slows down or speeds up formation.

    .. math:: R = n_c \left[ k_{on} e^{f x_{on} / k_B T_c} (1 - \phi) - k_{off} e^{f x_{off} / k_B T_c}\,\phi \right]

    Source: Bell (1978), Science 200, 618, doi 10.1126/science.347575. A negative x_off is a catch bond. Valid while f x
    is below the barrier. The rates are independent of a potential: the audit reports whether they agree with it.

    >>> Bell(k_off=0.1, x_off=4e-10).rate(phi=1.0, n_c=1.0, f=30e-12, T_c=300.0)
    -1.8123115...
    """

    rate_types = (RateType("Bell", "log_off", {"k_off": 1.0}, renamed={"x_beta": "x_off"}, distance="x_off"),)

    k_off: float = parameter("1/s", "rate of rupture at no force", at_least=0)
    x_off: float = parameter("m", "distance to the transition state", default=0.0)
    k_on: float = parameter("1/s", "rate of formation at no force", default=0.0, at_least=0)
    x_on: float = parameter("m", "distance to the transition state of formation", default=0.0)

    @property
    def length(self) -> Expression | None:
        """Difference of the two distances to the transition state, if bonds form too."""
        # Without formation there is no work of formation.
        return None if self.log_ratio is None else self.x_on - self.x_off

    def log_on(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of the factor of the force on formation: its work up to the transition state."""
        return f * self.x_on / (BOLTZMANN * T_c)

    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        r"""Force lowers the barrier by its work on the way to the transition state.

        .. math:: \ln\frac{k}{k_0} = \frac{f x_\beta}{k_B T}

        Positive x for rupture, negative for formation under load. Source: Bell (1978), Science 200, 618, doi
        10.1126/science.347575; Evans & Ritchie (1997), doi 10.1016/S0006-3495(97)78802-7. While f x stays below
        the barrier.

        >>> round(Bell(k_off=1.0, x_off=4e-10).log_off(f=30e-12, T_c=300.0), 6)
        2.897188
        """
        return f * self.x_off / (BOLTZMANN * T_c)


class ReversibleBell(RateLaw):
    r"""Slip bond whose formation follows from the potential, so that detailed balance holds under force.

    .. math:: R = -n_c k_{off} e^{f x_{off} / k_B T_c}\,\phi \left( 1 - e^{-\mu / k_B T_c} \right)

    With a lattice gas and bond springs, whose energy includes the force, bonds form at the rate
    :math:`k_{off} e^{(\varepsilon + f x_{off} - w_b) / k_B T_c}`. A prescribed force does work over the length
    :math:`\ell = x_{on} - x_{off}` by which a forming bond lets it down: the work belongs to the affinity,
    :math:`\mu - f \ell` replaces :math:`\mu`, and bonds form at the rate
    :math:`k_{off} e^{(\varepsilon + f x_{on}) / k_B T_c}`. The equilibrium then obeys

    .. math:: \frac{d}{df} \ln\frac{\phi}{1 - \phi} = \frac{\ell}{k_B T_c}

    Source: Bell (1978), doi 10.1126/science.347575, with the reverse of Sauer, Duong & Mandadapu (2021), section 4.
    Always admissible; the potential should contain mixing.

    >>> ReversibleBell(k_off=0.1, x_off=4e-10).rate(phi=0.5, n_c=1.0, f=0.0, T_c=300.0, mu=1e-20)
    -0.045528...
    """

    k_off: float = parameter("1/s", "rate of rupture at no force", at_least=0)
    x_off: float = parameter("m", "distance to the transition state", default=0.0)
    x_on: float | None = parameter(
        "m", "distance to the transition state of formation, under a prescribed force only", default=None
    )

    @property
    def length(self) -> Expression | None:
        """Difference of the two distances to the transition state, if both are given."""
        return None if self.x_on is None else self.x_on - self.x_off

    def rate(self, phi: Expression, n_c: Expression, f: Expression, T_c: Expression, mu: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        breaking = Bell(k_off=self.k_off, x_off=self.x_off).log_off(f, T_c) + log_fraction(phi)
        # Rupture and formation in one function: near equilibrium they differ in their last digits only.
        return n_c * scaled_expm1(self.k_off, -mu / (BOLTZMANN * T_c), breaking)


class DemboSpring(BondRates):
    r"""Bond spring: a slip, ideal or catch bond, depending on its stiffness in the transition state.

    .. math:: R = n_c \left[ k_{on} e^{-\kappa_{ts} f^2 / 2 \kappa^2 k_B T_c} (1 - \phi)
              - k_{off} e^{(\kappa - \kappa_{ts}) f^2 / 2 \kappa^2 k_B T_c}\,\phi \right]

    Source: Dembo, Torney, Saxman & Hammer (1988), Proc. R. Soc. Lond. B 234, 55, doi 10.1098/rspb.1988.0038, with the
    force of the spring. Keeps detailed balance with bond springs of the same stiffness and a lattice gas of
    :math:`\varepsilon = k_B T \ln(k_{on} / k_{off})`.

    >>> DemboSpring(k_off=0.1, stiffness=2e-3, transition_stiffness=1e-3).rate(phi=1.0, n_c=1.0, f=4e-12, T_c=300.0)
    -0.162071...
    """

    rate_types = (
        RateType("Dembo", "log_off", {"k_off": 1.0}, ("stiffness", "transition_stiffness")),
        RateType("Dembo-formation", "log_on", {"k_off": 0.0, "k_on": 1.0}, ("stiffness", "transition_stiffness")),
    )

    k_off: float = parameter("1/s", "rate of rupture at no force", at_least=0)
    stiffness: float = parameter("N/m", "stiffness of the bond", above=0)
    transition_stiffness: float = parameter("N/m", "stiffness of the bond in the transition state", at_least=0)
    k_on: float = parameter("1/s", "rate of formation at no force", default=0.0, at_least=0)

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """Zero force, at which the formation of an unstretched spring has its peak."""
        return {} if self.log_ratio is None else {"f": 0.0}

    def log_on(self, f: Expression, T_c: Expression) -> Expression:
        r"""Formation of a stretched bond: its spring in the transition state has to be stretched first.

        .. math:: \ln\frac{k}{k_0} = -\frac{\kappa_{ts} f^2}{2 \kappa^2 k_B T}

        With the rupture rate of Dembo's spring the two keep detailed balance for the elastic energy
        :math:`f^2 / 2 \kappa`. Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038.

        >>> spring = DemboSpring(k_off=0.0, k_on=1.0, stiffness=2e-3, transition_stiffness=1e-3)
        >>> round(spring.log_on(f=4e-12, T_c=300.0), 6)
        -0.482865
        """
        return -self.transition_stiffness * f**2 / (2 * self.stiffness**2 * BOLTZMANN * T_c)

    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        r"""A bond spring that is stiffer or softer in the transition state.

        .. math:: \ln\frac{k}{k_0} = \frac{(\kappa - \kappa_{ts}) f^2}{2 \kappa^2 k_B T}

        A slip bond for :math:`\kappa_{ts} < \kappa`, an ideal bond if both are equal, else a catch bond; f is the
        spring's :math:`\kappa (l - \lambda)`. Source: Dembo, Torney, Saxman & Hammer (1988), Proc. R. Soc. Lond. B 234,
        55, doi 10.1098/rspb.1988.0038.

        >>> spring = DemboSpring(k_off=1.0, stiffness=2e-3, transition_stiffness=1e-3)
        >>> round(spring.log_off(f=4e-12, T_c=300.0), 6)
        0.482865
        """
        softening = self.stiffness - self.transition_stiffness
        return softening * f**2 / (2 * self.stiffness**2 * BOLTZMANN * T_c)


class TwoPathway(BondRates):
    r"""Catch-slip bond: force closes one pathway out of the bound state and opens another.

    .. math:: R = n_c \left[ k_{on} (1 - \phi)
              - \left( k_{slip} e^{f x_{slip} / k_B T_c} + k_{catch} e^{-f x_{catch} / k_B T_c} \right) \phi \right]

    Source: Pereverzev, Prezhdo, Forero, Sokurenko & Thomas (2005), Biophys. J. 89, 1446, doi
    10.1529/biophysj.105.062158.

    >>> TwoPathway(k_slip=0.1, x_slip=2e-10, k_catch=10.0, x_catch=2e-9).rate(phi=1.0, n_c=1.0, f=0.0, T_c=300.0)
    -10.1...
    """

    off = "k_slip"
    rate_types = (
        RateType("two-pathway", "log_off", {"k_slip": 1.0}, ("x_slip", "x_catch"), ratios={"catch_ratio": "k_catch"}),
    )

    k_slip: float = parameter("1/s", "rate of the slip pathway at no force", above=0)
    x_slip: float = parameter("m", "distance to the barrier of the slip pathway", at_least=0)
    k_catch: float = parameter("1/s", "rate of the catch pathway at no force", above=0)
    x_catch: float = parameter("m", "distance to the barrier of the catch pathway", at_least=0)
    k_on: float = parameter("1/s", "rate of formation", default=0.0, at_least=0)

    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        r"""Two pathways out of one bound state: force closes the catch pathway and opens the slip pathway.

        .. math:: \frac{k}{k_{slip}} = e^{f x_{slip} / k_B T} + r_c\,e^{-f x_{catch} / k_B T}

        The lifetime is longest at :math:`f^* = \frac{k_B T}{x_{slip} + x_{catch}} \ln\frac{r_c x_{catch}}{x_{slip}}`.
        Source: Pereverzev, Prezhdo, Forero, Sokurenko & Thomas (2005), Biophys. J. 89, 1446, doi
        10.1529/biophysj.105.062158.

        >>> law = TwoPathway(k_slip=1.0, x_slip=2e-10, x_catch=2e-9, k_catch=100.0)
        >>> [round(law.log_off(f=f, T_c=300.0), 4) for f in (0.0, 10e-12, 50e-12)]
        [4.6151, 0.884, 2.4143]
        """
        work = f / (BOLTZMANN * T_c)
        return log_sum([work * self.x_slip, log(self.k_catch / self.k_slip) - work * self.x_catch])


class DudkoHummerSzabo(BondRates):
    r"""Slip bond with a barrier of a given height and shape.

    .. math:: R = n_c \left[ k_{on} (1 - \phi) - k_{off}\,s^{1/\nu - 1}
              e^{\Delta G (1 - s^{1/\nu}) / k_B T_c}\,\phi \right], \quad s = 1 - \frac{\nu f x_{off}}{\Delta G}

    :math:`\nu = 1/2` is a cusp, 2/3 a cubic well, 1 the law of Bell. Source: Dudko, Hummer & Szabo (2006), Phys. Rev.
    Lett. 96, 108101, doi 10.1103/PhysRevLett.96.108101. Valid while the barrier exceeds k_B T; beyond, the rate stays
    at its largest value.

    >>> DudkoHummerSzabo(k_off=0.1, x_off=4e-10, barrier=6e-20).rate(phi=1.0, n_c=1.0, f=50e-12, T_c=300.0)
    -8.3417844...
    """

    rate_types = (RateType("Dudko-Hummer-Szabo", "log_off", {"k_off": 1.0}, ("barrier", "nu"), {"x_beta": "x_off"}),)

    k_off: float = parameter("1/s", "rate of rupture at no force", at_least=0)
    x_off: float = parameter("m", "distance to the transition state at no force", above=0)
    barrier: float = parameter("J", "free energy of activation at no force", above=0)
    nu: float = parameter("1", "shape of the barrier: 1/2 cusp, 2/3 cubic, 1 linear", default=2 / 3, above=0, at_most=1)
    k_on: float = parameter("1/s", "rate of formation", default=0.0, at_least=0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Forces below the one at which the barrier vanishes."""
        if self.varying.keys() & {"barrier", "x_off", "nu"}:
            return {}
        return {"f": (-math.inf, self.barrier / (self.nu * self.x_off))}

    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        r"""Escape over a barrier of a given shape that the force tilts away.

        .. math:: \ln\frac{k}{k_0} = \left(\frac1\nu - 1\right) \ln s
                  + \frac{\Delta G}{k_B T}\left(1 - s^{1/\nu}\right), \quad s = 1 - \frac{\nu f x_\beta}{\Delta G}

        :math:`\nu = 1/2` is a cusp, 2/3 a cubic well, 1 the law of Bell. Source: Dudko, Hummer & Szabo (2006), Phys.
        Rev. Lett. 96, 108101, doi 10.1103/PhysRevLett.96.108101. Valid while the barrier exceeds k_B T, s^(1/nu) > k_B
        T / dG; beyond, the rate stays at its largest value.

        >>> law = DudkoHummerSzabo(k_off=1.0, x_off=4e-10, barrier=6e-20, nu=0.5)
        >>> round(law.log_off(f=50e-12, T_c=300.0), 6)
        4.243938
        """
        height = self.barrier / (BOLTZMANN * T_c)
        tilt = 1 - self.nu * f * self.x_off / self.barrier
        # Beyond its maximum the formula would fall again, although no barrier is left.
        lowest = power((1 - self.nu) / height, self.nu) + FRACTION_FLOOR
        s = where(tilt > lowest, tilt, lowest)
        return (1 / self.nu - 1) * log(s) + height * (1 - s ** (1 / self.nu))


class GapAttachment(RateLaw):
    r"""Bond formation across a gap, at a rate that falls as the tethers are stretched.

    .. math:: R = n_c k_{on} e^{-k_b (g_n - l_0)^2 / 2 k_B T_c} (1 - \phi)

    Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038. Any g_n. It has no reverse; combine it
    with a law of rupture.

    >>> GapAttachment(k_on=10.0, stiffness=1e-3, rest_length=2e-8).rate(phi=0.5, n_c=1.0, g_n=2e-8, T_c=300.0)
    5.0
    """

    keeps_range = True
    rate_types = (RateType("gap-attachment", "log_on", {"k_on": 1.0}, ("stiffness", "rest_length")),)

    k_on: float = parameter("1/s", "rate of formation at the rest length", at_least=0)
    stiffness: float = parameter("N/m", "stiffness of the tether", at_least=0)
    rest_length: float = parameter("m", "gap at which the tether is not stretched", default=0.0)

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """The gap at which the tether is unstretched."""
        return {"g_n": self.rest_length}

    def log_on(self, g_n: Expression, T_c: Expression) -> Expression:
        r"""Bonds form when thermal motion stretches their tether across the gap.

        .. math:: \ln\frac{k}{k_0} = -\frac{k_b (g_n - l_0)^2}{2 k_B T}

        Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038, for a transition state as stiff as
        the bond. Any g_n.

        >>> law = GapAttachment(k_on=1.0, stiffness=1e-3, rest_length=2e-8)
        >>> round(law.log_on(g_n=2.4e-8, T_c=300.0), 6)
        -1.931459
        """
        return -self.stiffness * (g_n - self.rest_length) ** 2 / (2 * BOLTZMANN * T_c)

    def rate(self, phi: Expression, n_c: Expression, g_n: Expression, T_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        return n_c * scaled_exp(self.k_on, self.log_on(g_n, T_c)) * (1 - phi)
