"""Doubts that are not reported, or that are errors: of a scene file, and of options of the command line."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any

from eomgen.base.limits import DoubtSettings
from eomgen.base.messages import nearest, shown

#: Settings that options of the command line give.
_ASKED: ContextVar[DoubtSettings] = ContextVar("doubts", default=DoubtSettings())  # noqa: B039  # never changed


@cache
def notes_of_scenes() -> tuple[str, ...]:
    """Return the names of the notes of scenes."""
    from eomgen.scene.document.notes import every_note  # noqa: PLC0415  # few scenes silence a doubt

    return tuple(row.name for row in every_note())


@cache
def doubts_of_results() -> tuple[str, ...]:
    """Return the names of warnings of equilibria and of checks of runs."""
    from eomgen.base.products import rows_of  # noqa: PLC0415
    from eomgen.compiled.rest.state_warnings import GROUP, StateWarning  # noqa: PLC0415  # few runs silence a doubt
    from eomgen.simulation.judgement.register import CHECKS  # noqa: PLC0415

    return tuple(row.name for row in (*rows_of(GROUP, StateWarning), *CHECKS))


def fault_of_name(name: str, known: Collection[str]) -> tuple[str, str] | None:
    """Return the fault of a name that no known doubt has, and a remedy; None for a known name."""
    if name in known:
        return None
    alike = "doubts.quiet in the file" if name in notes_of_scenes() else nearest(name, known)
    return f"there is no doubt {shown(name)} [E2234]", alike or f"one of {', '.join(known)}"


def settings_of(parts: Mapping[str, Any], *, stored: bool) -> DoubtSettings:
    """Return the settings of a scene and, unless the report is stored, of the command line.

    Parameters
    ----------
    parts : objects by section of a product
    """
    own = DoubtSettings(*parts.get("doubts", ()))
    return own if stored else _join(own, _ASKED.get())


def _join(one: DoubtSettings, other: DoubtSettings) -> DoubtSettings:
    return DoubtSettings({*one.quiet, *other.quiet}, one.strict or other.strict)


@contextmanager
def with_settings(quiet: Collection[str] = (), *, strict: bool = False) -> Iterator[None]:
    """Leave out doubts by name, or make doubts errors, within the block."""
    before = _ASKED.set(_join(_ASKED.get(), DoubtSettings(quiet, strict)))
    try:
        yield
    finally:
        _ASKED.reset(before)
