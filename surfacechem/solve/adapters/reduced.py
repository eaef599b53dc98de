"""The ordinary differential equation of the differential variables, for libraries that know no algebraic ones."""

import numpy as np

from surfacechem.solve.adapters.stepping import View
from surfacechem.solve.contract import Array


class Reduced:
    """x' = f(t, x) of the differential variables x and its exact Jacobian."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.mask = view.problem.program.algebraic_mask
        self.atol = view.problem.atol[~self.mask]

    def start(self, y: Array) -> Array:
        return y[~self.mask]

    def rates(self, t: float, x: Array) -> Array:
        self.view.residuals += 1
        return self.view.complete(t, x)[1][~self.mask]

    def jacobian(self, t: float, x: Array) -> Array:
        """From G_x dx + G_u du = 0 with u the derivatives and algebraic variables."""
        y, ydot = self.view.complete(t, x)
        by_state, by_rate = self.view.matrices(t, y, ydot)
        unknown = np.where(self.mask, by_state, by_rate)
        try:
            return np.asarray(-np.linalg.solve(unknown, by_state[:, ~self.mask])[~self.mask])
        except np.linalg.LinAlgError:
            return np.full((len(x), len(x)), np.nan)
