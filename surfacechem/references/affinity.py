"""Isothermal bonding and debonding with a rate linear or exponential in the affinity."""

from __future__ import annotations

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import BOLTZMANN
from surfacechem.references.base import Array, Quantities, Reference, read


class LinearAffinitySolution(Reference):
    r"""Two-way bonding whose rate is linear in the affinity, constant temperature.

    .. math:: \phi=\phi_{eq}+(\phi_i-\phi_{eq})e^{-\lambda t},\quad \lambda=\frac{c_rK_c}{n_c},\quad
        R_f=n_ck_f(1-\phi),\quad R_b=n_ck_b\phi,\quad R_c=R_f-R_b=n_c\dot\phi

    with :math:`k_f=\lambda\phi_{eq}`, :math:`k_b=\lambda(1-\phi_{eq})`. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.7 (bonding reactions), linear law, integrated.

    >>> sites = LinearAffinitySolution(n_c=1e18, c_r=4e18, K_c=0.275, phi_eq=0.2 / 0.275, phi_i=0.05)
    >>> f"{sites.solution(0.06043817678166709)['phi']:.12f}"
    '0.093562342248'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    c_r: float = parameter("1/(J s)", "rate constant per bond", at_least=0)
    K_c: float = parameter("J/m^2", "bond energy density", at_least=0)
    phi_eq: float = parameter("1", "equilibrium bonding state", at_least=0, at_most=1)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(constant="n_c=N_c", reaction="c_r", potential="phi_eq K_c=K_0", initial="phi_i=phi")

    def quantities(self, t: Array) -> Quantities:
        relaxation, distance = self.c_r * self.K_c / self.n_c, self.phi_eq - self.phi_i
        phi = self.phi_i - distance * np.expm1(-relaxation * t)
        return {
            "phi": phi,
            "R_forward": self.n_c * relaxation * self.phi_eq * (1.0 - phi),
            "R_backward": self.n_c * relaxation * (1.0 - self.phi_eq) * phi,
            "R_c": self.n_c * relaxation * distance * np.exp(-relaxation * t),
        }


class ExponentialAffinitySolution(Reference):
    r"""Two-way bonding whose rate is exponential in the affinity, constant temperature.

    With the affinity :math:`y=a(\phi_{eq}-\phi)=-\mu_c/(k_BT)`, :math:`a=\frac{K_c}{n_ck_BT}`,
    :math:`\lambda=\frac{C_rK_c}{n_c^2}`

    .. math:: \dot\phi=\frac\lambda a(1-e^{-y}),\qquad e^y-1=(e^{y_i}-1)e^{-\lambda t}

    Evaluated in logarithms, so that :math:`|y|` may be 1e6 and more. Any t >= 0; only the rate at t = 0 is beyond the
    range of doubles (minus infinity) for debonding from :math:`y_i<-745`.

    Source: Sauer, Duong & Mandadapu (2021), section 5.7 (bonding reactions), exponential law with the Boltzmann
    constant, integrated.

    >>> sites = ExponentialAffinitySolution(n_c=5e17, C_r=2.5e38, K_c=0.05, T=310.0, phi_eq=0.4, phi_i=1.0)
    >>> f"{sites.solution(1.20603953943341209e-9)['phi']:.12f}"
    '0.996949093794'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    C_r: float = parameter("1/(J s m^2)", "rate constant per area", at_least=0)
    K_c: float = parameter("J/m^2", "bond energy density", above=0)
    T: float = parameter("K", "temperature", above=0)
    phi_eq: float = parameter("1", "equilibrium bonding state", default=1.0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(
        constant="n_c=N_c", reaction="C_r", potential="phi_eq K_c=K_0", initial="phi_i=phi", temperature="T"
    )

    def quantities(self, t: Array) -> Quantities:
        steepness = self.K_c / (self.n_c * BOLTZMANN * self.T)  # affinity in k_B T per distance of phi from equilibrium
        relaxation = self.C_r * self.K_c / self.n_c**2  # decay rate close to equilibrium
        initial = steepness * (self.phi_eq - self.phi_i)
        spent, left, thrust = (_bonding if initial >= 0.0 else _debonding)(initial, relaxation * t)
        from_start, to_equilibrium = self.phi_i + spent / steepness, self.phi_eq - left / steepness
        return {
            "phi": np.where(np.abs(left) < np.abs(spent), to_equilibrium, from_start),
            "phi_dot": relaxation / steepness * thrust,
        }


def _bonding(y_i: float, decay: Array) -> tuple[Array, Array, Array]:
    r"""Return the affinity spent :math:`y_i-y`, the affinity left y, and :math:`1-e^{-y}`, for :math:`y_i\ge0`."""
    log_gone = np.log(-np.expm1(-decay))
    product = np.expm1(-y_i) * np.expm1(-decay)
    spent = np.where(product < 0.5, -np.log1p(-product), -np.logaddexp(-decay, log_gone - y_i))
    log_excess = y_i + np.log(-np.expm1(-y_i)) - decay  # ln(e^y - 1)
    return spent, np.logaddexp(0.0, log_excess), np.exp(-np.logaddexp(0.0, -log_excess))


def _debonding(y_i: float, decay: Array) -> tuple[Array, Array, Array]:
    r"""Return the affinity spent :math:`y_i-y`, the affinity left y, and :math:`1-e^{-y}`, for :math:`y_i<0`."""
    gone, excess = -np.expm1(-decay), np.expm1(y_i) * np.exp(-decay)  # excess = e^y - 1
    power = gone + np.exp(y_i - decay)  # e^y as a sum of positive numbers
    log_factor = -y_i + np.log(-np.expm1(y_i))  # ln(e^-y_i - 1)
    spent = -np.where(
        log_factor < 30.0, np.log1p(np.expm1(min(-y_i, 100.0)) * gone), np.logaddexp(0.0, log_factor + np.log(gone))
    )
    return spent, np.where(excess > -0.5, np.log1p(excess), np.log(power)), excess / power
