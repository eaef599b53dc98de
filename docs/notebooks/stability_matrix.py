# %% [markdown]
# # Reading the stability matrix
#
# `surfacechem stability` writes what every solver makes of every dangerous regime to an ordinary netCDF file. This
# notebook makes a small one, reads it with plain `xarray`, and asks it three questions.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

from surfacechem.studies.stability import stability

folder = Path(tempfile.mkdtemp())
study = stability(
    "capacity", "rupture", solvers=["radau", "cvode"], rtol=1e-6, quick=True, rounds=0
)
for path in study.write(folder / "matrix"):
    print(path.name)

# %% [markdown]
# From here on surfacechem is not used. A regime has as many values as it needs; beyond them there is nothing.

# %%
data = xarray.open_dataset(folder / "matrix.nc")
print(data)

# %% [markdown]
# ## How many digits are kept?
#
# Digits are -log10 of the largest relative error against the exact solution. The interface of the regime `capacity` has
# less and less heat capacity, so that its temperature settles faster and faster.

# %%
chosen = data.sel(regime="capacity")
figure, ax = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
for solver in data["solver"].values:
    kept = (
        chosen["digits"]
        .sel(solver=solver)
        .where(chosen["outcome"].sel(solver=solver) == "solved")
    )
    ax.semilogx(chosen["value"], kept, "o-", label=solver)
ax.set(xlabel=str(chosen["symbol"].item()), ylabel="digits kept", ylim=(0, 12))
ax.legend()
ax.invert_xaxis()

# %% [markdown]
# ## Where does a solver fail, and does it say so?
#
# `failed` is a run that ended with a reason; `wrong` is an answer that nobody should have been given.

# %%
for solver in data["solver"].values:
    cells = data.sel(solver=solver)
    outcomes, counts = np.unique(
        cells["outcome"].values[cells["value"].notnull().values], return_counts=True
    )
    print(solver, dict(zip(outcomes.tolist(), counts.tolist(), strict=True)))
cvode = data.sel(solver="cvode")
for regime, decade in np.argwhere((cvode["outcome"] == "failed").values):
    cell = cvode.isel(regime=regime, decade=decade)
    print(f"{cell.regime.item()} at {cell.value.item():.1e}: {cell.reason.item()[:80]}")

# %% [markdown]
# ## Was a run ended for the right reason?
#
# Bonds that share a load rupture at a known time, under the largest load before anything is computed. `refused` means
# that the run was ended for this reason; its digits are those of the time.

# %%
ended = data.sel(regime="rupture", solver="radau")
for k in range(ended.sizes["decade"]):
    cell = ended.isel(decade=k)
    if np.isfinite(cell["value"]):
        print(
            f"{cell.value.item():8g}  {cell.outcome.item()}  {cell.digits.item():5.1f}  {cell.reason.item()[:50]}"
        )
assert set(ended["outcome"].values) <= {"refused", ""}

# %% [markdown]
# What it costs is in `steps` and `residuals`:

# %%
steps = data["steps"].sel(regime="capacity").to_pandas().dropna()
steps.index = [
    f"{value:.1e}"
    for value in data["value"].sel(regime="capacity").values[: len(steps)]
]
print(steps)
