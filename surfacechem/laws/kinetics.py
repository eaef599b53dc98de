"""Bonding kinetics: affinity laws, relaxation, Arrhenius, mass action, bimolecular, cure."""

from __future__ import annotations

from surfacechem.contracts.terms import RateLaw, RateType, parameter
from surfacechem.expressions import Expression, power, product, scaled_exp, scaled_expm1
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT


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
    :math:`c_r = n_c / (\tau K(T))`. Source: Sauer, Duong & Mandadapu (2021), eq. e:dphi_ex with constant tau.
    Admissible while the potential is convex in phi.

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
