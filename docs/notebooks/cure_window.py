# %% [markdown]
# # A cure with its process window
#
# A layer of Hexcel 8552 between two plates heats itself while it cures, and what heats itself cures faster. How hot
# may the start be, and how thin the plates, if the layer is to stay below 220 °C and be cured within half an hour?
# First one run, beside its exact solution:

# %%
import tempfile
from pathlib import Path

import numpy as np

import surfacechem
from surfacechem import plots

cure = surfacechem.load("epoxy-cure-adiabatic")
one = cure.run()
print(
    one.reason,
    f"hottest {float(one['T'].max()) - 273.15:.1f} degC, error {one.accuracy.error:.0e}",
)
one.plot(["T", "phi"])

# %% [markdown]
# ## The window
#
# Two parameters, 130 runs. Of each a store keeps the largest temperature and the time at which 80 % are
# cured.

# %%
window = surfacechem.load(
    "epoxy-cure-adiabatic",
    {
        "sweep": {
            "over": {
                "initial.T": {"from": "150 degC", "to": "190 degC", "points": 13},
                "bodies.upper.C": {
                    "from": "0.5 kJ/m^2/K",
                    "to": "5 kJ/m^2/K",
                    "points": 10,
                },
            },
            "keep": {"max": ["T"], "reach": {"phi": 0.8}},
            "checked": 20,
        }
    },
)
stream = window.stream(window.plan(), Path(tempfile.mkdtemp()) / "window.zarr")
stored = stream.run()
print("error", stream.check())
runs = stored.dataset
plots.figure(runs, ["time_to_phi", "T_max"], celsius=True)

# %% [markdown]
# White is where 80 % are not reached in half an hour. What is both in time and cool enough is the window:

# %%
good = (runs["time_to_phi"] <= 1800) & (runs["T_max"] <= 220 + 273.15)
starts = runs["initial_T"].values[good.any(runs["time_to_phi"].dims[1]).values] - 273.15
print(
    f"{float(good.mean()):.0%} of all; starts between {starts.min():.0f} and {starts.max():.0f} degC"
)
assert 0 < float(good.mean()) < 1
assert np.all(np.diff(starts) > 0)
