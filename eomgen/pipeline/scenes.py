"""The front end of Scenes: mechanics, with initial assembly, gains and redundant constraint equations."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

from eomgen.base.data import dataclass
from eomgen.base.extensions import code_stamp
from eomgen.base.products import fault_of_absent, rows_of
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.pipeline.front_end import PREPARATIONS, Build, FrontEnd, Preparation, Programs
from eomgen.pipeline.readings import StoredScene
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.base.arrays import Array
    from eomgen.codegen.program import Program
    from eomgen.compiled.model import Gains, Start
    from eomgen.mechanics.initial_coordinates import AbsoluteStartEquations
    from eomgen.scene.control.model import StateFeedback
    from eomgen.scene.scene import Scene
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.description import Description
    from eomgen.system.system import System


def open_document(document: Any) -> Any:
    """Return a document, or the scene of a record."""
    return document.scene if isinstance(document, StoredScene) else document


def _describe(document: Scene | StoredScene) -> Description:
    if isinstance(document, StoredScene):
        return document.description
    from eomgen.mechanics.describe import describe  # noqa: PLC0415  # a stored scene needs no classes of scenes

    for scene, description in _LAST:
        if scene() is document:
            return description
    description = describe(document)
    _LAST[:] = [(weakref.ref(document), description)]
    return description


#: The last scene that was described, and its description: a build asks several times.
_LAST: list[tuple[Callable[[], Scene | None], Description]] = []


def _derive(document: Scene | StoredScene, terms: Sequence[str] | None) -> System:
    from eomgen.mechanics import derive as mechanics  # noqa: PLC0415  # imports SymPy

    scene: Scene = open_document(document)
    if not scene.constraints and (scene.coordinates != "absolute" or _has_no_connections(scene)):
        return mechanics.derive(scene, terms)
    from eomgen.pipeline.initial_assembly import with_initial_assembly  # noqa: PLC0415

    whole = scene.coordinates != "absolute" or len(scene.bodies) <= 30
    derive = partial(mechanics.derive, scene, known=None if whole else {})
    try:
        return with_initial_assembly(derive, terms, _describe(scene), whole=whole, light=scene.light)
    except ModelError as error:
        raise _with_numbers(error, scene) from None


#: Codes of the notes on units, and of rows that have no derivative.
_ON_UNITS, _NO_DERIVATIVE = frozenset({"W0027", "W0106", "W0118", "W0119", "W0120", "W0121"}), "E2083"


def _with_numbers(error: ModelError, scene: Scene) -> ModelError:
    """Return a ModelError of constraints with the place in the file of the first named one, which is the farthest from
    being met, with lengths and curves of the named ones, and with doubts on units."""
    from eomgen.scene.joints.constraint_numbers import numbers_of_constraints  # noqa: PLC0415  # of few scenes

    doubts = [note.partition("; ")[0] for note in scene.notes if getattr(note, "code", "") in _ON_UNITS]
    first, *rest = error.problems
    listed = cast("Sequence[str]", first.data.get("constraints", ()))
    named = [
        item
        for item in scene.constraints
        if item.name in listed and not any(doubt.startswith(f"constraints.{item.name}.") for doubt in doubts)
    ]
    defined = first.code != _NO_DERIVATIVE
    values = {item.name: item.value for item in scene.parameters} if defined else None
    said = numbers_of_constraints(named, values)
    keys = {item.name: f"joints.{item.name}" for item in scene.joints}
    keys |= {item.name: f"constraints.{item.name}" for item in scene.constraints}
    in_file = (key for name in listed if (key := keys.get(name, "")) in scene.source)
    location = next((f"{scene.source[key]} ({key})" for key in in_file), first.where)
    hint = first.hint + ("; numbers without a unit are in m and in rad" if defined and (said or doubts) else "")
    clauses = [first.what, *said, *(f"in doubt is {doubt}" for doubt in doubts)]
    return ModelError([Problem(location, "; ".join(clauses), hint, first.code), *rest])


def _has_no_connections(scene: Scene) -> bool:
    """Return whether no joint or beam of a scene is a constraint in absolute coordinates."""
    from eomgen.scene.forces.cosserat_beams import CosseratBeam  # noqa: PLC0415  # a stored scene needs no classes of scenes

    free = all(not joint.kind.moves or joint.kind.rows == (0, 0) for joint in scene.joints)
    return free and not any(isinstance(element, CosseratBeam) for element in scene.elements)


def _calibration(asking: StateFeedback) -> Preparation:
    """Return the product's row that calibrates the gains of a controller. Raises UsageError if not installed."""
    rows: tuple[Preparation, ...] = rows_of(PREPARATIONS, Preparation)
    if not rows and (absent := fault_of_absent("calibration")):
        raise UsageError(Problem(f"controllers.{asking.name}.calibration", *absent))
    return next(row for row in rows if row.name == "calibration")


