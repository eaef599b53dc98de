"""What a scene must not pass, each constraint with its modes, edges and guards: unilateral contact and its impacts, the
set-valued law of friction, bounds of the bonding state, thresholds of traction, envelopes; and folds and load steps.
"""
