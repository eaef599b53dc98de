"""What a scene must not pass, each constraint with its modes, its edges and what rows read of it.

Unilateral contact and its impacts, the set-valued law of friction, bounds of the bonding state, thresholds of traction,
envelopes; and folds.
"""
