"""SceneBuilder: a scene from Python calls, with the data and the validation of a scene file."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Any, Self, Unpack

from eomgen.base.calls import checked_call, checked_calls, unknown_attribute
from eomgen.base.messages import key_of, log_notes
from eomgen.errors import Problem
from eomgen.scene.builder_methods import (
    Rotations,  # noqa: F401  # in the types of signatures, which get_type_hints looks for here
    Value,
    describe,
    documentation_of,
    enters,
    signature_of,
)
from eomgen.scene.document.validation import KEYS_ELSEWHERE
from eomgen.scene.load import from_data
from eomgen.scene.scene import GRAVITY, Scene
from eomgen.scene.section import Section
from eomgen.scene.sections import others, own_sections

if TYPE_CHECKING:
    from eomgen.scene.builder_keys import IncludeKeys, SectionMethods, SimulationKeys
else:
    SectionMethods = object

_PACKAGE = __name__.partition(".")[0]


#: Arguments by their names in other tools.
_ELSEWHERE = {name: keys[0] for name, keys in KEYS_ELSEWHERE.items()} | {
    "q0": "initial",
    "damping_ratio": "damping (of joints and springs), or stiffness_damping = 2 ratio / w (of beams, s)",
    "mass_damping": "stiffness_damping (of beams, s): none goes with the mass",
}


def _method(row: Section) -> Callable[..., SceneBuilder]:
    """Return the builder's method for a section: the method adds the entry that the arguments describe, or sets the
    table of a section without named entries, and returns the builder. Signature and docstring follow from the
    schema."""
    signature = signature_of(row)
    keys = {name: field.alias or name for name, field in row.schema.model_fields.items()}

    def enter(self: SceneBuilder, /, *args: Any, **kwargs: Any) -> SceneBuilder:
        values = signature.bind(self, *args, **kwargs).arguments
        return self._enter(row.key, values.get("name"), **{keys[name]: values[name] for name in keys.keys() & values})

    enter.__name__ = row.method_name
    enter.__qualname__ = f"SceneBuilder.{row.method_name}"
    describe(enter, signature, documentation_of(row.method_documentation, row.schema, signature, row.method_name))
    return enter


def _with_sections(kind: type[SceneBuilder]) -> type[SceneBuilder]:
    """Add a method for each section of the register."""
    for row in own_sections():
        setattr(kind, row.method_name, _method(row))
    return kind


@checked_calls(
    'a name, eomgen.SceneBuilder("pendulum")',
    **_ELSEWHERE,
)
@_with_sections
class SceneBuilder(SectionMethods):
    """Collects the entries of a scene; ``build`` checks them all at once.

    Every method returns the builder. Numbers may be formulas, or texts with a unit such as "250 mm", as in a scene
    file; plain numbers are in SI, and keys have the meaning of the scene file's keys.

    Parameters
    ----------
    name : str
        Name of the scene, which prefixes its C functions.
    description : str, optional
        One sentence on the scene, for tables and files.
    gravity : sequence of 3 values
        In world axes, m/s^2.
    terms : sequence of str
        The terms wanted; none means all that are needed.
    coordinates : str
        ``joint``, or ``absolute``: every body moves on its own and joints become constraints.
    task_frames : sequence of str
        Bodies and frames that the terms of frames give; none means all.

    Examples
    --------
    >>> arm = eomgen.SceneBuilder("arm").body("upper", 2.0, center_of_mass=[0, 0, -0.2], inertia=[0.03, 0.03, 0.002])
    >>> arm = arm.body("lower", 1.0, center_of_mass=[0, 0, -0.2], inertia=[0.02, 0.02, 0.001])
    >>> arm = arm.joint("shoulder", "revolute", "base", "upper", axis=[0, -1, 0])
    >>> arm = arm.joint("elbow", "revolute", "upper", "lower", axis=[0, -1, 0], position=[0, 0, -0.4])
    >>> arm = arm.point("mount", "base", position=[0.5, 0, 0]).point("tip", "lower", position=[0, 0, -0.4])
    >>> [joint.name for joint in arm.build().joints]
    ['shoulder', 'elbow']
    """

    def __init__(
        self,
        name: str,
        *,
        description: str = "",
        gravity: Sequence[Value] = GRAVITY,
        terms: Sequence[str] = (),
        coordinates: str = "joint",
        task_frames: Sequence[str] = (),
    ) -> None:
        """Begin a scene without bodies."""
        settings = {
            "name": name,
            "description": description,
            "gravity": gravity,
            "terms": terms,
            "coordinates": coordinates,
            "task_frames": task_frames,
        }
        self._data: dict[str, Any] = {"format": 1, **{key: _plain(value) for key, value in settings.items()}}
        self._lines: dict[str, str] = dict.fromkeys((key for key in settings if key != "description"), _caller())
        self._problems: list[Problem] = []

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            rows = () if name.startswith("_") else others().values()
            row = next((row for row in rows if row.method_name == name), None)
            if row is None:
                raise unknown_attribute(self, name)
            return MethodType(checked_call()(_method(row)), self)

    @enters("include", others=True)
    def include(self, name: str, file: str | Path, **keys: Unpack[IncludeKeys]) -> Self:
        """Put another scene file, or a URDF, into the scene, with names after ``prefix`` and the base on ``parent``.

        ``file`` is a path from the current folder on; ``prefix`` is the name and ``_`` by default. Options of the
        source of the file are keys, too.
        """
        return self._enter("include", name, file=file, **keys)

    @enters("simulation")
    def simulation(self, **keys: Unpack[SimulationKeys]) -> Self:
        """Set the defaults of ``simulate`` (steps and durations in seconds)."""
        return self._enter("simulation", None, **keys)

    def build(self) -> Scene:
        """Return the checked scene.

        Paths of files in entries start from the current folder. Notes of the scene are logged by ``eomgen.notes``.

        Returns
        -------
        Scene
            As ``eomgen.load`` gives it for a file with the same entries.

        Raises
        ------
        DescriptionError
            With everything that is wrong, and the lines of the calls.

        Examples
        --------
        >>> builder = eomgen.SceneBuilder("cart").body("cart", "2 kg")
        >>> builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).build().name
        'cart'
        """
        file = f"scene {key_of(str(self._data['name']))}"
        scene = from_data(self._data, file=file, lines=self._lines, problems=self._problems)
        log_notes(scene.name, scene.notes)
        return scene

    def _enter(self, section: str, name: str | None, /, **values: Any) -> Self:
        """Store an entry of a section with the values that are not None, and the line of the caller; return the
        builder. ``name`` is None for a section that is one table. A name that is already in the section is noted as a
        problem, which ``build`` raises, and the first entry stays."""
        line = _caller()
        key = section if name is None else key_of(section, str(name))
        entry = {field: _plain(value) for field, value in values.items() if value is not None}
        entries = self._data if key == section else self._data.setdefault(section, {})
        entry_name = section if key == section else str(name)
        if entry_name in entries:
            fault = f"this was given before, at {self._lines[key]} [E1410]"
            self._problems.append(Problem(f"{line} ({key})", fault, "another name" if key != section else "one call"))
        else:
            entries[entry_name] = entry
            self._lines[key] = line
        return self


def _caller() -> str:
    """Return ``file:line`` of the call that came from outside the package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__package__")).partition(".")[0] == _PACKAGE:
        frame = frame.f_back
    return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"


def _plain(value: Any) -> Any:
    """Return a value of a builder's argument as in a scene file: arrays and tuples as lists, paths as text, a pair
    (axis, angle) as a table with these keys; lists and tables recursively, other values unchanged."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], list | tuple):
        return {"axis": _plain(value[0]), "angle": _plain(value[1])}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
