r"""Exact solutions: parameters in SI, and exact values of named quantities at any time.

A reference is a frozen dataclass, named by its class; to add one, add its class, in a file of its own or in the file of
its family. It reads its parameters from a view of the scene and of the start of its run. Bases that many share are
bodies that have one temperature, with either model of their energy, stated in the excess temperature
:math:`\theta=T-T_0`, to avoid cancellation close to the reference temperature. Source: Sauer, Duong & Mandadapu (2021),
quadratic model; Callen (1985), Thermodynamics, constant capacity.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, fields
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, dataclass_transform

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError

if TYPE_CHECKING:
    from surfacechem.contracts.terms import Law
    from surfacechem.scene import Scene
    from surfacechem.solve.run import Trajectory
    from surfacechem.surfaces.potential import CurvedSurfaces

__all__ = ["Array", "Parameters", "Quantities", "Reference", "SceneView", "read"]


LAWS = ("potential", "friction", "reaction", "limit")
"""Readings of the constants of laws of the interface."""

PATHS = {"ramp": "loading.{}.ramp.rate", "normal": "mechanics.normal.{}", "tangential": "mechanics.tangential.{}"}
"""Readings of rates at which variables are driven [per second], and of supports of the bodies, by their paths."""


class SceneView:
    """A scene as it was run: constants of its laws by contract, loads, supports, capacities and initial values, in SI.

    Read only. A value that the scene does not have, or has more than once, is None.
    """

    def __init__(self, scene: Scene, run: Trajectory) -> None:
        self.scene, self.run, self._system = scene, run, run.model.system

    @cached_property
    def _states(self) -> dict[str, float]:
        return {state.name: state.from_given(self.run.values) for state in self._system.states}

    @cached_property
    def _outputs(self) -> dict[str, float]:
        return dict(zip(self._system.output_columns, self.run.outputs[0].tolist(), strict=True))

    def read(self, reading: str, name: str) -> float | None:
        """Return one of the readings above or below, by name if it needs one; a preceding minus reverses the sign."""
        own = name.removeprefix("-")
        if reading in LAWS:  # of one of the laws, or of a factor of one of its parameters
            paths = (f"{owner}.{own}" for owner in self.scene.interface.owners[reading])
            given = [self.run.values[path] for path in paths if path in self.run.values]
            value = given[0] if len(given) == 1 else None
        elif reading in PATHS:
            value = self.run.values.get(PATHS[reading].format(own))
        else:
            found = getattr(self, reading)
            value = found(own) if callable(found) else found
        return -value if value is not None and name.startswith("-") else value

    # -- laws, loads, supports -----------------------------------------------------------------------------------------

    def surface(self, name: str) -> float | None:
        """Return a parameter of the shapes of two bodies, or of a law between them."""
        laws: list[Law] = [*self.surfaces.shapes, *self.surfaces.gap_laws]
        found = {own: getattr(law, own) for law in laws for own, _ in law.specs()}
        # Parameters of pairs of points may have been changed for this run.
        found |= {path.rpartition(".")[2]: x for path, x in self.run.values.items() if path.startswith("surface.pair.")}
        return found.get(name)

    @property
    def surfaces(self) -> CurvedSurfaces:
        """The two surfaces; InputError if the scene has none."""
        from surfacechem.surfaces.potential import CurvedSurfaces

        if not isinstance(self.scene.surface, CurvedSurfaces):
            raise InputError("it needs two bodies with shapes; the scene has no `surface`.")
        return self.scene.surface

    def conductance(self, into: str) -> float | None:
        """Return the sum of the conductances between the interface and body '1' or '2' [W/(m^2 K)]."""
        ends = {"interface", self.scene.bodies[int(into) - 1].name}
        return self._sum([law for law in self.scene.heat if set(law.between) == ends])

    @property
    def total_conductance(self) -> float | None:
        """Sum of the conductances of all heat paths [W/(m^2 K)]."""
        return self._sum(self.scene.heat)

    def _sum(self, paths: Sequence[Law]) -> float | None:
        """Return the sum of the conductances of heat paths; None if there is no path, or one has no constant h."""
        found = [self.run.values.get(f"{law.path}.h") for law in paths]
        return sum(h for h in found if h is not None) if found and None not in found else None

    # -- bodies and sites ----------------------------------------------------------------------------------------------

    def constant(self, name: str) -> float | None:
        """Return a constant of bodies or sites by its symbol: C_1, C_2, C_c, T_0, N_c, N_1, N_2, thickness_1, ..."""
        paths = (item.path for item in self._system.parameters if str(item.symbol) == name)
        return next((self.run.values[path] for path in paths), None)

    @property
    def capacity(self) -> float:
        """Sum of all heat capacities at T_0 [J/(m^2 K)]."""
        return sum(self.constant(name) or 0.0 for name in ("C_1", "C_2", "C_c"))

    @property
    def temperature(self) -> float | None:
        """First evolved temperature, or that of the interface [K]."""
        # A scene without bodies has a single temperature, T.
        own = [state.name for state in self._system.states if state.is_temperature]
        return next((T for name in (*own[:1], "T_c", "T") if (T := self.initial(name)) is not None), None)

    @property
    def surroundings_temperature(self) -> float | None:
        """Temperature of the surroundings, else of a body with a prescribed one [K]."""
        return next((self._outputs[name] for name in ("T_a", "T_2", "T_1") if name in self._outputs), None)

    @property
    def adiabatic_rise(self) -> float | None:
        """Temperature rise [K] by the heat of all bonds; zero in reservoirs."""
        heat = self.read("potential", "H_r")
        return None if heat is None else heat / self.capacity if self.capacity else 0.0

    # -- the start -----------------------------------------------------------------------------------------------------

    def initial(self, name: str) -> float | None:
        """Return the initial value of a state, or of a named quantity, a load for instance."""
        return self._states[name] if name in self._states else self._outputs.get(name)

    @property
    def bonding_rate(self) -> float | None:
        """Initial rate of the bonding state [1/s]."""
        column = self._system.state_columns.get("phi")
        return None if column is None else float(self.run.rates[0, column])

    @property
    def relaxation_time(self) -> float | None:
        """Relaxation time [s] of bonding, if its rate is proportional to the distance from equilibrium; without an
        initial rate it may be a parameter of a law.
        """
        if not self.bonding_rate:
            return self.read("reaction", "tau")
        equilibrium = self.read("potential", "phi_eq")
        return ((1.0 if equilibrium is None else equilibrium) - self._states["phi"]) / self.bonding_rate

    @property
    def friction_power(self) -> float:
        """Power of all friction [W/m^2] at the start."""
        return self._dissipated(self._outputs)

    def _dissipated(self, outputs: Mapping[str, float]) -> float:
        accounts = {account.quantity.name for account in self._system.ledger}
        laws = (name[2:] for name in outputs if name.startswith("D_"))
        return sum((outputs[f"D_{law}"] for law in laws if {f"W_{law}", f"heat_{law}"} <= accounts), 0.0)

    @property
    def heat_supply(self) -> float:
        """External heat into bodies and interface [W/m^2]."""
        return float(sum(self._outputs.get(name, 0.0) for name in ("Q_1", "Q_2", "Q_c")))

    @property
    def heating_at_T_0(self) -> float | None:
        """Friction at the reference temperature and external heat [W/m^2]."""
        T_0 = self.constant("T_0")
        if T_0 is None:
            return None
        y = np.array([[value if name == "phi" else T_0 for name, value in self._states.items()]])
        at = self.run.model.evaluate(self.run.result, self.run.result.times[:1], y, np.zeros_like(y))[0]
        return self._dissipated(dict(zip(self._outputs, at.tolist(), strict=True))) + self.heat_supply


Array: TypeAlias = NDArray[np.float64]
Parameters: TypeAlias = Mapping[str, float | None]
"""Parameters of an exact solution by name; None, or missing, if a scene does not determine one."""

Quantities: TypeAlias = Mapping[str, Array | float]
"""Exact values by the names of the dataset; a constant may be a single number."""


def read(**readings: str) -> dict[str, tuple[str, str]]:
    """Return the table for reading parameters off a scene: for each the reading of the :class:`SceneView` and its name
    there, with a preceding minus if its sign is reversed.

    >>> read(friction="mu", initial="p phi_i=phi", temperature="T_i")["phi_i"]
    ('initial', 'phi')
    """
    found = {}
    for reading, names in readings.items():
        assert reading in (*LAWS, *PATHS) or hasattr(SceneView, reading), reading
        for name in names.split():
            ours, _, theirs = name.partition("=")
            found[ours] = (reading, theirs or ours)
    return found


def name_of(kind: str) -> str:
    """Return the name of an exact solution: that of its class in kebab-case, without a final "Solution".

    >>> name_of("LinearAffinitySolution")
    'linear-affinity'
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", kind.removesuffix("Solution")).lower()


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter,))
class Reference(ABC):
    """An exact solution. Subclasses become frozen, keyword-only dataclasses and state `quantities`."""

    name: ClassVar[str]
    """Name of the class in kebab-case; a final "Solution" only distinguishes it from a law."""
    continuous: ClassVar[bool] = False
    """True if it is for bodies without cells: a scene then satisfies it except for the error of its cells, and only
    `from_scene` decides whether it is the scene's."""
    readings: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Readings of its parameters from a scene, including those of its bases."""
    parameters: ClassVar[tuple[Field[Any], ...]] = ()
    """Its parameters, with their specifications."""
    statistics: ClassVar[tuple[str, ...]] = ()
    """Names of its properties that a sweep compares with the statistics of each run."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        cls.readings = {name: how for kind in cls.__mro__[::-1] for name, how in vars(kind).get("readings", {}).items()}
        cls.name = name_of(cls.__name__)
        dataclass(frozen=True, kw_only=True)(cls)
        cls.parameters = fields(cls)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        """Check every parameter against its range, and all of them together."""
        for item in self.parameters:
            item.metadata["spec"].check(f"{self.name}: {item.name}", getattr(self, item.name))
        if flaw := self.flaw():
            raise InputError(f"{self.name}: {flaw}")

    def flaw(self) -> str:
        """Return the reason why there is no solution with these parameters; empty if there is one."""
        return ""

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        """Return the parameters of the solution in a scene; InputError, with the reason, if it cannot be the scene's.

        A test on the scene's equations follows. Subclasses add parameters that need several readings.
        """
        return {name: scene.read(*how) for name, how in cls.readings.items()}

    @property
    def end_time(self) -> float:
        """Last time [s] at which the solution exists."""
        return math.inf

    def solution(self, t: ArrayLike) -> dict[str, Array]:
        """Return exact values of the named quantities.

        Parameters
        ----------
        t
            Times [s] after the start, of any shape.

        Returns
        -------
        dict
            Values in SI by name, each of the shape of `t`.

        Raises
        ------
        InputError
            If a time is before the start or after the end of the solution.
        """
        times = np.asarray(t, dtype=np.float64)
        if not np.all((times >= 0.0) & (times <= self.end_time)):
            raise InputError(f"{self.name}: exact for 0 <= t <= {self.end_time!r} s only.")
        # Formulas evaluate all their branches; NaN is reported below.
        with np.errstate(all="ignore"):
            values = self.quantities(times.reshape(-1))
        table = np.empty((len(values), times.size))
        for row, value in zip(table, values.values(), strict=True):
            row[:] = value
        if np.isnan(table).any():
            j, moment = np.argwhere(np.isnan(table))[0]
            raise InputError(f"{self.name}: {list(values)[j]} has no real value at t = {times.flat[moment]} s.")
        return dict(zip(values, table.reshape(len(values), *times.shape), strict=True))

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Return temperatures of body 1 or 2 at distances from the contact [m], shape (times, places), if
        continuous.
        """
        raise NotImplementedError(f"{self.name} knows no temperatures inside bodies.")

    @abstractmethod
    def quantities(self, t: Array) -> Quantities:
        """Return the exact solution at a vector of times."""


class QuadraticEnergy:
    r""":math:`U=\frac{C}{2T_0}(T^2-T_0^2)`, :math:`S=C\,(T/T_0-1)`, capacity :math:`C\,T/T_0`; both zero at T_0."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        """Return the temperature rise above `T_i` when `energy` is added."""
        difference_of_squares = 2.0 * T_0 * energy / C
        return np.asarray(difference_of_squares / (T_i + np.sqrt(T_i**2 + difference_of_squares)))

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the energy at the temperature `T_0 + excess`."""
        return C * excess * (1.0 + excess / (2.0 * T_0))

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the entropy at the temperature `T_0 + excess`."""
        return C * excess / T_0


class ConstantCapacity:
    r""":math:`U=C\,(T-T_0)`, :math:`S=C\ln(T/T_0)`."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        """Return the temperature rise above `T_i` when `energy` is added."""
        return energy / C

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the energy at the temperature `T_0 + excess`."""
        return C * excess

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the entropy at the temperature `T_0 + excess`."""
        return np.asarray(C * np.log1p(excess / T_0))


class PerfectContact(Reference):
    """Capacities that share one temperature."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", above=0)
    C_c: float = parameter("J/(m^2 K)", "heat capacity of the interface at T_0", default=0.0, at_least=0)
    T_0: float = parameter("K", "reference temperature", above=0)

    readings = read(constant="C_1 C_2 C_c T_0")

    @cached_property
    def C(self) -> float:
        """Total heat capacity at T_0."""
        return float(self.exact_capacity)

    @cached_property
    def exact_capacity(self) -> Fraction:
        """Total heat capacity at T_0 without rounding."""
        return Fraction(self.C_1) + Fraction(self.C_2) + Fraction(self.C_c)


class UniformBody(Reference):
    """Bodies and interface at one temperature, with quadratic energies unless a subclass has another model."""

    model: ClassVar[QuadraticEnergy] = QuadraticEnergy()

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)

    readings = read(constant="T_0", capacity="C", temperature="T_i")

    def heated(self, heat: Array) -> Array:
        """Return the temperature [K] after a supply of heat [J/m^2]."""
        return self.T_i + self.model.rise(heat, self.C, self.T_0, self.T_i)


class FrictionallyHeated(UniformBody):
    """A body and the dissipation that it would have at the reference temperature."""

    D_0: float = parameter("W/m^2", "dissipation at T_0", at_least=0)

    readings = read(heating_at_T_0="D_0")
