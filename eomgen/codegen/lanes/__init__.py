"""From the C of a stepper to the same stepper for several trajectories side by side, one in each lane of vectors."""

from eomgen.codegen.lanes.stepper import LANES_CDEF, lane_files
from eomgen.codegen.lanes.translate import NotInLanes, translated

__all__ = ["LANES_CDEF", "NotInLanes", "lane_files", "translated"]
