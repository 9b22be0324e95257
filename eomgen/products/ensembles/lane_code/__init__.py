"""From the C of a stepper to the same stepper for several trajectories side by side, one in each lane of vectors."""

from eomgen.products.ensembles.lane_code.stepper import stepper_in_lanes
from eomgen.products.ensembles.lane_code.translate import NotInLanes, translated

__all__ = ["NotInLanes", "stepper_in_lanes", "translated"]
