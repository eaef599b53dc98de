"""What a figure shows: the usual panels of a run, or those of chosen variables."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray
from numpy.typing import NDArray

from surfacechem.errors import InputError, suggestion

Array = NDArray[np.float64]

FLAT = 1e-9
"""A curve that changes by less than this part of its size is constant."""

MODE = "mode ("
"""How the long name of a mode begins; its values are shown as bands."""


@dataclass(frozen=True)
class Panel:
    """Curves that share an axis."""

    title: str
    unit: str
    names: tuple[str, ...]


KINDS: tuple[tuple[str, str, str], ...] = (
    ("Temperature", "K", r"(?!.*_exact$).*"),
    ("Bonding", "1", r"(?!formed_|departure_|.*_residual$|.*_exact$|J_c$|n_c$|gamma_m$|ln_theta$|drive$).*"),
    ("Gap", "m", r"g_(?!.*_exact$)\w*"),
    ("Displacement", "m", r"u_t2?"),
    ("Velocity", "m s-1", r"(?!.*_exact$)\w+"),
    ("Traction", "Pa", r"(?!.*_exact$|.*_nominal$).*"),
    ("Heat flux", "W m-2", r"q_(?!m$|t$|.*_exact$|.*_nominal$)\w+"),
    ("Dissipation", "W m-2", r"D_\w+"),
)
"""Panels of the default figure: title, unit and pattern of the names."""


def curves(dataset: xarray.Dataset) -> list[str]:
    """Variables that are functions of time alone."""
    return [str(name) for name, values in dataset.data_vars.items() if values.dims == ("time",)]


def profiles(dataset: xarray.Dataset) -> list[str]:
    """Temperatures across bodies, functions of time and place."""
    return [str(name) for name in dataset.data_vars if re.fullmatch("profile_[12]", str(name))]


def _is_mode(dataset: xarray.Dataset, name: str) -> bool:
    return str(dataset[name].attrs.get("long_name", "")).startswith(MODE)


def unit(dataset: xarray.Dataset, name: str) -> str:
    """The unit of a variable."""
    return str(dataset[name].attrs.get("units", "1"))


def usual(dataset: xarray.Dataset) -> list[Panel]:
    """The panels of the kinds that vary in the run."""
    panels = []
    for title, wanted, pattern in KINDS:
        names = [
            n
            for n in curves(dataset)
            if unit(dataset, n) == wanted and re.fullmatch(pattern, n) and not _is_mode(dataset, n)
        ]
        if title == "Heat flux" and {"q_1", "q_2"} & set(names):
            names = [n for n in names if n in ("q_1", "q_2")]
        if any(varies(dataset[n].values) for n in names):
            panels.append(Panel(title, wanted, tuple(names)))
    return panels


def varies(values: Array) -> bool:
    """Whether a curve is more than a constant with rounding."""
    finite = values[np.isfinite(values)]
    if len(finite) < 2:
        return len(finite) == 1
    return bool(np.ptp(finite) > FLAT * np.max(np.abs(finite), initial=0.0))


def chosen(dataset: xarray.Dataset, variables: Sequence[str]) -> list[Panel]:
    """A panel for each unit of the variables; InputError for one that the dataset has not over time."""
    known = curves(dataset)
    for name in variables:
        if name not in known:
            raise InputError(f"no variable '{name}' over time in the dataset.{suggestion(name, known)}")
    units = dict.fromkeys(unit(dataset, name) for name in variables)
    groups = {u: tuple(n for n in dict.fromkeys(variables) if unit(dataset, n) == u) for u in units}
    return [Panel(_title(dataset, names), u, names) for u, names in groups.items()]


def _title(dataset: xarray.Dataset, names: Sequence[str]) -> str:
    if len(names) > 1:
        return ""
    text = str(dataset[names[0]].attrs.get("long_name", names[0])).split(":")[0]
    return text[:1].upper() + text[1:] if len(text) < 26 else ""


def merged(dataset: xarray.Dataset, names: Sequence[str]) -> list[list[str]]:
    """The names in groups whose curves coincide, so that none hides another."""
    groups: list[list[str]] = []
    for name in names:
        values = dataset[name].values
        twin = next((g for g in groups if np.allclose(dataset[g[0]].values, values, rtol=1e-9, atol=0.0)), None)
        if twin is not None:
            twin.append(name)
        else:
            groups.append([name])
    return groups
