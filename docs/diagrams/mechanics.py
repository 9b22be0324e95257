"""Diagrams of bodies, joints, beams and loads."""

from __future__ import annotations

import math

from docs.diagrams.canvas import BODY, FORCE, FRAME, GREY, INK, MEASURE, Canvas, around
from docs.diagrams.register import drawing


@drawing("bodies", 205, "A body: its frame at the joint, the centre of mass, and the inertia about the centre of mass")
def bodies(c: Canvas) -> None:
    c.curve(lambda a: (205 + 135 * math.cos(a) + 14 * math.cos(2 * a), 92 + 66 * math.sin(a) - 8 * math.sin(3 * a)),
            0.0, 2 * math.pi, 72, fill=BODY)  # fmt: skip
    c.frame(118, 104, 40)
    c.text(150, 128, "body's frame")
    c.line((118, 104), (216, 74), color=MEASURE, width=1.2, dash="4 3")
    c.text(206, 56, "centre of mass [m]", MEASURE)
    c.circle(216, 74, 7)
    c.line((216, 67), (216, 74), (223, 74), fill=INK)
    c.line((216, 81), (216, 74), (209, 74), fill=INK)
    c.text(234, 78, "mass [kg]", anchor="start")
    c.turn(216, 74, 24, 200, 330)
    c.text(240, 100, "inertia [kg m²]", FORCE, "start")
    c.text(200, 192, "moments and products about the centre of mass, body's axes", GREY, size=12)


@drawing(
    "joints",
    215,
    "A joint: the child's frame in the parent, the axis, and the coordinate q",
)
def joints(c: Canvas) -> None:
    c.ground((20, 178), (66, 178))
    c.link((43, 168), (150, 122), 18)
    c.link((150, 122), (212, 40), 18)
    c.pin(150, 122, 7)
    c.line((150, 122), (262, 74), color=GREY, width=1.2, dash="5 4")
    c.frame(150, 122, 42, 53, ("x", "z"))
    c.text(64, 134, "parent")
    c.text(236, 34, "child", anchor="start")
    c.turn(150, 122, 96, 23, 50, FORCE)
    c.text(246, 66, "q [rad]", FORCE, "start")
    c.text(172, 138, "axis: out of the page", GREY, "start", 12)
    c.span((43, 168), (150, 122), "")
    c.text(104, 168, "position [m]", MEASURE, "start")
    c.text(200, 204, "stiffness, damping, rest, limits, friction, drive act on q", GREY, size=12)


@drawing("constraints", 205, "A constraint: two frames on two bodies that a loop holds together")
def constraints(c: Canvas) -> None:
    c.ground((20, 172), (70, 172))
    c.ground((310, 172), (360, 172))
    c.link((45, 162), (90, 70))
    c.link((90, 70), (262, 52))
    c.link((335, 162), (290, 78))
    for x, y in ((45, 162), (90, 70), (335, 162)):
        c.pin(x, y)
    c.frame(262, 52, 26, 5, ("x", "z"))
    c.frame(290, 78, 26, -60, ("x", "z"), MEASURE)
    c.line((262, 52), (290, 78), color=FORCE, width=1.6, dash="4 3")
    c.text(236, 96, "Φ = 0", FORCE)
    c.text(236, 113, "λ [N]", FORCE)
    c.text(222, 30, "first", FRAME)
    c.text(356, 78, "second", MEASURE)
    c.text(48, 108, "tree", GREY, "end")
    c.text(190, 194, "closes a loop of the tree: equations and multipliers", GREY, size=12)


