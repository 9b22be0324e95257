"""From the C of a stepper to the same stepper for several trajectories side by side, one in each lane of vectors."""

from eomgen.products.ensembles.lane_code.source import UntranslatableConstruct
from eomgen.products.ensembles.lane_code.translate import stepper_in_lanes, to_lanes

__all__ = ["UntranslatableConstruct", "stepper_in_lanes", "to_lanes"]
