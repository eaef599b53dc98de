"""Elastic bonds at a held gap: relaxation to chemical equilibrium, and the equilibrium at any gap."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import BOLTZMANN
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read


class LatticeGasSprings(Reference):
    r"""Ideal mixture of free sites and springs at a held gap, with rates that obey detailed balance.

    .. math:: \phi=\phi_{eq}+(\phi_i-\phi_{eq})e^{-(k_f+k_r)t},\qquad
        \frac{k_r}{k_f}=e^{(k_bg_n^2/2-\varepsilon)/k_BT}=\frac{1-\phi_{eq}}{\phi_{eq}},\qquad t_n=n_ck_bg_n\phi

    Pulled apart in equilibrium, the traction peaks at
    :math:`k_bg_n^2/k_BT=1+2W_0(\tfrac12e^{\varepsilon/k_BT-1/2})`, and the work of separation is
    :math:`n_ck_BT\ln(1+e^{\varepsilon/k_BT})`. Any bond energy: no exponential overflows.

    Source: Hill (1960), An Introduction to Statistical Thermodynamics, ch. 7, with the elastic energy of Dembo et al.
    (1988), Proc. R. Soc. Lond. B 234, 55-83, doi 10.1098/rspb.1988.0038.

    >>> film = LatticeGasSprings(n_c=1e16, epsilon=6e-20, k_b=1e-3, T=300.0)
    >>> f"{1e9 * film.peak_gap:.9f} nm, {film.peak_traction:.6f} Pa, {film.work_of_separation:.9e} J/m^2"
    '9.719412472 nm, 92932.604786 Pa, 6.000000212e-04 J/m^2'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    epsilon: float = parameter("J", "energy released per bond")
    k_b: float = parameter("N/m", "stiffness of a bond", above=0)
    T: float = parameter("K", "temperature", above=0)
    g_n: float = parameter("m", "gap", default=0.0, at_least=0)
    k_i: float = parameter("1/s", "initial rate of phi over the initial free fraction", default=0.0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(potential="epsilon k_b", constant="n_c=N_c", temperature="T", initial="g_n phi_i=phi")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        values, rate = super().from_scene(scene), scene.bonding_rate
        phi = values["phi_i"]
        return {**values, "k_i": None if phi is None or rate is None or phi == 1.0 else rate / (1.0 - phi)}

    def exponent(self, gap: ArrayLike) -> Array:
        """Return the free energy of a bond in units of k_B T."""
        return (0.5 * self.k_b * np.asarray(gap) ** 2 - self.epsilon) / (BOLTZMANN * self.T)

    def equilibrium(self, gap: ArrayLike) -> Array:
        """Return the bonding state in equilibrium at a gap [m]."""
        return np.asarray(np.exp(-np.logaddexp(0.0, self.exponent(gap))))

    def traction(self, gap: ArrayLike) -> Array:
        """Return the traction [Pa] in equilibrium at a gap [m]."""
        return self.n_c * self.k_b * np.asarray(gap) * self.equilibrium(gap)

    @property
    def peak_gap(self) -> float:
        """Gap [m] at which the traction in equilibrium is largest."""
        from scipy.special import wrightomega  # W_0 of an exponential, which may overflow

        thermal = BOLTZMANN * self.T
        w = float(wrightomega(self.epsilon / thermal - 0.5 - math.log(2.0)))
        return math.sqrt((1.0 + 2.0 * w) * thermal / self.k_b)

    @property
    def peak_traction(self) -> float:
        """Largest traction [Pa] in equilibrium."""
        return float(self.traction(self.peak_gap))

    @property
    def work_of_separation(self) -> float:
        """Work [J/m^2] of pulling the surfaces apart in equilibrium."""
        thermal = BOLTZMANN * self.T
        return self.n_c * thermal * float(np.logaddexp(0.0, self.epsilon / thermal))

    def quantities(self, t: Array) -> Quantities:
        distance = float(self.equilibrium(self.g_n)) - self.phi_i
        relaxation = self.k_i * (1.0 - self.phi_i) / distance if distance else 0.0  # k_f + k_r
        phi = self.phi_i - distance * np.expm1(-relaxation * t)
        return {"phi": phi, "t_n": self.n_c * self.k_b * self.g_n * phi}