@drawing("base", 205, "The base: position and rotation in the world over time, and the tree that it carries")
def base(c: Canvas) -> None:
    c.frame(50, 165, 40)
    c.text(58, 192, "world, inertial")
    c.link(around(200, 118, 58, 165), around(200, 118, 58, -15), 16)
    c.frame(200, 118, 36, -15)
    c.text(214, 164, "base")
    c.arrow((50, 165), (196, 119), MEASURE, 1.4)
    c.text(112, 128, "position(t) [m]", MEASURE)
    c.turn(200, 118, 92, -15, 12)
    c.text(390, 92, "rotation(t) [rad]", FORCE, "end", 12)
    c.link((232, 116), (274, 46), 12)
    c.pin(232, 116, 4)
    c.text(294, 44, "tree", anchor="start")


@drawing(
    "springs",
    156,
    "A spring, a damper and an actuator in parallel between two points",
)
def springs(c: Canvas) -> None:
    c.box(14, 40, 60, 70, fill=BODY)
    c.box(326, 40, 60, 70, fill=BODY)
    for x in (96, 304):
        c.line((x, 48), (x, 102))
    c.line((74, 75), (96, 75))
    c.line((304, 75), (326, 75))
    c.spring((96, 48), (304, 48))
    c.damper((96, 76), (304, 76))
    c.line((96, 102), (166, 102))
    c.line((234, 102), (304, 102))
    c.circle(200, 102, 13)
    c.text(200, 106, "f", FORCE)
    c.text(200, 33, "stiffness [N/m], slack at length [m]")
    c.text(146, 69, "damping", anchor="middle", size=12)
    c.text(262, 97, "force [N]", FORCE, size=12)
    c.dot(74, 75)
    c.dot(326, 75)
    c.text(44, 62, "first")
    c.text(356, 62, "second")
    c.span((74, 132), (326, 132), "l", away=16.0)


@drawing("torsion_springs", 165, "A torsion spring between the angles of two joints")
def torsion_springs(c: Canvas) -> None:
    for x, name in ((110, "first"), (290, "second")):
        c.circle(x, 80, 34, BODY)
        c.pin(x, 80)
        c.text(x, 134, name)
    c.line((110, 80), around(110, 80, 44, 60), color=GREY, dash="4 3")
    c.line((290, 80), around(290, 80, 44, 25), color=GREY, dash="4 3")
    c.turn(110, 80, 44, 0, 58)
    c.turn(290, 80, 44, 0, 23)
    c.text(184, 46, "q_1 [rad]", FORCE)
    c.text(344, 84, "q_2", FORCE, "start")
    c.spring((148, 92), (252, 92), 7)
    c.text(200, 118, "stiffness [N m/rad]", size=12)
    c.text(200, 156, "effort on first: -k (q_1 - q_2 - rest) - d (v_1 - v_2)", GREY, size=12)


@drawing("bushings", 190, "A bushing: springs and dampers along and about the axes of the first frame")
def bushings(c: Canvas) -> None:
    c.box(16, 26, 100, 96, fill=BODY)
    c.box(284, 26, 100, 96, fill=BODY)
    c.frame(54, 100, 36)
    c.frame(322, 94, 34, 12, ("x", "z"), MEASURE)
    c.text(66, 44, "first", FRAME)
    c.text(350, 44, "second", MEASURE)
    c.spring((116, 56), (284, 56), 7)
    c.damper((116, 80), (284, 80))
    c.text(200, 42, "along x, y, z [N/m]", size=12)
    c.turn(200, 104, 14, 200, -20)
    c.text(200, 132, "about x, y, z [N m/rad]", FORCE, "middle", 12)
    c.text(200, 152, "e: rotation vector φ [rad], displacement from rest [m]", size=12)
    c.text(200, 176, "force and moment: p - K e - D e'", GREY, size=12)


