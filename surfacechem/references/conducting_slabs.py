"""Two heat-conducting bodies brought into contact.

By Laplace transformation: the responses of the bodies to heat at their contact, and a numerical inversion.
Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, chapter XII; Weideman & Trefethen (2007), Parabolic and
hyperbolic contours for computing the Bromwich integral, Math. Comp. 76, and Trefethen, Weideman & Schmelzer (2006),
Talbot quadratures and rational approximations, BIT 46, for the contour.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read

if TYPE_CHECKING:
    from surfacechem.scene import Body, Scene

Complex: TypeAlias = NDArray[Any]
"""Complex values."""

NODES = 24
"""Points on the contour: each reduces the error by a factor of 3.9, until rounding is reached."""

HELD_CONDUCTANCE = 1e300
"""Conductance at a far side that is held at a temperature."""


def inverse_laplace(image: Callable[[Complex], Complex], t: Array) -> Array:
    """Return the function of times t > 0 whose Laplace transform is ``image``, which may have further axes.

    >>> bool(abs(inverse_laplace(lambda s: 1 / (s + 2), np.array([0.5]))[0] - np.exp(-1)) < 1e-12)
    True
    """
    angle = (2 * np.arange(NODES // 2) + 1) * np.pi / NODES
    path = NODES * (0.5017 * angle / np.tan(0.6407 * angle) - 0.6122 + 0.2645j * angle)
    slope = NODES * (0.5017 / np.tan(0.6407 * angle) - 0.5017 * 0.6407 * angle / np.sin(0.6407 * angle) ** 2 + 0.2645j)
    result: Any = 0.0
    for z, weight in zip(path, np.exp(path) * slope, strict=True):
        # The other half of the contour is the complex conjugate.
        result = result + 2 * np.imag(weight * image(z / t) / t) / NODES
    return np.asarray(result)


@dataclass(frozen=True)
class ConductingSlab:
    """A body of capacity C and conductivity k over its thickness, both per area; a lump if it has no conductivity.

    Beyond the far side is the temperature ``T_far`` behind a conductance; without capacity the temperature is constant.
    """

    T: float
    C: float
    thickness: float = 1.0
    conductivity: float = 0.0
    h_far: float = 0.0
    T_far: float = 0.0

    def answer(self, s: Complex, x: Array | float = 0.0) -> tuple[Complex, Complex]:
        """Return the temperature at x per heat flux into the contact, and the temperature minus its initial value
        without any flux there.
        """
        if not self.C:
            return np.zeros_like(s), np.zeros_like(s)
        if not self.conductivity:
            return 1 / (self.C * s), np.zeros_like(s)
        # Decay of a wave per length, k times it, and the fraction left after a path across the slab and back.
        p = np.sqrt(s * self.C / (self.conductivity * self.thickness))
        kp, E = self.conductivity * p, np.exp(-2 * p * self.thickness)
        back = (kp - self.h_far) / (kp + self.h_far)
        heated = (np.exp(-p * x) + back * np.exp(-p * (2 * self.thickness - x))) / (kp * (1 - back * E))
        if not self.h_far:
            return heated, np.zeros_like(s)
        from_far = (self.T_far - self.T) / s / (kp / self.h_far * (1 - E) + 1 + E)
        return heated, from_far * (np.exp(-p * (self.thickness - x)) + np.exp(-p * (self.thickness + x)))


class ConductingSlabs(Reference):
    r"""Two slabs of constant properties in contact, perfect or through a resistance, with any far sides.

    .. math:: \frac{C_k}{L_k}\dot T_k=k_k\,T_{k,xx},\qquad q=\frac{T_1-T_2}{R}=-k_k T_{k,x}\Big|_{x=0}

    In Laplace transforms, with :math:`p=\sqrt{sC/(kL)}` and the wave reflected at the far side, the response of each
    body to a flux is :math:`Z=(1+rE)/(kp\,(1-rE))`, :math:`E=e^{-2pL}`, :math:`r=(kp-h)/(kp+h)`, and
    :math:`q=\Delta T/(s\,(Z_1+Z_2+R))`. The inversion is a quadrature on Talbot's contour, accurate to 1e-11 of the
    temperature differences. A body without conductivity is a lump, one without capacity has a constant temperature.

    Any t >= 0. Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, section 12.8.

    >>> slab = ConductingSlabs(T_1=400.0, C_1=4000.0, thickness_1=2e-3, conductivity_1=0.2, T_2=300.0, R=1e-3)
    >>> f"{slab.solution(20.0)['T_1']:.8f}"
    '306.43289553'
    """

    continuous: ClassVar[bool] = True

    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", default=0.0, at_least=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", default=0.0, at_least=0)
    thickness_1: float = parameter("m", "thickness of body 1", default=1.0, above=0)
    thickness_2: float = parameter("m", "thickness of body 2", default=1.0, above=0)
    conductivity_1: float = parameter("W/(m K)", "conductivity of body 1; 0: a lump", default=0.0, at_least=0)
    conductivity_2: float = parameter("W/(m K)", "conductivity of body 2; 0: a lump", default=0.0, at_least=0)
    h_far_1: float = parameter("W/(m^2 K)", "conductance at the far side of body 1", default=0.0, at_least=0)
    h_far_2: float = parameter("W/(m^2 K)", "conductance at the far side of body 2", default=0.0, at_least=0)
    T_far_1: float = parameter("K", "temperature beyond the far side of body 1", default=0.0, at_least=0)
    T_far_2: float = parameter("K", "temperature beyond the far side of body 2", default=0.0, at_least=0)
    R: float = parameter("m^2 K/W", "resistance of the contact; 0: perfect", default=0.0, at_least=0)

    readings = read(
        constant="C_1 C_2 thickness_1 thickness_2 conductivity_1 conductivity_2 h_far_1 h_far_2",
        initial="T_1 T_2 T_far_1 T_far_2",
    )

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        for reason in _beside_conduction(scene.scene):
            raise InputError(f"it holds for conduction between two bodies alone, and {reason}.")
        values, h = dict(super().from_scene(scene)), scene.total_conductance
        values["R"] = 1.0 / h if h else None
        for k in "12":  # a body with an initial profile has no separate temperature at the contact
            values[f"T_{k}"] = scene.run.values.get(f"initial.profile_{k}", values[f"T_{k}"])
            if values[f"T_far_{k}"] is not None and values[f"h_far_{k}"] is None:
                values[f"h_far_{k}"] = HELD_CONDUCTANCE
        return values

    @property
    def bodies(self) -> tuple[ConductingSlab, ConductingSlab]:
        """Both bodies."""
        first, second = (
            ConductingSlab(**{item.name: getattr(self, f"{item.name}_{k}") for item in fields(ConductingSlab)})
            for k in (1, 2)
        )
        return first, second

    def _flux(self, s: Complex) -> Complex:
        """Return the transform of the heat flux from the first to the second body."""
        first, second = self.bodies
        (heated_1, open_1), (heated_2, open_2) = first.answer(s), second.answer(s)
        return ((first.T - second.T) / s + open_1 - open_2) / (heated_1 + heated_2 + self.R)

    def quantities(self, t: Array) -> Quantities:
        """Return temperatures at the contact; through a resistance also the heat fluxes, which start finite."""
        T_1, T_2 = (self.profile(number, np.zeros(1), t)[:, 0] for number in (1, 2))
        if not self.R:
            return {"T_1": T_1, "T_2": T_2, "T": T_1}
        q = np.full(t.size, (self.T_1 - self.T_2) / self.R)
        q[t > 0] = inverse_laplace(self._flux, t[t > 0])
        return {"T_1": T_1, "T_2": T_2, "q_1": -q, "q_2": q}

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Return temperatures of a body at distances from the contact [m], shape (times, places)."""
        body, sign = self.bodies[number - 1], 1.0 if number == 2 else -1.0
        values = np.full((t.size, x.size), body.T)

        def rise(s: Complex) -> Complex:
            heated, unheated = body.answer(s, x)
            return unheated + sign * self._flux(s) * heated

        values[t > 0] += inverse_laplace(rise, t[t > 0, None])
        return values


