"""Sweeps in lanes: eight runs in the places of one vector, each with its own time, step size and end."""
