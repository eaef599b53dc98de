"""The ordinary differential equation of the differential variables, for libraries that know no algebraic ones."""

import numpy as np

from surfacechem.solvers.contract import Array
from surfacechem.solvers.stepping import LEDGER_ATOL, View


class Reduced:
    """x' = f(t, x) with x = [differential variables | ledger] and its exact Jacobian."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.mask = view.problem.program.algebraic_mask
        self.n = int(np.sum(~self.mask))
        self.atol = np.concatenate((view.problem.atol[~self.mask], np.full(view.problem.program.n_ledger, LEDGER_ATOL)))

    def start(self, y: Array, ledger: Array) -> Array:
        return np.concatenate((y[~self.mask], ledger))

    def rates(self, t: float, x: Array) -> Array:
        self.view.residuals += 1
        y, ydot = self.view.complete(t, x[: self.n])
        return np.concatenate((ydot[~self.mask], self.view.ledger_rates(t, y, ydot)))

    def jacobian(self, t: float, x: Array) -> Array:
        """From G_x dx + G_u du = 0 with u the derivatives and algebraic variables. The ledger does not act back: its
        rows stay 0.
        """
        y, ydot = self.view.complete(t, x[: self.n])
        by_state, by_rate = self.view.matrices(t, y, ydot)
        unknown = np.where(self.mask, by_state, by_rate)
        result = np.zeros((len(x), len(x)))
        try:
            result[: self.n, : self.n] = -np.linalg.solve(unknown, by_state[:, ~self.mask])[~self.mask]
        except np.linalg.LinAlgError:
            result[:] = np.nan
        return result
