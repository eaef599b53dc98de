"""Solvers of other libraries under the same contract."""