@drawing("tendons", 190, "A tendon: a path of points that wraps around an obstacle, with one tension along it")
def tendons(c: Canvas) -> None:
    c.circle(200, 110, 42, BODY)
    c.dot(200, 110)
    c.line((200, 110), around(200, 110, 42, -40), color=MEASURE, width=1.2)
    c.text(200, 136, "radius", MEASURE, "middle", 12)
    left, right = around(200, 110, 42, 118), around(200, 110, 42, 62)
    c.line((50, 130), left, color=FORCE, width=2.2)
    c.line(right, (350, 130), color=FORCE, width=2.2)
    c.curve(lambda a: around(200, 110, 42, a), 118, 62, 20, FORCE, 2.2)
    for x, name in ((50, "points[0], after"), (350, "points[1]")):
        c.dot(x, 130)
        c.text(x + (14 if x < 200 else 0), 152, name, size=12)
    c.dot(200, 40, MEASURE)
    c.text(210, 44, "side", MEASURE, "start")
    c.arrow((70, 124), (108, 112), FORCE)
    c.text(72, 104, "tension [N]", FORCE, size=12)
    c.text(200, 180, "length l of the whole path: touching lines and an arc", GREY, size=12)


def law_of_contact(deflection: float, onset: float = 0.25) -> float:
    """Return the force of a tyre by its stiffness, over its deflection: smooth until the onset, then linear."""
    share = min(max(deflection / onset, 0.0), 1.0)
    return max(deflection, 0.0) * share * share * (3.0 - 2.0 * share)


@drawing("tyres", 200, "A tyre: the wheel over the road, its deflection, and the force that never pulls")
def tyres(c: Canvas) -> None:
    c.curve(lambda x: (10 + 180 * x, 148 - 12 * math.exp(-(((x - 0.5) / 0.22) ** 2))), 0.0, 1.0, width=2.2)
    c.circle(100, 82, 58, "none")
    c.dot(100, 82)
    c.text(110, 74, "center", anchor="start")
    c.line((100, 82), around(100, 82, 58, 200), color=MEASURE, width=1.2)
    c.text(72, 82, "radius", MEASURE, "middle", 12)
    c.arrow((100, 136), (100, 94), FORCE)
    c.text(108, 118, "load", FORCE, "start", 12)
    c.text(100, 168, "road(t, x, y) [m]", size=12)
    place = c.plot(235, 40, 130, 100, "d [m]", "force [N]")
    c.curve(lambda d: place(d, law_of_contact(d)), 0.0, 0.95, 60, FORCE)
    c.line(place(0.25, 0.0), place(0.25, 0.25), color=GREY, width=1, dash="3 3")
    c.text(place(0.25, 0)[0], 156, "onset", GREY, size=12)
    c.text(300, 184, "stiffness d + damping d'", GREY, size=12)
    c.text(100, 188, "d: deflection", GREY, size=12)


@drawing("contacts", 190, "A contact: a shape of one body on the surface of another, with gap, normal and slip")
def contacts(c: Canvas) -> None:
    c.curve(lambda x: (20 + 360 * x, 140 - 14 * math.sin(math.pi * x)), 0.0, 1.0, width=2.2)
    c.circle(200, 60, 46, BODY)
    c.dot(200, 60)
    c.text(210, 56, "second", anchor="start")
    c.frame(48, 128, 32, 0, ("x", "z"), FRAME)
    c.text(34, 158, "first", FRAME)
    c.dot(200, 106)
    c.span((262, 106), (262, 126), "gap [m]", "l", away=16.0)
    c.arrow((200, 106), (200, 74), FORCE, 2.2)
    c.text(192, 92, "normal_force", FORCE, "end", 12)
    c.arrow((200, 106), (240, 106), MEASURE)
    c.text(206, 120, "slip", MEASURE, "start", 12)
    c.text(200, 164, "z = surface(x, y), or the plane of x and y", size=12)
    c.text(200, 184, "forces on both bodies: equal and opposite", GREY, size=12)


