"""Viscous films that heat bodies: a film that thins with temperature, and one that closes at constant speed."""

from __future__ import annotations

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import FrictionallyHeated, UniformBody
from surfacechem.references._numerics import first_difference, increasing_root, second_difference
from surfacechem.references.base import Array, Quantities, read


class ThinningFilm(FrictionallyHeated):
    r"""Heating by a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}`, quadratic energies, no loss.

    .. math:: \frac C{T_0}T\dot T=D_0e^{-\beta(T-T_0)},\qquad
        T=\frac1\beta\Big\{1+W_0\Big[(\beta T_i-1)e^{\beta T_i-1}+\frac{\beta^2D_0T_0t}Ce^{\beta T_0-1}\Big]\Big\}

    The Lambert function loses digits for small :math:`\beta T` and overflows for large. Instead, the same equation is
    solved to rounding for the rise :math:`\theta=T-T_i`,
    :math:`T_i\theta\exp[0,\beta\theta]+\theta^2\exp[0,\beta\theta,\beta\theta]=D_0e^{-\beta(T_i-T_0)}T_0t/C`.
    Any t >= 0, beta >= 0; beta = 0 is steady sliding.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886), integrated.

    >>> film = ThinningFilm(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, beta=0.04)
    >>> f"{film.solution(4e4)['T']:.10f}"
    '467.5516435377'
    """

    beta: float = parameter("1/K", "decay of the viscosity per kelvin", at_least=0)

    readings = read(friction="beta")

    def quantities(self, t: Array) -> Quantities:
        initial = self.D_0 * np.exp(-self.beta * (self.T_i - self.T_0))
        heat = initial * self.T_0 * t / self.C
        without_thinning = 2.0 * heat / (self.T_i + np.sqrt(self.T_i**2 + 2.0 * heat))
        exponent = np.log1p(self.beta * heat / self.T_i) / (self.beta or 1.0)
        above = np.where(self.beta > 0.0, np.minimum(exponent, without_thinning), without_thinning)
        rise = increasing_root(self._heat, heat, np.zeros_like(heat), above)
        return {"T": self.T_i + rise, "D": initial * np.exp(-self.beta * rise)}

    def _heat(self, rise: Array) -> tuple[Array, Array]:
        """Return the energy, in units of C/T_0, that heats against the thinning, and its slope."""
        exponent = self.beta * rise
        linear = self.T_i * first_difference(np.zeros_like(exponent), exponent)
        quadratic = rise * np.exp(exponent) * second_difference(np.zeros_like(exponent), -exponent)
        return rise * (linear + quadratic), (self.T_i + rise) * np.exp(exponent)


class ClosingFilm(UniformBody):
    r"""Heating by a viscous film whose gap closes linearly: it grows like a logarithm.

    .. math:: g_n=g_i-at,\qquad T^2=T_i^2+\frac{2T_0\eta v^2}{Ca}\ln\frac{g_i}{g_n}

    Quadratic energies, perfect thermal contact. Valid before `end_time` :math:`g_i/a`, at which dissipation and
    temperature are infinite.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric and section 6.1, integrated.

    >>> film = ClosingFilm(eta=0.01, v=0.5, g_i=1e-5, a=1e-6, C=800.0, T_0=300.0, T_i=300.0)
    >>> f"{film.solution(9.0)['T']:.10f} {film.end_time:.1f}"
    '307.1112942393 10.0'
    """

    eta: float = parameter("Pa s", "film viscosity", at_least=0)
    v: float = parameter("m/s", "sliding velocity")
    g_i: float = parameter("m", "initial gap", above=0)
    a: float = parameter("m/s", "closing speed", above=0)

    readings = read(friction="eta", initial="v g_i=g_n", ramp="a=-g_n")

    @property
    def end_time(self) -> float:
        """Time [s] at which the gap closes."""
        return self.g_i / self.a

    def quantities(self, t: Array) -> Quantities:
        return self.at_gap(self.g_i * (self.end_time - t) / self.end_time)

    def at_gap(self, g: Array) -> Quantities:
        """Return the state at the gap g; more accurate than by time, which is rounded close to the end."""
        heat = self.eta * self.v**2 / self.a * np.log(self.g_i / g)
        T = np.sqrt(self.T_i**2 + 2.0 * self.T_0 * heat / self.C)  # not by the rise, which is infinite at the end
        return {"g_n": g, "T": T, "D": self.eta * self.v**2 / g, "heat": heat}
