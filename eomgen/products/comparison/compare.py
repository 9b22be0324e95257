"""``compare``: two descriptions of one machine, or one description and the reading of another program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from eomgen.base.arrays import count_of
from eomgen.base.calls import checked_call
from eomgen.base.data import replace
from eomgen.base.messages import shown
from eomgen.errors import Message, Problem, UsageError
from eomgen.pipeline import documents, pipeline
from eomgen.products.comparison.differences import Pairing, differences, equal, of_solids
from eomgen.products.comparison.machine import Machine, of_equations, of_scene
from eomgen.products.comparison.report import Comparison, Difference
from eomgen.products.comparison.states import errors_of, motions
from eomgen.scene.sources.register import checked_options, source_of

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described

#: Options of sources that take all that a file describes.
_ALL = ("limits", "friction")
_TERMS = ("mass", "coupling", "force", "base_motion")


@checked_call('eomgen.compare("robot.urdf", "robot.xml")')
def compare(
    first: Described,
    second: Described | None = None,
    *,
    reader: Literal["mujoco", "pinocchio"] | None = None,
    tolerance: float = 1e-5,
    states: int = 10,
    seed: int = 1,
    strict: bool = False,
    **options: Any,
) -> Comparison:
    """Compare two descriptions of one machine: masses, places, joints, forces, and equations at random states.

    Joints are matched by their names, else by a body of the same name that both move; bodies by names. Quantities of
    bodies are compared in the frames of the first description, whichever frames the second has; bodies that fixed
    joints hold count as parts of the carrying bodies, and bodies fixed to the base are left out. Limits and dry
    friction of URDF, MJCF and SDF are read unless the options of these names are false, and with a ``reader`` if these
    are true. Equations are compared if all joints have partners of the same types. No compiler is needed.

    Parameters
    ----------
    first, second : path, Scene, or mapping
        As in ``load``, read in joint coordinates; ``second`` may be left out with a ``reader``, which then reads
        ``first``, and may be the result of ``from_sympy``, of which the equations at random states are compared:
        coordinates are named as the joints, or ``q_JOINT``.
    reader : str, optional
        Program that reads the second description, which then is a file: ``mujoco`` or ``pinocchio``. Bodies, joints and
        the equations are compared, force elements, constraints, limits and friction are not.
    tolerance : float
        Largest relative difference that counts as none; of positions relative to the largest distance between joints
        or centres of mass, of axes relative to 1.
    states : int
        Number of random states at which mass matrix, bias and forces are compared; with a ``reader`` or equations of
        SymPy the mass matrix, and the sum of bias and forces.
    seed : int
        Of the random states.
    strict : bool
        Refuse elements that an importer would leave out with a note.
    **options
        For files of other formats, as in ``load``: each goes to the descriptions whose format has it; with a
        ``reader`` to the first alone.

    Returns
    -------
    Comparison
        With the ``differences``, the first of which usually explains the rest, and ``equal``. Other names, initial
        positions, and parts without an effect are in ``notes`` alone.

    Raises
    ------
    FileError, DescriptionError, ModelError, UsageError
        UsageError also if the package of the ``reader`` is not installed, for a Scene in absolute coordinates, if
        ``first`` is a result of ``from_sympy``, for a tolerance that is not above 0, and for an option that neither
        description has.

    Examples
    --------
    >>> scene = eomgen.load("examples/robot_arm/scene.toml")
    >>> eomgen.compare(scene, "examples/robot_arm/scene.toml").equal
    True
    """
    count_of("states", states)
    count_of("seed", seed, 0)
    if not tolerance > 0.0:
        fault = f"{tolerance} would call rounding a difference [E0561]"
        raise UsageError(Problem("tolerance", fault, "tolerance=1e-9"))
    if second is None and reader is None:
        fault = "one description has no second one to be compared with [E0562]"
        raise UsageError(Problem("second", fault, 'a second one, or reader="mujoco" (--with mujoco)'))
    second_description = first if second is None else second
    _check_options([first, second_description] if reader is None else [first], options)
    if _equations_alone(first):
        fault = "equations alone have no bodies [E0563]"
        raise UsageError(Problem("first", fault, "the description with bodies as the first"))
    reading_options = {"strict": strict, **options}
    first_machine = _read(first, reading_options, alone=reader is None)
    if reader is not None:
        second_machine = _second_reader(second_description, reader)
    elif _equations_alone(second_description):
        derived = pipeline.derive(second_description, _TERMS[:3])
        document, front_end = documents.as_document(second_description)
        solids = front_end.describe(document).drawing.solids
        second_machine = replace(
            of_equations(derived.name, derived, first_machine.links, solids),
            gravity=first_machine.gravity,
            loops=first_machine.loops,
        )
    else:
        second_machine = _read(second_description, reading_options, alone=True)
    pairing = Pairing(first_machine, second_machine, tolerance)
    listed = differences(pairing)
    notes = [*dict.fromkeys((*first_machine.notes, *second_machine.notes))]
    errors: Mapping[str, float] = {}
    if pairing.comparable:
        mine, theirs = motions(pairing, states, np.random.default_rng(seed))
        errors, worst = errors_of(pairing, first_machine.forces(mine), second_machine.forces(theirs))
        forces_equal = all(errors[name] <= tolerance for name in errors if name != "mass matrix")
        parts, more = _parts(pairing, forces_equal=forces_equal)
        listed, notes = listed + parts, notes + more
        if errors.get("mass matrix", 0.0) > tolerance:
            listed += of_solids(pairing)
        unexplained = [item for item in worst if errors[item.quantity] > tolerance]
        listed += unexplained[: 0 if listed else 1]
    elif listed:
        notes.append("equations were not compared: the coordinates of the descriptions differ [W0048]")
    notes += _notes_on_names(pairing)
    only = sorted(set(first_machine.inputs) ^ set(second_machine.inputs))
    if only and reader is None:
        notes.append(f"inputs of one description alone are zero: {', '.join(only)} [W0049]")
    names = first_machine.name, second_machine.name
    return Comparison(names, tuple(listed), errors, states, len(pairing.pairs), tolerance, tuple(map(Message, notes)))


def _equations_alone(described: object) -> bool:
    """Return whether a description is the document of a front end besides scenes, as of SymPy."""
    return hasattr(described, "front_end")


def _check_options(described: Sequence[Described], options: Mapping[str, Any]) -> None:
    """Raise UsageError for an option of reading that no description has."""
    sources = [source_of(Path(item)) for item in described if isinstance(item, str | Path)]
    known = {option.name for source in sources if source is not None for option in source.options}
    unknown = {name: value for name, value in options.items() if name not in known}
    checked_options(next(iter(sources), None), unknown)


def _read(described: Described, caller_options: Mapping[str, Any], *, alone: bool) -> Machine:
    """Return the machine of a description; ``caller_options`` are options of all descriptions. With ``alone``,
    limits and friction, which other programs do not give, are read unless the caller's options refuse them."""
    options: dict[str, Any] = {}
    if isinstance(described, str | Path):
        source = source_of(Path(described))
        names = {option.name for option in source.options} if source is not None else set()
        options = {name: True for name in _ALL if alone and name in names}
        options |= {name: value for name, value in caller_options.items() if name in names}
        options["strict"] = caller_options["strict"]
    scene = documents.load_scene(described, coordinates="joint", **options)
    terms = [name for name in _TERMS if name != "base_motion" or scene.base is not None]
    file = Path(described).name if isinstance(described, str | Path) else ""
    return of_scene(scene, pipeline.derive(scene, terms), file)