@drawing("forces", 175, "A force through a point and a torque on a body, in world axes or in body axes")
def forces(c: Canvas) -> None:
    c.link((110, 110), (270, 80), 52)
    c.frame(128, 108, 34, 11)
    c.dot(248, 84)
    c.arrow((248, 84), (308, 34), FORCE, 2.2)
    c.text(316, 32, "force [N]", FORCE, "start")
    c.turn(190, 95, 36, 100, 330)
    c.text(196, 150, "torque [N m]", FORCE)
    c.text(243, 76, "point", MEASURE, "end")
    c.frame(40, 140, 30, 0, ("x", "z"), GREY)
    c.text(86, 166, "axes = world or body", GREY, size=12)


@drawing("distributed_loads", 175, "A distributed load: a force per length along a beam, with a profile")
def distributed_loads(c: Canvas) -> None:
    c.ground((50, 136), (50, 76))
    c.line((50, 100), (350, 100), (350, 112), (50, 112), fill=BODY)
    top = [(50.0 + 300.0 * s, 88.0 - 22.0 * (0.5 + 0.5 * s + 0.6 * s * s)) for s in (k / 12 for k in range(13))]
    c.line(*top, color=FORCE, width=1.8)
    for x, y in top:
        c.arrow((x, y), (x, 98), FORCE, 1.4, 6.0)
    c.text(180, 34, "force [N/m] times profile(s)", FORCE)
    c.span((50, 140), (350, 140), "s from 0 to 1 along the beam", away=18.0)


@drawing("efforts", 150, "An effort: a generalized force on one component of a joint")
def efforts(c: Canvas) -> None:
    c.ground((30, 118), (90, 118))
    c.link((60, 106), (150, 46), 14)
    c.pin(60, 106)
    c.turn(60, 106, 48, -10, 72)
    c.text(116, 112, "effort [N m]", FORCE, "start")
    c.text(150, 28, "q: angle")
    c.ground((240, 118), (380, 118))
    c.box(270, 84, 60, 30, fill=BODY)
    c.arrow((330, 99), (384, 99), FORCE, 2.2)
    c.text(358, 84, "effort [N]", FORCE)
    c.text(286, 70, "q: travel")
    c.text(200, 144, "positive: drives the coordinate up", GREY, size=12)


@drawing("points", 160, "Points: fixed in a body, in the base, or in the world")
def points(c: Canvas) -> None:
    c.ground((30, 128), (110, 128))
    c.link((70, 116), (220, 50), 22)
    c.pin(70, 116)
    c.frame(70, 116, 34, 24)
    c.dot(206, 40)
    c.text(216, 34, "body: moves with it", anchor="start")
    c.span((76, 98), (200, 43), "")
    c.text(118, 58, "position [m]", MEASURE, "end")
    c.dot(130, 140)
    c.text(140, 145, "base: moves with the base", anchor="start")
    c.dot(280, 90, FORCE)
    c.text(290, 95, "world: at rest", FORCE, "start")


@drawing("frames", 155, "A frame: origin and axes fixed in a body, here of a tool")
def frames(c: Canvas) -> None:
    c.link((60, 110), (220, 70), 22)
    c.frame(70, 108, 40, 14)
    c.line((220, 70), (262, 60), width=4)
    c.frame(264, 60, 40, -60, ("x", "z"), FORCE)
    c.text(330, 46, "tool", FORCE, "start")
    c.arrow((76, 108), (258, 62), MEASURE, 1.2)
    c.text(176, 108, "position [m]", MEASURE, "start")
    c.text(200, 146, "rotation: axis and angle [rad] from the body's axes", GREY, size=12)


@drawing("reactions", 165, "A reaction: force and moment that the parent exerts on the child through a joint")
def reactions(c: Canvas) -> None:
    c.ground((40, 30), (40, 100))
    c.link((40, 65), (150, 65), 20)
    c.link((200, 65), (330, 65), 20)
    c.line((150, 65), (200, 65), color=GREY, dash="4 3")
    c.dot(200, 65)
    c.arrow((200, 65), (244, 24), FORCE, 2.2)
    c.text(252, 24, "force [N]", FORCE, "start")
    c.turn(200, 65, 26, 200, 340)
    c.text(200, 112, "moment [N m]", FORCE)
    c.text(96, 50, "parent")
    c.text(300, 50, "child")
    c.text(200, 150, "on the child, about the origin of its frame, world's axes", GREY, size=12)


