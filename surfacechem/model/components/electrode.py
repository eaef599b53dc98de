r"""Electrodes: phases next to the surface whose potential follows from their charge.

The charge :math:`c\,\varphi` of a double layer per area changes by the current of the reactions, :math:`i`, and by the
current from outside, :math:`j`: :math:`c\,\dot\varphi=i+j`. Both bring the work :math:`\varphi\,(i+j)`, which is
stored as :math:`c\,\varphi^2/2`.
"""

from __future__ import annotations

from collections.abc import Iterator

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError
from surfacechem.model import balances
from surfacechem.model.balances import OUTSIDE, WORK, PowerFlow
from surfacechem.model.build import Build
from surfacechem.model.system import State
from surfacechem.quantities import Quantity
from surfacechem.scene import Electrode

ELECTRODE = "electrode"
"""Place that receives the work of charge."""

THERMAL_VOLTAGE = 0.025
"""Scale of a potential [V]: the thermal voltage, k_B T over an elementary charge, at room temperature."""


def variables(build: Build) -> Iterator[State]:
    """Yield the potentials as states."""
    for electrode in build.interface.electrodes:
        V = electrode.potential
        build.variables.define(V.name, symengine.Symbol(V.name), "evolved", _path(electrode))
        yield State(V, electrode.start, THERMAL_VOLTAGE)


def laws(build: Build) -> Iterator[PowerFlow]:
    """Set the charging of capacitances by currents; yield the work of the charge."""
    for electrode in build.interface.electrodes:
        name, title, V = electrode.phase, electrode.title, symengine.Symbol(electrode.potential.name)
        spec = Spec("F/m^2", "capacitance", above=0)
        c = build.constant(f"c_{name}", f"{_path(electrode)}.capacitance", spec, electrode.capacitance)
        made = f"i_{name}"
        current = symengine.Symbol(made) if build.is_named(made) else symengine.Integer(0)
        if electrode.current is not None:
            current = current + build.prescribe(electrode.drive, electrode.current)
        if current == 0:
            message = f"no reaction brings charge to {title}, and no `current` does, so its potential stays as it is."
            raise InputError(f"{message} Remove `capacitance`.", path=_path(electrode))
        energy, rate = c * V**2 / 2, current / c
        build.rows.kinematics(V.name, rate)
        build.store(Quantity(f"E_{name}", "J/m^2", f"energy of the charge of {title}"), energy)
        work = balances.power(energy, V, rate)
        yield PowerFlow(WORK, OUTSIDE, ELECTRODE, work, f"W_{name}", f"work of the charge that enters {title}")


def _path(electrode: Electrode) -> str:
    return f"interface.mechanism.neighbours.{electrode.title}"
