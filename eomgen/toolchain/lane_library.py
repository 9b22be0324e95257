"""A loaded library that steps several trajectories side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.toolchain.cffi_build import load_abi
from eomgen.toolchain.large_stack import with_stack


class LaneLibrary:
    """A compiled stepper of several trajectories.

    Attributes
    ----------
    lanes : how many there are
    state_size, workspace_size : doubles of the memory of all of them
    layout : of the library of one trajectory
    """

    def __init__(self, path: Path, cdef: str, layout: Mapping[str, Any]) -> None:
        self.ffi, lib = load_abi(path, cdef)
        self.lanes = int(lib.eomgen_lanes_size(0))
        self.state_size, self.workspace_size = (int(lib.eomgen_lanes_size(k)) // 8 for k in (1, 2))
        self.lib = with_stack(lib, self.lanes * int(layout.get("stack", 0)))
        self.layout = layout
        self.path = path
