"""``extremes``: a scene along its ladders, cell by cell, each in a process of its own."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.files import Journal
from eomgen.base.text import nearest, shown
from eomgen.base.version import __version__
from eomgen.errors import Problem, UsageError
from eomgen.integrators.methods import AUTO, canonical_name
from eomgen.products.studies.defaults import EXTREMES_BUDGET, EXTREMES_LIMIT
from eomgen.products.studies.ladders.references import Reference, difference, reference
from eomgen.products.studies.ladders.register import BY_NAME, EQUATIONS, LADDERS, SAME, Ladder, methods_of
from eomgen.products.studies.ladders.result import Extremes
from eomgen.products.studies.ladders.runs import REACHED, Conditions, Ended, Request, Runner, compile_stepper, simulated
from eomgen.products.studies.ladders.structure import Structure
from eomgen.products.studies.ladders.subject import FACTORS, OWN, SINGLE, Subject
from eomgen.products.studies.ladders.verdicts import FAILS, Cell, verdict

#: Called with cells done, cells in all, and the present cell.
Progress = Callable[[int, int, str], None]
_CELLS = "cells.jsonl"


def extremes(
    scene: Any,
    *,
    ladders: Sequence[str] = (),
    methods: Sequence[str] = (),
    cells: Sequence[str] = (),
    budget: float = EXTREMES_BUDGET,
    limit: float = EXTREMES_LIMIT,
    folder: str | Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    **reading: Any,
) -> Extremes:
    """Run a scene under extreme conditions, and return a verdict for each.

    Parameters
    ----------
    scene : path, mapping or Scene
    ladders : sequence of str
        Names of ladders; all by default.
    methods : sequence of str
        The scene's own, the default and others that serve it, by default.
    cells : sequence of str
        ``LADDER:VALUE`` or ``LADDER:VALUE:METHOD``: these alone.
    budget : float
        Seconds of computation, compiling aside; omitted cells are reported.
    limit : float
        Seconds that a cell may take, compiling aside.
    folder : path
        Folder for cells as they come; see also ``Extremes.save``.
    resume : bool
        Go on with the cells of the folder.
    progress : callable
        Called with cells done, cells in all, and the present cell.
    reading
        As of ``eomgen.load``.

    Returns
    -------
    Extremes

    Raises
    ------
    UsageError
        An unknown ladder, method or cell.
    FileError
        The folder holds the cells of another study, or of this one without ``resume``.
    EomgenError
        The scene cannot be read or built.
    """
    began = time.perf_counter()
    for name in ladders:
        if name not in BY_NAME:
            raise UsageError(Problem("ladders", f"there is no ladder {shown(name)}", nearest(name, list(BY_NAME))))
    for method in (*methods, *(method for _, _, method in map(_cell_of, cells) if method)):
        if method != AUTO:
            canonical_name(method)
    study = _Study(Subject(scene, reading), limit)
    wanted = [BY_NAME[name] for name in ladders] or list(LADDERS)
    chosen = [_cell_of(text) for text in cells] if cells else None
    journal = _journal(folder, _identity(study.subject), resume=resume)
    try:
        result, left_out = study.run(wanted, methods, chosen, journal, budget, progress)
    finally:
        study.runner.close()
    source = str(scene) if isinstance(scene, str | Path) else study.subject.name
    return Extremes(
        study.subject.name, source, tuple(result), left_out, study.subject.period, time.perf_counter() - began
    )


def _cell_of(text: str) -> tuple[Ladder, float, str]:
    name, _, rest = text.partition(":")
    value, _, method = rest.partition(":")
    if name not in BY_NAME:
        raise UsageError(Problem(f"--cell {text}", f"there is no ladder {shown(name)}", nearest(name, list(BY_NAME))))
    try:
        return BY_NAME[name], float(value), method
    except ValueError:
        fault = f"{value!r} is no value of the ladder {name}"
        raise UsageError(Problem(f"--cell {text}", fault, f"--cell {name}:{BY_NAME[name].values[0]:g}")) from None


class _Study:
    def __init__(self, subject: Subject, limit: float) -> None:
        self.subject, self.limit = subject, limit
        self.references: dict[str, Reference] = {}
        self.structure: Structure | None = None
        self.runner = Runner(
            lambda request: compile_stepper(subject.model(request.conditions.model), request.method),
            lambda request: simulated(
                subject.model(request.conditions.model), request.conditions, request.method, **request.more
            ),
        )

    def run(
        self,
        wanted: Sequence[Ladder],
        methods: Sequence[str],
        chosen: Sequence[tuple[Ladder, float, str]] | None,
        journal: Journal[Cell],
        budget: float,
        progress: Progress | None,
    ) -> tuple[list[Cell], dict[str, str]]:
        result: list[Cell] = []
        left_out: dict[str, str] = {}
        plan = []
        if chosen is not None:
            for ladder, value, method in chosen:
                plan += [
                    (ladder, value, m) for m in ([method] if method else methods_of(ladder, self.subject, methods))
                ]
            wanted = list(dict.fromkeys(ladder for ladder, _, _ in chosen))
        for ladder in wanted:
            why = ladder.applies(self.subject)
            if why:
                left_out[ladder.name] = why
            elif chosen is None:
                known = methods_of(ladder, self.subject, methods)
                plan += [(ladder, value, method) for value in ladder.values for method in known]
        plan = [entry for entry in plan if entry[0].name not in left_out]
        began = time.perf_counter()
        known_cells = {cell.name: cell for cell in journal.rows}
        for number, (ladder, value, method) in enumerate(plan):
            if progress is not None:
                progress(number, len(plan), f"{ladder.name} {value:g} {method}")
            key = f"{ladder.name}:{value:.9g}:{method}"
            if key in known_cells:
                result.append(known_cells[key])
            elif time.perf_counter() - began - self.runner.compiling > budget:
                left_out[key] = "the budget is spent"
            else:
                cell = self.cell(ladder, value, method)
                journal.append(dataclasses.asdict(cell))
                result.append(cell)
        return result, left_out

    def cell(self, ladder: Ladder, value: float, method: str) -> Cell:
        """Return one cell."""
        if ladder.against == EQUATIONS:
            return self._equations(ladder, value, method)
        conditions = ladder.conditions(self.subject, value)
        self.subject.model(conditions.model)  # a model that cannot be built raises here
        request = Request(conditions, method)
        ended = self.runner.ended(request, self.limit)
        used = self.runner.used
        result = self._judged(ladder, value, method, conditions, ended)
        if result.verdict == FAILS and used:  # earlier runs of its process must not be the reason
            self.runner.close()
            ended = self.runner.ended(request, self.limit)
            result = self._judged(ladder, value, method, conditions, ended)
        return result

    def _judged(self, ladder: Ladder, value: float, method: str, conditions: Conditions, ended: Ended) -> Cell:
        error, by = None, ""
        if ended.how == REACHED and ended.finite and ended.arrays is not None:
            held = self._reference(ladder, conditions, method)
            by = held.by
            if held.arrays is not None:
                epsilon = float(np.finfo(np.float32 if conditions.model == SINGLE else np.float64).eps)
                error = difference(self.subject, ended.arrays, held.arrays, ladder.bound, epsilon)
        result = verdict(ended, None if error is None else error.worst, ladder.bound)
        q, v = (None, None) if error is None else error
        return Cell(ladder.name, value, method, result, q, v, ladder.bound, ended.said, by, ended.seconds)

    def _equations(self, ladder: Ladder, value: float, method: str) -> Cell:
        if self.structure is None:
            self.structure = Structure(self.subject)
        structure = self.structure
        began = time.perf_counter()
        ended, excess = structure.moved(value)
        said = "" if excess <= 1.0 else ended.said
        error = excess * ladder.bound if ended.how == REACHED else None
        # other equations are no matter of degree
        plain = Ended(ended.how, ended.said if ended.how != REACHED else "")
        result = verdict(plain, None if error is None else error if excess <= 1.0 else 1.0, ladder.bound)
        took = time.perf_counter() - began
        said = said or plain.said
        return Cell(ladder.name, value, method, result, error, None, ladder.bound, said, ladder.against, took)

    def _reference(self, ladder: Ladder, conditions: Conditions, method: str) -> Reference:
        if ladder.against == SAME:
            key = f"same {method}"
            if key not in self.references:
                own = self.subject.conditions(model=FACTORS)
                ended = self.runner.ended(Request(own, method, {"error_estimate": False}), self.limit)
                arrays = dict(ended.arrays) if ended.how == REACHED and ended.arrays is not None else None
                self.references[key] = Reference(f"{method}, the scene as it is", arrays, 0.0)
            return self.references[key]
        if conditions.model == SINGLE:  # rounding of its own would be called exact
            conditions = conditions.varied(model=OWN)
        key = _key(conditions.varied(given={}))
        if key not in self.references:
            self.references[key] = reference(self.subject, conditions, self.runner.ended)
        return self.references[key]


def _key(conditions: Conditions) -> str:
    return json.dumps(dataclasses.asdict(conditions), default=lambda array: array.tolist(), sort_keys=True)


def _identity(subject: Subject) -> str:
    """Return a text by which cells of one study are known."""
    return json.dumps({"scene": subject.scene.digest.hex(), "version": __version__})


def _journal(folder: str | Path | None, described: str, *, resume: bool) -> Journal[Cell]:
    return Journal(
        None if folder is None else Path(folder),
        _CELLS,
        "cells of a study",
        identity=described,
        others="another scene",
        row_of=lambda line: Cell(**line),
        resume=resume,
    )
