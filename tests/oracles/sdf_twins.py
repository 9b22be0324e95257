"""URDF files as SDF, element by element and by their own matrices: with frames by name, as of SDF 1.7, with poses
in the frame of the model, as before, and of SDF 1.4 with axes there, too."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from tests.oracles.evaluation import Array

#: Cosine of the pitch below which roll and yaw turn about one axis.
LOCKED = 1e-12
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def sdf_twin(urdf: str, minor: int) -> str:
    """Return a URDF, whose root rests, as a file of SDF 1.``minor``."""
    robot = ElementTree.fromstring(urdf)
    root = ElementTree.Element("sdf", {"version": f"1.{minor}"})
    model = ElementTree.SubElement(root, "model", {"name": robot.get("name", "robot")})
    carriers = {_link(joint, "child"): joint for joint in robot.findall("joint")}
    for link in robot.findall("link"):
        name = link.get("name", "")
        if name == "world":  # the frame at rest of SDF
            continue
        element = ElementTree.SubElement(model, "link", {"name": name})
        if name not in carriers:
            anchor = ElementTree.SubElement(model, "joint", {"name": f"anchor_of_{name}", "type": "fixed"})
            _texts(anchor, {"parent": "world", "child": name})
        elif minor >= 7:
            ElementTree.SubElement(element, "pose", {"relative_to": carriers[name].get("name", "")})
        else:
            matrix = _in_model(name, carriers)
            _texts(element, {"pose": _numbers([*matrix[:3, 3], *_angles(matrix[:3, :3])])})
        _inertial(element, link.find("inertial"))
    for joint in robot.findall("joint"):
        turned = _in_model(_link(joint, "child"), carriers)[:3, :3] if minor < 5 else np.eye(3)
        _joint(model, joint, minor, turned)
    return ElementTree.tostring(root, encoding="unicode")


def _joint(model: ElementTree.Element, joint: ElementTree.Element, minor: int, turned: Array) -> None:
    kind = joint.get("type", "")
    element = ElementTree.SubElement(model, "joint", {"name": joint.get("name", ""), "type": kind})
    _texts(element, {"parent": _link(joint, "parent"), "child": _link(joint, "child")})
    if minor >= 7:
        frame = _link(joint, "parent").replace("world", "__model__")
        pose = ElementTree.SubElement(element, "pose", {"relative_to": frame})
        pose.text = _pose(joint)
    if kind == "fixed":
        return
    axis = ElementTree.SubElement(element, "axis")
    given = joint.find("axis")
    direction = "1 0 0" if given is None else given.get("xyz", "1 0 0")
    _texts(axis, {"xyz": _numbers([*(turned @ [float(word) for word in direction.split()])])})
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        inner = ElementTree.SubElement(axis, "dynamics")
        _texts(inner, {key: dynamics.get(key, "0") for key in ("damping", "friction")})
    limit = joint.find("limit")
    if limit is not None:
        keys = ("effort", "velocity") if kind == "continuous" else ("lower", "upper", "effort", "velocity")
        _texts(ElementTree.SubElement(axis, "limit"), {key: limit.get(key, "0") for key in keys})
    mimic = joint.find("mimic")
    if mimic is not None:
        inner = ElementTree.SubElement(axis, "mimic", {"joint": mimic.get("joint", "")})
        _texts(inner, {"multiplier": mimic.get("multiplier", "1"), "offset": mimic.get("offset", "0")})


def _inertial(link: ElementTree.Element, given: ElementTree.Element | None) -> None:
    element = ElementTree.SubElement(link, "inertial")
    mass, moments, pose = "0", dict.fromkeys(MOMENTS, "0"), "0 0 0 0 0 0"
    if given is not None:
        inertia, weight = given.find("inertia"), given.find("mass")
        mass = "0" if weight is None else weight.get("value", "0")
        moments = {key: "0" if inertia is None else inertia.get(key, "0") for key in MOMENTS}
        pose = _pose(given)
    _texts(element, {"mass": mass, "pose": pose})
    _texts(ElementTree.SubElement(element, "inertia"), moments)


def _pose(element: ElementTree.Element) -> str:
    origin = element.find("origin")
    if origin is None:
        return "0 0 0 0 0 0"
    return f"{origin.get('xyz', '0 0 0')} {origin.get('rpy', '0 0 0')}"


def _in_model(link: str, carriers: dict[str, ElementTree.Element]) -> Array:
    matrix = np.eye(4)
    while link in carriers:
        values = [float(word) for word in _pose(carriers[link]).split()]
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_euler("xyz", values[3:]).as_matrix(), values[:3]
        matrix, link = step @ matrix, _link(carriers[link], "parent")
    return matrix


def _angles(matrix: Array) -> list[float]:
    """Return roll, pitch and yaw of a matrix; at a pitch of a right angle roll takes the part of yaw."""
    across = np.hypot(matrix[0, 0], matrix[1, 0])
    pitch = np.arctan2(-matrix[2, 0], across)
    if across < LOCKED:
        return [np.arctan2(-matrix[1, 2], matrix[1, 1]), pitch, 0.0]
    return [np.arctan2(matrix[2, 1], matrix[2, 2]), pitch, np.arctan2(matrix[1, 0], matrix[0, 0])]


def _link(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _texts(element: ElementTree.Element, texts: dict[str, str]) -> None:
    for tag, text in texts.items():
        ElementTree.SubElement(element, tag).text = text


def _numbers(values: list[float]) -> str:
    return " ".join(f"{value:.17g}" for value in values)
