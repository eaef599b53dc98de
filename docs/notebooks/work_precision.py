# %% [markdown]
# # Work and precision
#
# `surfacechem precision` measures the error of a case against run time, for several solvers and tolerances. Its
# dataset is an ordinary netCDF file. This notebook makes one, reads it with plain `xarray`, and draws its own figure
# from it.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

import surfacechem

folder = Path(tempfile.mkdtemp())
study = surfacechem.precision(
    ["exothermic", "sliding-dry"],
    solvers=["radau", "lsoda"],
    tolerances=[1e-4, 1e-7, 1e-10],
    repeat=1,
)
for path in study.write(folder / "study"):
    print(path.name)

# %% [markdown]
# From here on surfacechem is not used. Names of cases and solvers are variables along their dimensions; made an index,
# they are found by `sel`.

# %%
data = xarray.open_dataset(folder / "study.nc").set_index(
    case="case_name", solver="solver_name"
)
print(data)

# %% [markdown]
# What the errors are measured against, and how well that is known:

# %%
for case in data["case"].values:
    chosen = data.sel(case=case)
    print(
        f"{case}: {chosen.reference.item()}, uncertain by {chosen.uncertainty_max.item():.1e}"
    )

# %% [markdown]
# ## A figure of one's own
#
# Error on x, right-hand sides instead of seconds on y: that does not depend on the machine, nor on the language from
# which a library is called. Points below the uncertainty of the reference would be left out.

# %%
figure, axes = plt.subplots(
    1, data.sizes["case"], figsize=(8, 3.2), sharey=True, layout="constrained"
)
for ax, case in zip(axes, data["case"].values, strict=True):
    for solver in data["solver"].values:
        points = data.sel(case=case, solver=solver)
        known = points.where(points.error_max >= points.uncertainty_max)
        ax.loglog(known.error_max, known.count_residuals, "o-", label=solver)
    ax.set(title=case, xlabel="largest relative error")
axes[0].set_ylabel("right-hand sides")
axes[0].legend()
axes[0].grid(alpha=0.3)

# %% [markdown]
# ## The time to reach an error
#
# Between two tolerances both error and time are close to powers of each other, so times at equal error are interpolated
# in logarithms; errors beyond those of the loosest and the tightest tolerance give `nan`.


# %%
def seconds_at(points, error):
    order = np.argsort(points.error_max.values)
    errors, seconds = points.error_max.values[order], points.run_seconds.values[order]
    inside = errors[0] <= error <= errors[-1]
    return (
        float(np.exp(np.interp(np.log(error), np.log(errors), np.log(seconds))))
        if inside
        else np.nan
    )


for solver in data["solver"].values:
    times = [
        seconds_at(data.sel(case="exothermic", solver=solver), error)
        for error in (1e-5, 1e-7, 1e-9)
    ]
    print(f"{solver:6}", *(f"{1e3 * time:10.3f} ms" for time in times))

# %% [markdown]
# ## How much of the tolerance is achieved

# %%
ratio = data["error_max"] / data["tolerance"]
print(ratio.sel(case="exothermic").to_pandas().round(2))
