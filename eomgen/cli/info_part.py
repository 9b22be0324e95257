"""Rows of the register of parts of ``eomgen info``: products add rows of the group ``eomgen.info``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene

GROUP = "eomgen.info"


@dataclass(frozen=True)
class InfoPart:
    """A part of the information about a scene.

    Attributes
    ----------
    describe : returns its data, as JSON types by key
    show : prints its data
    hidden : returns the parameters in its data that the table of parameters leaves out
    """

    describe: Callable[[Scene], Mapping[str, Any]]
    show: Callable[[Mapping[str, Any]], None]
    hidden: Callable[[Mapping[str, Any]], Iterable[str]]
