"""Constraints of a scene, each with its modes, edges and reset maps, and the switches and reactions that rows read.

Unilateral contact and impacts, set-valued friction along a line and in the plane, bounds of the bonding state,
thresholds of traction, envelopes and folds.
"""
