"""Load paths and buckling loads of ``eomgen equilibrium``, by its options ``--path`` and ``--buckling``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.base.json_text import json_text
from eomgen.base.progress import waiting
from eomgen.cli import INTERRUPTED
from eomgen.cli.printing import print_json, print_table, say
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.products.statics.equilibrium_path import EquilibriumPath
    from eomgen.products.statics.path_following import BucklingLoads


@dataclass(frozen=True)
class PathRequest:
    """Request of ``--path``, ``--over``, ``--plot``, ``--buckling`` and ``--out``."""

    along: tuple[str, float, float] | None
    over: tuple[str, ...]
    figure: str | None
    buckling: tuple[str, float] | None
    out: str | None

    @classmethod
    def read(
        cls, along: str | None, over: tuple[str, ...], figure: str | None, buckling: str | None, out: str | None
    ) -> PathRequest:
        """Return the request. Raises UsageError for words that cannot be read."""
        if along is not None and buckling is not None:
            raise UsageError(Problem("--buckling", "it is asked for together with --path", "one of them"))
        endings = (".csv", ".json") if along is not None else (".json",)
        if out is not None and Path(out).suffix not in endings:
            fault = f"{'a path is' if along is not None else 'buckling loads are'} written as {' or '.join(endings)}"
            raise UsageError(Problem(f"--out {out}", fault, f"--out result{endings[0]}"))
        return cls(
            None if along is None else _range(along),
            over,
            figure,
            None if buckling is None else _preload(buckling),
            out,
        )

    def answer(
        self, model: Model, initial: Mapping[str, Any], parameters: Any, time: float, inputs: Any, as_json: bool
    ) -> int:
        """Print and write the requested path or buckling loads. Raises NumericalError if a path does not arrive, after
        the path is written."""
        given = {"initial": initial or None, "parameters": parameters, "t": time, "u": inputs}
        if self.buckling is not None:
            with waiting(f"{model.name}: buckling loads"):
                result = model.buckling_loads(*self.buckling, **given)
            return self._buckling(result, model, as_json)
        if self.along is None:
            return 0
        name, start, to = self.along
        path = model.equilibrium_path(name, to, start, progress=True, **given)
        for column in self.over:
            path.column(column)
        files = [] if self.out is None else [path.save(self.out)]
        if self.figure is not None:
            path.plot(self.over, path=self.figure)
            files.append(Path(self.figure))
        if as_json:
            print_json({"scene": model.name, **path.to_dict()})
        else:
            self._table(path, model.name)
        say(f"{len(path.values)} equilibria; {path.message}{_written(files)}")
        if path.interrupted:
            return INTERRUPTED
        if not path.success:
            hint = "the part of the path that was found, a smaller range, or more elements"
            raise NumericalError(Problem("equilibrium --path", path.message, hint))
        return 0

    def _table(self, path: EquilibriumPath, name: str) -> None:
        shown = self.over or (path.largest_column,)
        rows = [
            (item.kind, f"{item.value:.9g}", *(f"{item.columns[column]:.6g}" for column in shown), item.components[0])
            for item in path.critical
        ]
        if rows:
            heading = ("critical point", path.parameter, *shown, "along")
            print_table(f"{name}: critical points", heading, rows, numeric=range(1, 2 + len(shown)))
        ends = [
            (which, f"{path.values[row]:.9g}", *(f"{path.column(column)[row]:.6g}" for column in shown))
            for which, row in (("first", 0), ("last", -1))
        ]
        print_table(f"{name}: path", ("equilibrium", path.parameter, *shown), ends, numeric=range(1, 2 + len(shown)))

    def _buckling(self, loads: BucklingLoads, model: Model, as_json: bool) -> int:
        data = {
            "scene": model.name,
            "parameter": loads.parameter,
            "unit": loads.unit,
            "at": loads.at,
            "values": loads.values.tolist(),
            "reversed": list(loads.reversed),
            "modes": [dict(zip(model.v_names, mode, strict=True)) for mode in loads.modes.T.tolist()],
        }
        if self.out is not None:
            from eomgen.base.files import write_text  # noqa: PLC0415  # for files only

            write_text(Path(self.out), json_text(data) + "\n")
        if as_json:
            print_json(data)
        else:
            rows = [
                (f"{value:.9g}", "reversed" if turned else "", ", ".join(names[:3]))
                for value, turned, names in zip(loads.values.tolist(), loads.reversed, loads.components, strict=True)
            ]
            heading = (f"{loads.parameter}{f', {loads.unit}' if loads.unit else ''}", "load", "largest displacements")
            title = f"{model.name}: linear buckling about {loads.parameter} = {loads.at:.6g}"
            print_table(title, heading, rows, numeric=(0,))
        say(f"{len(loads.values)} buckling loads{_written([Path(self.out)] if self.out else [])}")
        return 0


def _written(files: list[Path]) -> str:
    return f"\nwritten to {', '.join(map(str, files))}" if files else ""


def _range(text: str) -> tuple[str, float, float]:
    name, equals, ends = text.partition("=")
    first, colon, last = ends.partition(":")
    try:
        if not (equals and colon and name.strip()):
            raise ValueError
        return name.strip(), float(first), float(last)
    except ValueError:
        raise UsageError(Problem(f"--path {text}", "a name and two numbers are needed", "--path load=0:10")) from None


def _preload(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name.strip(), float(value) if equals else 0.0
    except ValueError:
        hint = f"--buckling {name}=0"
        raise UsageError(Problem(f"--buckling {text}", f"{value!r} is not a number", hint)) from None