@drawing("shapes", 150, "Shapes: box, cylinder, sphere, wheel, ellipsoid and mesh")
def shapes(c: Canvas) -> None:
    c.box(18, 50, 48, 40, fill=BODY)
    c.line((66, 50), (78, 40), (30, 40), (18, 50))
    c.line((78, 40), (78, 80), (66, 90))
    c.text(46, 112, "box", size=12)
    c.box(96, 44, 34, 48, fill=BODY)
    c.curve(lambda a: (113 + 17 * math.cos(a), 44 + 6 * math.sin(a)), 0, 2 * math.pi, fill="#fff", width=1.5)
    c.text(113, 112, "cylinder", size=12)
    c.circle(180, 68, 24, BODY)
    c.text(180, 112, "sphere", size=12)
    c.circle(244, 68, 24, "#fff")
    c.circle(244, 68, 14, BODY)
    c.text(244, 112, "wheel", size=12)
    c.curve(lambda a: (308 + 26 * math.cos(a), 68 + 16 * math.sin(a)), 0, 2 * math.pi, fill=BODY, width=1.5)
    c.text(308, 112, "ellipsoid", size=12)
    c.line((350, 88), (362, 48), (388, 66), (376, 92), fill=BODY)
    c.line((350, 88), (388, 66))
    c.line((362, 48), (376, 92))
    c.text(370, 112, "mesh", size=12)
    c.text(200, 140, "for pictures alone: shapes enter no equation", GREY, size=12)


def bent(s: float, size: float = 1.0) -> float:
    """Return the first bending shape of a clamped beam, 1 at its end."""
    k = 1.8751040687119612
    ratio = (math.cos(k) + math.cosh(k)) / (math.sin(k) + math.sinh(k))
    x = k * s
    return size * (math.cosh(x) - math.cos(x) - ratio * (math.sinh(x) - math.sin(x))) / 2.0


@drawing("beams", 190, "A beam by modes: its frame at the joint, deflection by shape functions, and the shortening")
def beams(c: Canvas) -> None:
    c.ground((50, 140), (50, 80))
    c.line((50, 110), (350, 110), color=GREY, width=1.2, dash="5 4")
    c.curve(lambda s: (50 + 300 * s - 8 * bent(s) ** 2, 110 - 58 * bent(s)), 0.0, 1.0, width=6, color=BODY)
    c.curve(lambda s: (50 + 300 * s - 8 * bent(s) ** 2, 110 - 58 * bent(s)), 0.0, 1.0)
    c.frame(50, 110, 40)
    c.span((266, 110), (266, 80))
    c.text(258, 46, "w = Σ f_k(x) q_k [m]", MEASURE, "end")
    c.line((342, 52), (342, 128), color=GREY, width=1, dash="3 3")
    c.line((350, 100), (350, 128), color=GREY, width=1, dash="3 3")
    c.text(350, 146, "shortening", MEASURE)
    c.span((50, 166), (350, 166), "length [m]", away=18.0)


@drawing("exact_beams", 190, "A geometrically exact beam: nodes with frames, elements of constant strain, loads")
def exact_beams(c: Canvas) -> None:
    def place(k: float) -> tuple[float, float]:
        angle, first = math.radians(12 + 20 * k), math.radians(12)
        return 60 + 115 * (math.sin(angle) - math.sin(first)), 158 - 115 * (math.cos(first) - math.cos(angle))

    c.ground((52, 184), (52, 130))
    c.curve(place, 0.0, 4.0, 60, BODY, 9)
    c.curve(place, 0.0, 4.0, 60)
    for k in range(5):
        x, y = place(k)
        c.frame(x, y, 22, 12 + 20 * k, ("", ""))
    c.text(104, 172, "node: frame on SE(3)", FRAME, "start")
    x, y = place(2.5)
    c.text(x + 12, y + 22, "element: strain (d - d_0)/l", INK, "start", 12)
    x, y = place(4.0)
    c.arrow((x, y), (x + 64, y + 6), FORCE, 2.2)
    c.turn(x, y, 26, 180, 320)
    c.text(x + 72, y + 10, "loads [N], [N m]", FORCE, "start", 12)
    c.text(18, 26, "d = log(H_A^{-1} H_B)".replace("^{-1}", "⁻¹"), GREY, "start", 12)