def _second_reader(described: Described, reader: str) -> Machine:
    """Return the machine of a file as MuJoCo or Pinocchio reads it. Raises UsageError for an object that is not a path,
    or an unknown reader."""
    if not isinstance(described, str | Path):
        fault = f"{reader} reads files, not {type(described).__name__} objects [E0564]"
        raise UsageError(Problem("second", fault, "a path"))
    from eomgen.products.comparison.other_readers import READERS  # noqa: PLC0415  # optional packages

    if reader not in READERS:
        raise UsageError(Problem("reader", f"there is no reader {shown(reader)} [E0565]", " or ".join(READERS)))
    return READERS[reader](Path(described))


def _parts(pairing: Pairing, *, forces_equal: bool) -> tuple[list[Difference], list[str]]:
    """Return differences of force elements, states, controllers and base motion, and notes on parts of one description
    without an effect. ``forces_equal`` is whether forces agree at random states: then parts in frames that differ are
    not compared."""
    first, second = pairing.first, pairing.second
    listed: list[Difference] = []
    notes: list[str] = []
    if first.parts is None or second.parts is None:
        return listed, notes
    for name in dict.fromkeys((*first.parts, *second.parts)):
        mine, theirs = first.parts.get(name), second.parts.get(name)
        if mine is None or theirs is None:
            if name.startswith("points."):  # of an element that only one description has
                continue
            if forces_equal:
                notes.append(f"{name} is in one description alone, without an effect at zero inputs [W0050]")
            else:
                present = name.partition(".")[0].removesuffix("s").replace("_", " ")
                listed.append(pairing.alone(name, "element", present, second=mine is None))
        elif pairing.same_frames or not forces_equal:
            listed += _differences_of_part(pairing, name, mine, theirs)
    return listed, notes


def _notes_on_names(pairing: Pairing) -> list[str]:
    """Return notes on paired joints with different names or initial positions, which change no equation."""
    result = []
    for i, j in pairing.pairs:
        first_joint, second_joint = pairing.first.links[i].joint, pairing.second.links[j].joint
        if first_joint != second_joint:
            result.append(f"the joint {first_joint} is {second_joint} in the second")
        begun = pairing.first.initial.get(first_joint, 0.0), pairing.second.initial.get(second_joint, 0.0)
        if not equal(*begun, pairing.tolerance):
            result.append(f"the joint {first_joint} starts at {begun[0]:.6g} and {begun[1]:.6g}")
    return result


def _differences_of_part(
    pairing: Pairing, name: str, mine: Mapping[str, float | str], theirs: Mapping[str, float | str]
) -> list[Difference]:
    """Return differences of a part that both descriptions have. A quantity of one alone is a difference, too."""
    result = []
    for key in dict.fromkeys((*mine, *theirs)):
        if not (key in mine and key in theirs and equal(mine[key], theirs[key], pairing.tolerance)):
            result.append(pairing.difference((name, name), key, mine.get(key), theirs.get(key)))
    return result
