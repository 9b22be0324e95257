"""Doubts that are not reported, or that are errors: of a scene file, and of options of the command line."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from eomgen.base.limits import CALLED, DoubtSettings
from eomgen.base.messages import close_names, listed, shown
from eomgen.errors import Message, Problem

if TYPE_CHECKING:
    from eomgen.scene.reading.report import Report


@cache
def _every_name() -> tuple[str, ...]:
    """Return the names of all scene notes, warnings of equilibria and checks of runs."""
    from eomgen.base.products import rows_of  # noqa: PLC0415
    from eomgen.compiled.rest.state_warnings import GROUP, StateWarning  # noqa: PLC0415  # few scenes silence a doubt
    from eomgen.scene.document.notes import every_note  # noqa: PLC0415
    from eomgen.simulation.judgement.register import CHECKS  # noqa: PLC0415

    return tuple(row.name for row in (*every_note(), *rows_of(GROUP, StateWarning), *CHECKS))


def fault_of_name(name: str) -> tuple[str, str] | None:
    """Return the fault of a name that no doubt has, and a remedy; None for a known name."""
    if name in _every_name():
        return None
    hint = " or ".join(close_names(name, _every_name())) or f"one of {listed(_every_name())}"
    return f"there is no doubt {shown(name)} [E2234]", hint


def settings_of(parts: Mapping[str, Any], *, stored: bool) -> DoubtSettings:
    """Return the settings of doubts of a scene, joined with the command line's unless the report is ``stored`` with the
    scene.

    Parameters
    ----------
    parts : objects of products by section, of which ``doubts`` has the settings of the file
    """
    scene_settings = DoubtSettings(*parts.get("doubts", ()))
    problems = partial(_problems, 'doubts.quiet = ["{}"]' if scene_settings.strict else '--quiet "{}"')
    return scene_settings if stored else _join(scene_settings, CALLED.get())._replace(problems=problems)


def _join(first: DoubtSettings, second: DoubtSettings) -> DoubtSettings:
    return DoubtSettings(tuple(sorted({*first.quiet, *second.quiet})), first.strict or second.strict)


def _problems(silence: str, notes: Iterable[Message], report: Report | None = None) -> list[Problem]:
    """Return doubts as problems at the entries that they begin with, or, without a ``report``, at the equilibrium;
    ``silence`` is the text of the option that leaves out a doubt, with a gap for the name."""
    problems = []
    for note in notes:
        text, hint = note.fault_and_remedy()
        start = text.removeprefix("the ")
        named = (
            (key for key in report.lines if start.startswith((key, f"{key.replace('s.', ' ', 1)} "))) if report else ()
        )
        key = max(named, key=len, default="doubts.strict")
        where = report.where(key) if report else "equilibrium"
        hint = " or ".join(filter(None, (hint, silence.format(note.doubt))))
        problems.append(Problem(where, f"{text.removeprefix(f'{key}: ')} (doubt: {note.doubt})", hint, note.code))
    return problems


def add_settings(quiet: Collection[str] = (), *, strict: bool = False) -> None:
    """Leave out doubts by name, or make doubts errors, until the verb ends."""
    CALLED.set(_join(CALLED.get(), DoubtSettings(quiet, strict)))
