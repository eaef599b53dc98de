"""Figures of studies."""

import numpy as np
import pytest
import xarray

from surfacechem.plots import figure
from surfacechem.plots.study import NUMBER_DIMENSIONS, TEXT_DIMENSIONS
from surfacechem.solve import names

pytestmark = pytest.mark.around


def test_every_solver_has_its_colour_and_no_two_look_alike():
    sizes = {"case": 1, "solver": len(names), "tolerance": 2, "variable": 1}
    values = {}
    for name, dimensions in NUMBER_DIMENSIONS.items():
        shape = [sizes[d] for d in dimensions]
        values[name] = dimensions, np.geomspace(1e-3, 1e-2, int(np.prod(shape))).reshape(shape)
    values |= {name: (dims, np.full([sizes[d] for d in dims], "x", object)) for name, dims in TEXT_DIMENSIONS.items()}
    study = xarray.Dataset(values | {"solver_name": ("solver", np.array(names, object))}, attrs={"study": "precision"})
    handles = [h for h in figure(study).legends[0].legend_handles if h.get_label() in names]
    assert [h.get_label() for h in handles] == [*names]
    assert len({h.get_color() for h in handles}) == len(names)
