"""Contracts of laws: what they state and may read; with the bodies, cells and media that they refer to."""