def _beside_conduction(scene: Scene) -> Iterator[str]:
    """Yield the contents of a scene other than conduction, in words."""
    interface, bodies = scene.interface, {body.name for body in scene.bodies}
    laws = (interface.potentials, interface.frictions, interface.reactions, interface.limits, interface.variables)
    if any(laws):
        yield "the interface has laws of its own"
    if any((scene.normal, scene.tangential, scene.programme, scene.loading)):
        yield "something is loaded or moves"
    if interface.temperature not in (None, *(body.temperature for body in scene.bodies)):
        yield "the interface has a temperature of its own"
    for path in scene.heat:
        if path.name() != "conductance" or set(path.between) != bodies or path.varying:
            yield f"the heat path {path.name()} is no constant one between the bodies"
    for body in scene.bodies:
        yield from _not_constant(body)


def _not_constant(body: Body) -> Iterator[str]:
    """Yield the properties of a body that are not constant, in words."""
    energy, conduction = body.energy, body.conduction
    if energy is not None and (energy.name() != "constant" or energy.varying):
        yield f"the heat capacity of {body.name} varies"
    if conduction is not None and conduction.varying:
        yield f"the conductivity of {body.name} varies"
    loads = [body.temperature, conduction.far if conduction else None]
    if any(isinstance(load, Load) and load.name() != "hold" for load in loads):
        yield f"a temperature of {body.name} varies"
