"""The loop over lanes with explicit steps of order 8."""

from typing import Any

from surfacechem.solve.lanes import lane_step
from surfacechem.solve.lanes.lane_run import run_through
from surfacechem.solve.lanes.layout import EXPLICIT_MEMORY, NUMBERS, SIZES
from surfacechem.solve.radau.driver import LEAST_NORM
from surfacechem.solve.radau.record import StepperRecord, laying_out

_METHOD = {
    "end_stage": lane_step.END_STAGE,
    "root_of": lane_step.eighth_root,
    "least_root": LEAST_NORM**0.125,
    "try_step": lane_step.try_step,
    "propose": lane_step.propose,
    "is_noise": lane_step.is_noise,
    "find_stiff": lane_step.find_stiff,
    "put_roughly": lane_step.put_roughly,
    "interpolate": lane_step.interpolate,
    "find_defects": lane_step.find_defects,
    "check_outputs": lane_step.check_outputs,
    "keep_step": lane_step.keep_step,
}
_lay_out = laying_out(StepperRecord("ExplicitLanes", SIZES, NUMBERS, EXPLICIT_MEMORY, _METHOD))


def run_explicitly(first: int, last: int, memory: Any, batch: Any) -> None:
    """Solve runs first to last - 1 of a batch."""
    run_through(_lay_out(batch, memory), first, last)
