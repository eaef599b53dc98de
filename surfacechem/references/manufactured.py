"""A manufactured solution of the fully coupled equations with three temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference


class Manufactured(Reference):
    r"""Chosen temperatures, bonding state and gap, to be met by supplying heat and bonds.

    .. math:: T_1=T_0\Big(1+\tfrac{\sin2t}{20}\Big),\quad T_2=T_0\Big(\tfrac{11}{10}-\tfrac{e^{-t}}{10}\Big),\quad
        T_c=T_0\Big(1+\tfrac2{25}e^{-t/3}\cos t\Big),\\
        \phi=\tfrac12+\tfrac25\sin(t+0.3),\qquad g_n=g_a\Big(1+\tfrac12\sin3t\Big)

    with t in seconds. The sources :math:`Q_1,Q_2,Q_c,r_\phi` that make any scene follow these functions are what is
    left of its balances when they are inserted; `state` evaluates them with any set of elementary functions, symbols
    included, for that purpose. The other parameters are those of the scene for which sources are tabulated: quadratic
    bodies, and an interface with

    .. math:: \Psi=\tfrac12E_0(1+a_E\phi)(1-b_E\theta)g_n^2-\frac{C_0(1+a_C\phi)}{2T_0}\theta^2
        +\tfrac12\Big(K_0+K_1\tfrac T{T_0}+K_2\tfrac{T^2}{T_0^2}\Big)\Big(1+d_K\tfrac{g_n}{g_a}\Big)
        \Big(\phi-\phi_{e0}-\phi_{e1}\tfrac\theta{T_0}\Big)^2,\quad \theta=T_c-T_0

    linear kinetics :math:`\dot\phi=-c\,e^{-\frac{E_a}{R_g}(1/T_c-1/T_0)}\,\partial\Psi/\partial\phi+r_\phi`, sliding in
    a film, :math:`D=\eta e^{-\beta(T_c-T_0)}v^2/g_{film}`, and conductances h_1, h_2 (medium) and h_d (direct).

    Source: method of manufactured solutions (Roache 2002, J. Fluids Eng. 124, 4-10).

    >>> f"{Manufactured().solution(2.0)['T_c']:.10f}"
    '294.8722341621'
    """

    name: ClassVar[str] = "manufactured"

    T_0: float = parameter("K", "reference temperature", default=300.0, above=0)
    g_a: float = parameter("m", "mean gap", default=1e-6, above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", default=40.0, above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", default=25.0, above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", default=900.0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", default=300.0)
    h_d: float = parameter("W/(m^2 K)", "direct conductance between the bodies", default=50.0)
    E_0: float = parameter("Pa/m", "contact stiffness without bonds at T_0", default=1e12)
    a_E: float = parameter("1", "growth of the stiffness with bonding", default=0.5)
    b_E: float = parameter("1/K", "decrease of the stiffness with temperature", default=2e-3)
    C_0: float = parameter("J/(m^2 K)", "heat capacity of the interface without bonds at T_0", default=2.0)
    a_C: float = parameter("1", "growth of the capacity with bonding", default=0.3)
    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=300.0)
    K_1: float = parameter("J/m^2", "linear part of the bond energy density", default=80.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=40.0)
    d_K: float = parameter("1", "growth of the bond energy density with the gap", default=0.2)
    phi_e0: float = parameter("1", "equilibrium bonding state at T_0", default=0.9)
    phi_e1: float = parameter("1", "growth of the equilibrium bonding state with temperature", default=0.3)
    c_over_n: float = parameter("m^2/(J s)", "rate constant per bond over site density", default=0.01)
    E_a: float = parameter("J/mol", "activation energy", default=3e4)
    eta: float = parameter("Pa s", "viscosity of the film at T_0", default=0.05)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", default=0.01)
    v: float = parameter("m/s", "sliding velocity", default=0.2)
    g_film: float = parameter("m", "film thickness", default=2e-6, above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return self.state(t, np)

    def state(self, t: Any, functions: Any) -> dict[str, Any]:
        """The chosen functions at t, with sin, cos and exp from `functions`: numpy, mpmath or a computer algebra."""
        sin, cos, exp = functions.sin, functions.cos, functions.exp
        return {
            "T_1": self.T_0 * (1 + sin(2 * t) / 20),
            "T_2": self.T_0 * (1.1 - exp(-t) / 10),
            "T_c": self.T_0 * (1 + 2 * exp(-t / 3) * cos(t) / 25),
            "phi": 0.5 + 0.4 * sin(t + 0.3),
            "g_n": self.g_a * (1 + sin(3 * t) / 2),
        }
