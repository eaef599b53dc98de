"""Rates: affinity, relaxation, Arrhenius, mass action, cure; bonds under load by Bell, Dembo, Dudko, and by a gap.

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
    product,
    scaled_exp,
    scaled_expm1,
    where,
)
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.tolerances import FRACTION_FLOOR


class LinearAffinity(RateLaw):
    r"""Rate proportional to the chemical potential per bond.

    .. math:: R = -n_c c_r \mu, \quad \dot\phi = -c_r \mu = -c_r M / N_c

    Source: Sauer, Duong & Mandadapu (2021), eq. e:R with :math:`C_r = n_c c_r`. Always admissible for c_r >= 0.

    >>> round(LinearAffinity(c_r=4.0).rate(mu=-0.5, n_c=3.0), 12)
    6.0
    """

    rate_types = (RateType("linear-affinity", "net", {"c_r": 1.0}),)

    c_r: float = parameter("1/(J s)", "rate constant per bond", at_least=0)

    def rate(self, mu: Expression, n_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        return -n_c * self.c_r * mu

    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        r"""Rate proportional to the affinity in a mechanism, ``type: linear-affinity``.

        .. math:: R = -k(T) \prod_k (n_k^\circ)^{r_k}\,\frac{\mu}{k_B T}

        b = 1 makes :math:`c_r` of the law independent of temperature. Always admissible.
        Source: Sauer, Duong & Mandadapu (2021), eq. e:R.
        """
        return self.bind({"c_r": 1 / (BOLTZMANN * T_c)}).rate(mu=mu, n_c=forward)


class ExponentialAffinity(RateLaw):
    r"""Rate exponential in the chemical potential per bond.

    .. math:: R = C_r k_B T_c \left( 1 - e^{\mu / k_B T_c} \right)

    Source: Sauer, Duong & Mandadapu (2021), the equation after e:R, with the Boltzmann constant because mu is an energy
    per bond. Always admissible for C_r >= 0; tends to the linear law for small mu. A rate beyond e^300 counts as an
    instantaneous reaction.

    >>> ExponentialAffinity(C_r=2.5e38).rate(mu=-1e-19, T_c=310.0)
    1.070002974...e+18
    """

    rate_types = (RateType("exponential-affinity", "net", {"C_r": 1.0}),)

    C_r: float = parameter("1/(J s m^2)", "rate constant per area", at_least=0)

    def rate(self, mu: Expression, T_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        thermal = BOLTZMANN * T_c
        return -scaled_expm1(self.C_r * thermal, mu / thermal)

    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        r"""Rate exponential in the affinity in a mechanism, ``type: exponential-affinity``.

        .. math:: R = k(T) \prod_k (n_k^\circ)^{r_k} \left( 1 - e^{\mu / k_B T} \right)

        Always admissible. Source: Sauer, Duong & Mandadapu (2021), the equation after e:R.
        """
        return self.bind({"C_r": forward / (BOLTZMANN * T_c)}).rate(mu=mu, T_c=T_c)


class Relaxation(RateLaw):
    r"""Relaxation to chemical equilibrium on a constant time scale.

    .. math:: R = -\frac{n_c}{\tau} \frac{\mu}{\partial \mu / \partial \phi}

    With a quadratic bond energy :math:`\dot\phi = (\phi_{eq} - \phi) / \tau` at any temperature: the linear law with
    :math:`c_r = n_c / (\tau K(T))`. With ideal mixing it is the logarithm of :math:`\phi / (1 - \phi)` that relaxes,
    so that no bond at all, and complete bonding, are at rest. Source: Sauer, Duong & Mandadapu (2021), eq. e:dphi_ex
    with constant tau. Admissible while the potential is convex in phi.

    >>> Relaxation(tau=0.5).rate(mu=-0.5, dmu_dphi=0.25, n_c=3.0)
    12.0
    """

    positive = ("dmu_dphi",)

    tau: float = parameter("s", "relaxation time", above=0)

    def rate(self, mu: Expression, dmu_dphi: Expression, n_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        # product, since a time that falls with temperature is an exponential, whose inverse may have a large exponent
        return -n_c * product(1 / self.tau) * mu / dmu_dphi


class Arrhenius(RateLaw):
    r"""Thermally activated forward reaction.

    .. math:: R = n_c A \left(\frac{T_c}{T_0}\right)^b e^{-E_a / R_g T_c} (1 - \phi)^n

    Source: Arrhenius (1889), doi 10.1515/zpch-1889-0416; modified form as in Cantera. phi <= 1. Admissible while
    mu <= 0: it has no reverse, so pair it with a potential that keeps falling as bonds form.

    >>> Arrhenius(A=2.0).rate(phi=0.5, n_c=1e18, T_c=300.0, T_0=300.0)
    1e+18
    """

    keeps_range = True

    A: float = parameter("1/s", "pre-exponential factor", at_least=0)
    E_a: float = parameter("J/mol", "activation energy", default=0.0)
    b: float = parameter("1", "temperature exponent", default=0.0)
    n: float = parameter("1", "reaction order", default=1.0, above=0)

    def rate(self, phi: Expression, n_c: Expression, T_c: Expression, T_0: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        k = scaled_exp(self.A * (T_c / T_0) ** self.b, -self.E_a / (GAS_CONSTANT * T_c))
        return n_c * k * power(1 - phi, self.n)


class MassAction(RateLaw):
    r"""Bonds form and break at constant rates.

    .. math:: R = n_c \left[ k_{on} (1 - \phi) - k_{off}\,\phi \right]

    Source: Guldberg & Waage (1864), law of mass action. 0 <= phi <= 1. Admissible with the lattice gas if
    :math:`k_{off} / k_{on} = e^{-\varepsilon / k_B T}`.

    >>> MassAction(k_on=3.0, k_off=1.0).rate(phi=0.5, n_c=1e16)
    1e+16
    """

    keeps_range = True

    k_on: float = parameter("1/s", "rate of formation", at_least=0)
    k_off: float = parameter("1/s", "rate of rupture", at_least=0)

    def rate(self, phi: Expression, n_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        return n_c * (self.k_on * (1 - phi) - self.k_off * phi)


class Bimolecular(RateLaw):
    r"""Two surfaces with different densities of partners; any partner can bond to any other.

    .. math:: R = k_f (n_1 - n_c \phi)(n_2 - n_c \phi) - k_r n_c \phi

    Source: Sauer, Duong & Mandadapu (2021), section 4, for n_b = n_c phi bonds. phi <= min(n_1, n_2) / n_c. Admissible
    with `partner-mixing` if :math:`k_f / k_r = a\,e^{\varepsilon / k_B T}`. Its equilibrium depends on the densities,
    and so on the stretch of the surface, as that potential does.

    >>> Bimolecular(k_f=1e-16, k_r=1.0).rate(phi=0.5, n_c=1e16, n_1=1e16, n_2=2e16)
    2500000000000000.0
    """

    keeps_range = True

    k_f: float = parameter("m^2/s", "rate coefficient of formation", at_least=0)
    k_r: float = parameter("1/s", "rate of rupture", at_least=0)

    def rate(self, phi: Expression, n_c: Expression, n_1: Expression, n_2: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        bonds = n_c * phi
        return self.k_f * (n_1 - bonds) * (n_2 - bonds) - self.k_r * bonds


class KamalSourour(RateLaw):
    r"""Autocatalytic cure: bonds speed up the formation of further bonds.

    .. math:: R = n_c (k_1 + k_2 \phi^m)(1 - \phi)^n, \quad k_i = A_i e^{-E_i / R_g T_c}

    Source: Kamal & Sourour (1973), Polym. Eng. Sci. 13, 59, doi 10.1002/pen.760130110. 0 <= phi <= 1. Admissible
    while mu <= 0: it has no reverse.

    >>> KamalSourour(A_1=1.0, A_2=4.0, m=0.5, n=2.0).rate(phi=0.25, n_c=1e16, T_c=300.0)
    1.6875e+16
    """

    keeps_range = True
    rate_types = (RateType("Kamal-Sourour", "catalysed", {"A_1": 0.0}, ("E_2", "m", "n"), renamed={"A_2": "A_2"}),)

    A_1: float = parameter("1/s", "pre-exponential factor without bonds", at_least=0)
    A_2: float = parameter("1/s", "pre-exponential factor of autocatalysis", at_least=0)
    E_1: float = parameter("J/mol", "activation energy without bonds", default=0.0)
    E_2: float = parameter("J/mol", "activation energy of autocatalysis", default=0.0)
    m: float = parameter("1", "order of autocatalysis", default=1.0, above=0)
    n: float = parameter("1", "order in what has not reacted", default=1.0, above=0)

    def rate(self, phi: Expression, n_c: Expression, T_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        k_1 = scaled_exp(self.A_1, -self.E_1 / (GAS_CONSTANT * T_c))
        return n_c * (k_1 + self.catalysed(phi, T_c)) * power(1 - phi, self.n)

    def catalysed(self, phi: Expression, T_c: Expression, shift: Expression = 0) -> Expression:
        r"""Autocatalytic cure in a mechanism, ``type: Kamal-Sourour``: the product accelerates its own formation.

        .. math:: R = n^\circ \left( A\,T^b e^{-E_a / R_g T} + A_2 e^{-E_2 / R_g T} \theta_p^{\,m} \right)
                  \theta_r^{\,n}

        One species r turns into one species p. Admissible if it is reversible or mu <= 0. Source: Kamal & Sourour
        (1973), Polym. Eng. Sci. 13, 59, doi 10.1002/pen.760130110.
        """
        # The autocatalytic part, times exp(shift). The power is zero without product: a reaction that needs its product
        # cannot start on its own.
        return scaled_exp(self.A_2, shift - self.E_2 / (GAS_CONSTANT * T_c)) * power(phi, self.m)


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
        on, off = log_fraction(numbers["k_on"]), log_fraction(numbers[self.off])
        return on + self.log_on(f, T_c), off + self.log_off(f, T_c)

    @property
    def log_ratio(self) -> Callable[..., Expression] | None:
        """Logarithm of the rate of formation over that of rupture; None if no bonds form."""
        # A symbol is a number that a run may change, so that bonds may form.
        k_on = vars(self)["k_on"]

        def ratio(phi: Expression, f: Expression, T_c: Expression) -> Expression:
            on, off = self.log_coefficients(f, T_c)
            return on - off + log_fraction(1 - phi) - log_fraction(phi)

        return ratio if is_symbolic(k_on) or k_on else None


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
