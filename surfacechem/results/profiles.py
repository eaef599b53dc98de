"""Temperatures across bodies that conduct heat: their values in a run, and as variables of its dataset."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.conductors import Profile
from surfacechem.results.netcdf import Column
from surfacechem.solve.run import Trajectory

Array = NDArray[np.float64]


def profile_values(trajectory: Trajectory, profile: Profile) -> Array:
    """Temperatures across a body at the output times, shape (times, points)."""
    system, outputs = trajectory.model.system, trajectory.result.outputs
    states = {state.name: j for j, state in enumerate(system.states)}
    named = {item.name: j for j, item in enumerate(system.outputs)}
    names = [profile.surface, *profile.states, *([profile.far] if profile.far else [])]
    parts = [outputs[:, states[n]] if n in states else trajectory.outputs[:, named[n]] for n in names]
    return np.stack(parts, axis=1)


def profile_columns(trajectory: Trajectory) -> list[Column]:
    """Each profile and its coordinate."""
    found = []
    for profile in trajectory.model.system.profiles:
        x, values = f"x_{profile.number}", profile_values(trajectory, profile)
        places = np.array(profile.points) * trajectory.values[profile.thickness]
        found.append(Column(x, (x,), places, "m", f"distance from the contact into {profile.body}"))
        found.append(Column(profile.name, ("time", x), values, "K", f"temperature across {profile.body}"))
    return found
