"""Solvers of other libraries under the contract of this package."""