def _prepare(document: Scene | StoredScene, build: Build) -> Scene:
    """Return the scene; if a controller asks for calibration, with the values that models made by ``build`` give."""
    scene: Scene = open_document(document)
    asking = next((item for item in scene.feedback if item.calibration), None)
    return scene if asking is None else _calibration(asking).prepared(scene, build)


def _gains(scene: Scene | StoredScene, build: Build) -> Gains | None:
    if isinstance(scene, StoredScene):
        return None
    asking = next((item for item in scene.feedback if item.calibration), None)
    return None if asking is None else lambda parameters: _calibration(asking).values(scene, parameters, build)[0]


@dataclass(frozen=True)
class AbsoluteStart:
    """The initial q and v of a scene in absolute coordinates as a function of tunable parameters, from the joints."""

    scene: Scene

    def __call__(self, parameters: Mapping[str, float]) -> tuple[Sequence[float], Sequence[float]]:
        """Return q and v."""
        return self._equations.at(parameters)

    def slopes(self, parameters: Mapping[str, float], names: Sequence[str]) -> tuple[Array, Array] | None:
        """Return the partials of q (left-trivialised) and v in parameters, (nv, names) each; None if there are none
        here."""
        return self._equations.slopes(parameters, names)

    @cached_property
    def _equations(self) -> AbsoluteStartEquations:
        from eomgen.mechanics.initial_coordinates import AbsoluteStartEquations  # noqa: PLC0415  # imports SymPy

        return AbsoluteStartEquations(self.scene)


def _start(scene: Scene | StoredScene) -> Start | None:
    if isinstance(scene, StoredScene):
        return None
    return AbsoluteStart(scene) if scene.coordinates == "absolute" else None


def _every_row(scene: Scene | StoredScene) -> EveryRow:
    from eomgen.mechanics import derive as mechanics  # noqa: PLC0415  # imports SymPy
    from eomgen.pipeline.initial_assembly import constraint_equations  # noqa: PLC0415

    return partial(constraint_equations, mechanics.derive(open_document(scene), PURPOSES["initial_assembly"], ()))


def _content(scene: Scene | StoredScene) -> bytes:
    """Return the bytes that decide a scene's equations: its digest, and the code of parts from other distributions."""
    if isinstance(scene, StoredScene):  # all classes of the scene are eomgen's
        return scene.content
    kinds = dict.fromkeys(type(element) for element in scene.elements)
    stamps = {code_stamp(kind, kind.law, kind.added_masses) for kind in kinds} - {""}
    stamps |= {repr(joint.kind) for joint in scene.joints if joint.has_extension_type}
    return scene.digest and scene.digest + "".join(sorted(stamps)).encode()


def _program(scene: Scene, derived: Programs) -> tuple[Program, str] | None:
    """Return the Program of a scene with many equal elements or rows, continued from scenes with few, and a refusal.
    None for other scenes. ``derived`` derives a shorter scene."""
    if len(scene.bodies) < 30:  # with the nodes of exact beams
        return None
    from eomgen.pipeline.equal_elements import equal_elements  # noqa: PLC0415  # a stored scene has none
    from eomgen.pipeline.equal_rows import equal_rows  # noqa: PLC0415  # likewise

    alike = equal_elements(scene) or equal_rows(scene)
    return None if alike is None else alike.program(derived)


SCENES = FrontEnd(
    "mechanics", StoredScene, _describe, _derive, _prepare, _start, _gains, _every_row, _content, _program
)
