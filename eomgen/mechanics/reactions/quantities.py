"""Reactions as formulas call them: about a point and in the axes of a body, each recorded at its first use."""

from __future__ import annotations

from collections.abc import Callable, Collection

from eomgen.errors import ModelError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.reactions.transmitted import Transmitted, TransmittedWrenches
from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.scene.joints.constraint_model import Constraint, Reaction
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, minus, plus, transpose
from eomgen.system.description import WORLD


class Reactions:
    """Components of reactions, and efforts of drives.

    Parameters
    ----------
    wrenches : returns wrenches transmitted by joints and constraints, given the requested fixed joints, at the first
        reaction that is asked for
    """

    def __init__(self, scene: Scene, wrenches: Callable[[Collection[str]], TransmittedWrenches]) -> None:
        self.scene = scene
        self._made = wrenches
        self._wrenches: TransmittedWrenches | None = None
        self._found: dict[str, tuple[Scalar, ...]] = {}

    @property
    def wrenches(self) -> TransmittedWrenches:
        if self._wrenches is None:
            self._wrenches = self._made(self._fixed_joints())
        return self._wrenches

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return a component of a reaction, moment first, or the effort of a drive.

        Raises
        ------
        ModelError
            No joint or constraint of that name has a drive.
        """
        if symbol.kind == "drive_effort":
            return self._drive_effort(symbol.name, symbol.index)
        if symbol.name not in self._found:
            item = self._named(symbol.name)
            with self.wrenches.tree.algebra.tape.block(f"reaction {symbol.name}"):
                self._found[symbol.name] = self._components(item)
        return self._found[symbol.name][symbol.index]

    def _fixed_joints(self) -> list[str]:
        """Return the fixed joints with reactions in the scene's outputs and events."""
        formulas = [*(value for output in self.scene.outputs for value in output.values)]
        formulas += [formula for event in self.scene.events for formula in (event.when, *event.actions())]
        of = {self._named(item.name).of for formula in formulas for item in symbols(formula) if item.kind == "reaction"}
        return [joint.name for joint in self.scene.joints if joint.name in of and not joint.kind.moves]

    def _named(self, name: str) -> Reaction:
        placed = {item.name: item for item in self.scene.reactions}
        if name in placed:
            return placed[name]
        if any(joint.name == name for joint in self.scene.joints):
            return Reaction(name, "joints", name)
        return Reaction(name, "constraints", name)

    def _drive_effort(self, name: str, index: int) -> Scalar:
        driven: list[Joint | Constraint] = [joint for joint in self.scene.joints if joint.drive]
        driven += [item for item in self.scene.constraints if item.prescribed is not None]
        item = next((item for item in driven if item.name == name), None)
        if item is None:
            raise ModelError(
                f"no joint or constraint {name} has a drive, so there is no drive_effort", "drive = a formula of time"
            )
        return self.wrenches.drive_effort(item, index)

    def _components(self, item: Reaction) -> tuple[Scalar, ...]:
        if item.section == "joints":
            load = self.wrenches.joint(item.of)
        else:
            load = self.wrenches.constraint(next(entry for entry in self.scene.constraints if entry.name == item.of))
        if item.point is not None:
            load = self._moved(load, item)
        turn = self._to_axes(load.link, item.axes)
        return (*turn(load.moment), *turn(load.force))

    def _moved(self, load: Transmitted, item: Reaction) -> Transmitted:
        """Return a wrench about the point of a reaction.

        The lever is taken in the axes of a link that the wrench passes on its way to the base, if such a link
        holds the point, so that no digits cancel far from the origin.
        """
        quantities, tree = self.wrenches.quantities, self.wrenches.tree
        kinematics, point = quantities.kinematics, item.point
        assert point is not None  # asked for by the caller
        link, s = kinematics.local(*quantities.at(point))
        near = load
        while near.link != link and near.link >= 0:
            near = _on_parent(tree, near)
        if near.link == link:
            lever = minus(s, near.at)
        else:
            near = load
            R, p = kinematics.pose(load.link)
            place = kinematics.position_in_base(*quantities.at(point))
            lever = apply(transpose(R), minus(place, plus(p, apply(R, load.at))))
        return Transmitted(near.link, plus(near.at, lever), minus(near.moment, cross(lever, near.force)), near.force)

    def _to_axes(self, link: int, axes: str) -> Callable[[Vector], Vector]:
        """Return the rotation of vectors from a link's axes to the axes of a body, of the base or of the world."""
        tree, kinematics = self.wrenches.tree, self.wrenches.quantities.kinematics
        mount = None if axes == WORLD else tree.mounts[axes]
        target = ROOT if mount is None else mount.link

        def turned(x: Vector) -> Vector:
            at = link
            while at != target and at >= 0:
                x, at = tree.links[at].rotation.rotate(x), tree.links[at].parent
            if at != target:
                x = x if at == ROOT else apply(kinematics.pose(at)[0], x)
                x = x if target == ROOT else apply(transpose(kinematics.pose(target)[0]), x)
            if mount is None:
                return apply(kinematics.base.orientation, x)
            return apply(transpose(mount.orientation), x)

        return turned


def _on_parent(tree: Tree, load: Transmitted) -> Transmitted:
    """Return the same wrench, about the same place, in the axes of the parent link."""
    link = tree.links[load.link]
    turn = link.rotation.rotate
    return Transmitted(link.parent, plus(link.position, turn(load.at)), turn(load.moment), turn(load.force))
