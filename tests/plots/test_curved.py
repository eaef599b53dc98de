"""Figures of two curved surfaces: what is drawn is what the dataset holds."""

import numpy as np
import pytest
from case_runs import solved

from surfacechem.plots import figure

pytestmark = pytest.mark.around


@pytest.fixture(scope="module")
def dataset():
    return solved("ball-in-a-socket").dataset


def test_a_run_of_surfaces_shows_profiles_tractions_and_force_below_what_runs_show(dataset):
    usual, own = figure(dataset), figure(dataset, ["traction"])
    profiles, tractions, force = own.axes
    assert [ax.get_ylabel() for ax in usual.axes[-3:]] == [ax.get_ylabel() for ax in own.axes]
    assert len(usual.axes) > 3
    x, z = profiles.lines[0].get_data()
    assert np.hypot(x, z - 25e-9) == pytest.approx(np.full(len(x), 25e-9), rel=1e-12)
    drawn = max(np.max(line.get_ydata()) for line in tractions.lines)
    assert drawn == pytest.approx(dataset.traction.values.max(), rel=1e-12)
    line, local = force.lines
    assert (line.get_ydata() == dataset.t_n.values).all()
    assert local.get_ydata() == pytest.approx((dataset.force + dataset.local_difference).values)


def test_without_an_axis_of_symmetry_the_traction_is_a_field(dataset):
    tilted = dataset.copy(deep=True)
    tilted["gap"] = dataset.gap * (1 + 1e-3 * dataset.surface_x / 1e-8)
    drawn = figure(tilted, ["traction"]).axes[1].collections[0].get_array()
    assert np.abs(drawn).max() == pytest.approx(np.abs(dataset.traction.values).max() / 1e6, rel=1e-12)


def test_of_a_field_no_more_is_drawn_than_a_half_beyond_what_is_felt(dataset):
    x, y = dataset.surface_x, dataset.surface_y
    tilted = dataset.assign(gap=dataset.gap * (1 + 1e-3 * x / 1e-8), traction=1e6 * (x**2 + y**2 < 4e-9**2))
    tilted["traction"] = tilted.traction.expand_dims(surface_time=dataset.surface_time)
    ax = figure(tilted, ["traction"]).axes[1]
    felt = float(x.where(tilted.traction[0] > 0).max())
    assert [*ax.get_xlim(), *ax.get_ylim()] == pytest.approx([s * 1.5 * felt for s in (-1, 1, -1, 1)], rel=0.05)


def test_the_far_side_of_a_closed_body_does_not_cover_the_near_one(dataset):
    whole = dataset.copy(deep=True)
    u, v = np.meshgrid(np.linspace(0, np.pi, dataset.sizes["u"]), np.linspace(0, 2 * np.pi, dataset.sizes["v"]))
    for axis, value in zip("xyz", (np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u) - 1), strict=True):
        whole[f"surface_{axis}"].values[:] = 1e-8 * value.T
    whole["gap"] = dataset.gap * (1 + 1e-3 * whole.surface_x / 1e-8)
    profile, field, _ = figure(whole, ["traction"]).axes[:3]
    x, z = profile.lines[0].get_data()
    assert z.min() == pytest.approx(-1e-8, rel=0.05)
    assert -x.min() == pytest.approx(x.max(), rel=0.1)  # with sixteen points around the opposite one is beside
    assert field.collections[0].get_array().shape[0] == pytest.approx(dataset.sizes["u"] / 2, abs=1)


def test_a_section_through_a_plate_is_one_line(dataset):
    """Its columns lie beside each other and meet nowhere, unlike those around an axis."""
    plate = dataset.copy(deep=True)
    u, v = np.meshgrid(np.linspace(0, 2e-8, dataset.sizes["u"]), np.linspace(-1e-8, 1e-8, dataset.sizes["v"]))
    for axis, value in zip("xyz", (u, v, -(u**2) - v**2), strict=True):
        plate[f"surface_{axis}"].values[:] = value.T
    plate["gap"] = dataset.gap * (1 + 1e-3 * plate.surface_x / 1e-8 + plate.surface_y / 1e-7)
    x, _ = figure(plate, ["traction"]).axes[0].lines[0].get_data()
    assert x == pytest.approx(u[0])
