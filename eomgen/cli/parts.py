"""Parts of the commands of other verbs: options and output that a product adds, by the rows of its verbs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import click

from eomgen.base.products import import_target, insert
from eomgen.base.verbs import own

if TYPE_CHECKING:
    from eomgen.compiled.rest.equilibrium import Equilibrium
    from eomgen.pipeline.model import Model
    from eomgen.results.solution import Solution


class AddedOption(click.Option):
    """Option that a part adds, or gives in place of the command's own, listed directly after another one."""

    def __init__(self, *declarations: str, behind: str, **attributes: Any) -> None:
        self.behind = behind
        super().__init__(declarations, **attributes)


class RestPart:
    """Part of ``eomgen equilibrium``, without options and output.

    Parameters
    ----------
    options : mapping
        Options of the command and of all parts by name.

    Attributes
    ----------
    answers : bool
        Whether ``answer`` replaces the search for an equilibrium.
    files : sequence of paths
        Files that the part writes.
    """

    OPTIONS: ClassVar[tuple[AddedOption, ...]] = ()
    answers = False
    files: Sequence[Path] = ()

    def __init__(self, options: Mapping[str, Any]) -> None:
        pass

    def answer(self, model: Model, arguments: Mapping[str, Any], as_json: bool) -> int:
        """Print and write the requested result, and return the exit code.

        Parameters
        ----------
        arguments : arguments of ``Model.equilibrium`` by name
        """
        raise NotImplementedError

    def draw(self, model: Model, result: Equilibrium, arguments: Mapping[str, Any]) -> None:
        """Draw the files of the part; ``arguments`` as of ``answer``."""

    def data(self, model: Model, result: Equilibrium, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return further entries of the result, as JSON types; ``arguments`` as of ``answer``."""
        return {}

    def show(self, data: Mapping[str, Any]) -> None:
        """Print the entries of the part among all entries of the result."""


class RunPart:
    """Part of ``eomgen simulate``, without options and output.

    Parameters
    ----------
    solution : Solution
    model : Model, optional
        Absent in a copy of the process that draws the figures of a stored solution.
    """

    OPTIONS: ClassVar[tuple[AddedOption, ...]] = ()

    def __init__(self, solution: Solution, model: Model | None = None) -> None:
        pass

    def data(self) -> dict[str, Any]:
        """Return further entries of the summary, as JSON types."""
        return {}

    def rows(self) -> list[tuple[str, str]]:
        """Return further rows of the printed table."""
        return []

    def storage(self, folder: Path) -> AbstractContextManager[str | None]:
        """Give the path of a file in the folder with all that figures need of the model, while figures are drawn."""
        return nullcontext()

    def drawings(self, folder: Path, stored: str | None = None) -> list[Callable[[], list[Path]]]:
        """Return calls that draw figures into the folder; ``stored`` is the path that ``storage`` gave."""
        return []


@cache
def parts_of(verb: str) -> tuple[Any, ...]:
    """Return the classes of the parts that installed products add to the command of a verb of the core."""
    return tuple(import_target(row.parts[verb]) for row in own() if verb in row.parts)


def with_parts(command: click.Command) -> click.Command:
    """Return the command with the options of its parts."""
    added = [option for part in parts_of(str(command.name)) for option in part.OPTIONS]
    params = [option for option in command.params if option.name not in {addition.name for addition in added}]
    command.params = [*insert(params, added, lambda param: param.opts[0], lambda param: getattr(param, "behind", ""))]
    return command
