"""Contracts of laws: what they state and may read; also the bodies, grids, units and media that laws refer to."""
