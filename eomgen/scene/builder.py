"""A scene from Python: the same data as a scene file, entered by calls and checked by the same road."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from eomgen.calls import checked_calls, unknown_attribute
from eomgen.scene.builder_bodies import Bodies
from eomgen.scene.builder_entries import Rotations, Value
from eomgen.scene.builder_forces import Forces
from eomgen.scene.builder_signals import Signals
from eomgen.scene.scene import Scene
from eomgen.text import key_of


@checked_calls('a name, eomgen.SceneBuilder("pendulum")', com="center_of_mass", mass_center="center_of_mass", origin="position")
class SceneBuilder(Bodies, Signals, Forces):
    """Collects the entries of a scene; ``build`` checks them all at once.

    Every method returns the builder. Numbers may be formulas, or texts with a unit such as "250 mm", wherever a scene file takes
    them; plain numbers are in SI, and the meaning of each key is that of the scene file.

    Parameters
    ----------
    name : str
        Name of the scene, which prefixes its C functions.
    description : str
    gravity : sequence of 3 values
        In world axes, m/s^2.
    terms : sequence of str
        The terms wanted; none means all that are needed.
    coordinates : str
        ``joint``, or ``absolute`` where every body moves on its own and joints become constraints.

    Examples
    --------
    >>> builder = SceneBuilder("pendulum").body("link", mass=1.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.01])
    >>> builder.joint("hinge", "revolute", "base", "link", axis=[0, 1, 0]).build().joints[0].name
    'hinge'
    """

    def __init__(
        self,
        name: str,
        *,
        description: str = "",
        gravity: Sequence[Value] = (0.0, 0.0, -9.81),
        terms: Sequence[str] = (),
        coordinates: str = "joint",
    ) -> None:
        super().__init__(name=name, description=description, gravity=gravity, terms=terms, coordinates=coordinates)

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)

    def include(
        self,
        name: str,
        file: str | Path,
        *,
        prefix: str | None = None,
        parent: str = "base",
        position: Sequence[Value] = (0.0, 0.0, 0.0),
        rotation: Rotations | None = None,
        parameters: Mapping[str, Value] | None = None,
        root: str | None = None,
        lock: Sequence[str] | None = None,
        limits: bool | None = None,
    ) -> Self:
        """Put another scene file, or a URDF, into the scene: its names after ``prefix``, its base on ``parent``.

        The path starts in the current folder; ``prefix`` is the name and ``_`` where nothing is said. ``parameters`` go in
        place of those of the file. ``root``, ``lock`` and ``limits`` are for URDF.
        """
        return self._enter(
            "include",
            name,
            file=str(file),
            prefix=prefix,
            parent=parent,
            position=position,
            rotation=rotation,
            parameters=parameters,
            root=root,
            lock=lock,
            limits=limits,
        )

    def simulation(
        self,
        *,
        method: str | None = None,
        step: Value | None = None,
        duration: Value | None = None,
        rho_inf: float | None = None,
        alpha: float | None = None,
        beta: float | None = None,
        gamma: float | None = None,
        tolerance: float | None = None,
        order: int | None = None,
        record_every: int | None = None,
        start: str | None = None,
    ) -> Self:
        """Set what ``simulate`` does when not told otherwise (steps and durations in seconds)."""
        return self._enter(
            "simulation", "", method=method, step=step, duration=duration, rho_inf=rho_inf, alpha=alpha, beta=beta, gamma=gamma,
            tolerance=tolerance, order=order, record_every=record_every, start=start,
        )  # fmt: skip

    def build(self) -> Scene:
        """Return the checked scene.

        Raises
        ------
        DescriptionError
            With everything that is wrong, and the lines of the calls.
        """
        from eomgen.scene.document.assemble import from_data  # noqa: PLC0415 - pydantic is slow to import

        return from_data(self._data, file=f"scene {key_of(str(self._data['name']))}", lines=self._lines, problems=self._problems)
