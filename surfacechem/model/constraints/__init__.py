"""Constraints of a scene, each with its modes, its edges and the switches and reactions that rows read.

Unilateral contact and its impacts, the set-valued law of friction, bounds of the bonding state, thresholds of traction,
envelopes; and folds.
"""
