"""Results on two curved surfaces at some output times of a run: moments, area of contact, and fields over body 1."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.results.netcdf import Column
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Trajectory

if TYPE_CHECKING:
    from surfacechem.surfaces.potential import CurvedSurfaces


MOST_SURFACE_TIMES = 9
"""Number of evenly spread output times at which results on the surfaces are computed."""

POINTS_ALONG, POINTS_AROUND, POINTS_ACROSS = 81, 16, 33
"""Points of the fields away from and around an axis of symmetry; in both directions if there is none."""

TIME = "surface_time"


def surface_columns(trajectory: Trajectory, surface: CurvedSurfaces) -> tuple[list[Column], float]:
    """Return columns over the times of the surfaces and over body 1, and the time spent on their integrals [s]."""
    from surfacechem.surfaces.potential import INTEGRATION_TIME, integrating

    before, times = INTEGRATION_TIME.seconds, trajectory.result.times
    chosen = np.unique(np.linspace(0, len(times) - 1, MOST_SURFACE_TIMES).round().astype(int))
    columns = [Column(TIME, (TIME,), times[chosen], "s", "times at which the surfaces are looked at")]
    with integrating():
        surface, gaps = surface.of_run(trajectory.values), trajectory.columns["g_n"][0][chosen]
        # A run may end a rounding beyond the range of tabulated approaches.
        approaches, stretches = np.clip(gaps, *surface.approach), np.ones_like(gaps)
        if "J_c" in trajectory.columns:
            stretches = trajectory.columns["J_c"][0][chosen]
        columns += [*_totals(surface, approaches, stretches), *_fields(surface, approaches, stretches)]
    return columns, INTEGRATION_TIME.seconds - before


def _totals(surface: CurvedSurfaces, approaches: Array, stretches: Array) -> list[Column]:
    """Return moment, area of contact, conductance, and the deviation of the local law."""
    from surfacechem.surfaces.inner_sums import alike_around

    force, moment_x, moment_y, local, least, places, area, across = surface.totals(approaches, stretches)
    columns = []
    if not alike_around(*surface.surfaces(0.0)):
        columns = [
            Column(f"moment_{axis}", (TIME,), moment, "N m", f"moment on body 1 about the {axis} axis")
            for axis, moment in (("x", moment_x), ("y", moment_y))
        ]
    columns += [
        Column("approach", (TIME,), approaches, "m", "approach of the surfaces"),
        Column("force", (TIME,), force, "N", "normal force on body 1, tension positive"),
        Column("gap_least", (TIME,), least, "m", "least gap of the surfaces"),
        Column("gap_places", (TIME,), places, "1", "places that are as near"),
        Column("contact_area", (TIME,), area, "m^2", "area of body 1 that touches or overlaps body 2"),
        Column("contact_radius", (TIME,), np.sqrt(area / math.pi), "m", "radius of a circle of the area of contact"),
    ]
    if surface.pairs:
        text = "force of the local law minus the integral"
        columns.append(Column("local_difference", (TIME,), local - force, "N", text))
    if surface.heat_laws:
        columns.append(Column("conductance", (TIME,), across, "W/K", "heat conductance over the gap"))
    return columns


def _fields(surface: CurvedSurfaces, approaches: Array, stretches: Array) -> Sequence[Column]:
    """Return gap and traction at points of body 1, which are denser where body 2 is nearest."""
    from surfacechem.surfaces.pairwise import length
    from surfacechem.surfaces.patches import Budget, outer_patches
    from surfacechem.surfaces.projection import FIRST_ORDER

    lower, upper = surface.surfaces(float(approaches.min()))
    size = length(lower, upper)
    patches, _ = outer_patches(lower, upper, size, size, Budget(surface.accuracy))
    lower = patches.surface
    counts = [POINTS_ALONG, POINTS_AROUND] if patches.uniform[1] else [POINTS_ACROSS, POINTS_ACROSS]
    at = np.stack(np.meshgrid(*map(patches.line, (0, 1), counts), indexing="ij"), axis=-1)
    D = lower.derivatives(lower.off_pole(at), FIRST_ORDER)
    x, normals = D[0], lower.normals(D)
    near = [replace(upper, approach=d).nearest(x) for d in approaches.tolist()]
    gap, opposite = np.array([one.gap for one in near]), np.array([one.point for one in near])
    # With an axis of symmetry all columns around it are equal.
    some = slice(0, 1 if patches.uniform[1] else None)
    points, directions = (part[:, some].reshape(-1, 3) for part in (x, normals))
    gaps = gap[:, :, some].reshape(len(gap), -1)
    felt, summed = surface.tractions(points, directions, gaps, approaches, stretches)
    traction = np.broadcast_to(felt.reshape(len(gap), len(x), -1), gap.shape)
    over = ("u", "v")
    places = [
        Column(f"surface_{axis}", over, x[..., k], "m", f"{axis} of points of body 1") for k, axis in enumerate("xyz")
    ]
    places += [
        Column(f"opposite_{axis}", (TIME, *over), opposite[..., k], "m", f"{axis} of the nearest point of body 2")
        for k, axis in enumerate("xyz")
    ]
    by = "" if summed or not surface.pairs else " by the local law"
    text = f"normal traction on body 1{by}, tension positive"
    return [
        *places,
        Column("gap", (TIME, *over), gap, "m", "gap between the surfaces"),
        Column("traction", (TIME, *over), traction, "Pa", text),
    ]