@drawing(
    "absolute_coordinates",
    170,
    "Absolute coordinates: a frame at each centre of mass, and joints as constraints",
)
def absolute_coordinates(c: Canvas) -> None:
    c.frame(40, 140, 32, 0, ("x", "z"), GREY)
    c.text(44, 164, "world", GREY, "start")
    c.link((110, 110), (210, 66), 20)
    c.link((226, 60), (326, 84), 20)
    for x, y, turn in ((160, 88, 24), (276, 72, -13)):
        c.frame(x, y, 32, turn)
    c.line((212, 66), (224, 60), color=FORCE, width=1.8, dash="3 2")
    c.text(218, 40, "joint: Φ = 0", FORCE)
    c.arrow((44, 138), (152, 92), MEASURE, 1.2)
    c.text(74, 96, "pose q_1", MEASURE)
    c.text(306, 122, "quaternion, position [m]", MEASURE, "middle", 12)
    c.text(250, 156, "M is constant and block diagonal", GREY, size=12)


@drawing("hulls", 195, "A hull: slices of a slender part in water, with buoyancy, pressure of waves and drag")
def hulls(c: Canvas) -> None:
    c.curve(lambda x: (20 + 360 * x, 66 - 9 * math.sin(2 * math.pi * (1.6 * x + 0.1))), 0.0, 1.0, 80, FRAME)
    c.text(336, 46, "waves", FRAME)
    c.line((150, 24), (186, 24), (186, 164), (150, 164), fill=BODY)
    for k in range(1, 8):
        c.line((150, 24 + 17.5 * k), (186, 24 + 17.5 * k), color=GREY, width=1)
    c.text(168, 18, "end")
    c.text(168, 181, "start")
    c.span((150, 192 - 4), (186, 188), "")
    c.text(196, 192, "diameter [m]", MEASURE, "start", 12)
    c.arrow((112, 120), (146, 120), FORCE)
    c.text(106, 124, "drag", FORCE, "end")
    c.arrow((168, 154), (168, 118), FORCE, 2.2)
    c.text(194, 138, "buoyancy [N]", FORCE, "start")
    c.arrow((236, 94), (276, 94), FRAME)
    c.text(282, 98, "u_w [m/s], a_w", FRAME, "start")
    c.text(140, 102, "slice", GREY, "end", 12)


@drawing("conventions", 195, "Frames: world, base, parent and child, with quaternions from child axes to parent axes")
def conventions(c: Canvas) -> None:
    frames = ((44, 150, 0, "world", GREY), (136, 110, 8, "base", INK), (226, 76, 22, "parent", FRAME))
    for x, y, turn, name, color in (*frames, (318, 66, 55, "child", FORCE)):
        c.frame(x, y, 34, turn, ("x", "z"), color)
        c.text(x, y + 22, name, color)
    for start, end in (((50, 146), (130, 113)), ((143, 108), (219, 79)), ((233, 76), (311, 67))):
        c.arrow(start, end, MEASURE, 1.2)
    c.arrow((376, 130), (376, 168), INK)
    c.text(366, 152, "g", anchor="end")
    c.text(226, 164, "R(q_{child}): child axes to parent axes", size=12)
    c.text(200, 188, "v of rotations and free joints: body axes, angular first", GREY, size=12)
