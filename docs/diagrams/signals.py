"""Diagrams of numbers, signals, control and events."""

from __future__ import annotations

import math

from docs.diagrams.canvas import BODY, FORCE, FRAME, GREY, INK, MEASURE, Canvas, steps
from docs.diagrams.register import drawing


@drawing("parameters", 130, "Parameters: fixed ones are in the code, tunable ones are arguments of every function")
def parameters(c: Canvas) -> None:
    c.box(16, 22, 130, 34, "radius = 0.1 m", fill=BODY)
    c.box(16, 74, 130, 34, "friction: tunable", fill=BODY)
    c.box(270, 14, 114, 100)
    c.text(327, 36, "compiled C")
    c.text(327, 60, "0.1 in the text", size=12)
    c.text(327, 92, "p: an argument", FORCE, size=12)
    c.arrow((146, 39), (268, 50))
    c.text(206, 34, "fixed", size=12)
    c.arrow((146, 91), (268, 86), FORCE)
    c.text(206, 106, "at every call", FORCE, size=12)


def spline(x: float) -> float:
    return 0.45 + 0.3 * math.sin(12.0 * x) * (1.0 - 0.4 * x) + 0.1 * x


@drawing("curves", 175, "A curve: points, quintic, linear and step interpolation, and values outside")
def curves(c: Canvas) -> None:
    place = c.plot(46, 28, 320, 110, "argument", "value")
    at = [0.08, 0.24, 0.4, 0.56, 0.72, 0.88]
    c.curve(lambda x: place(x, spline(x)), at[0], at[-1], 60, FRAME)
    c.line(*(place(x, spline(x)) for x in at), color=FORCE, width=1.2, dash="5 3")
    c.line(place(at[-1], spline(at[-1])), place(1.0, spline(at[-1])), color=GREY, dash="2 3")
    for x in at:
        c.dot(*place(x, spline(x)))
    c.text(104, 44, "points", anchor="start")
    c.text(214, 40, "quintic", FRAME)
    c.text(136, 122, "linear", FORCE)
    c.text(352, 60, "hold", GREY)
    c.text(200, 168, "curve.road(x), derivative.road(x)".replace("curve.", ""), GREY, size=12)


@drawing("maps", 180, "A map: a grid of values over two arguments and the surface through it")
def maps(c: Canvas) -> None:
    def place(i: float, j: float) -> tuple[float, float]:
        high = 40.0 * math.exp(-((i - 2.2) ** 2 + (j - 1.6) ** 2) / 3.0)
        return 60 + 52 * i + 26 * j, 138 - 22 * j - high

    for i in range(5):
        c.curve(lambda j, i=i: place(i, j), 0.0, 3.0, 30, FRAME, 1.2)
    for j in range(4):
        c.curve(lambda i, j=j: place(i, j), 0.0, 4.0, 40, FRAME, 1.2)
    for i in range(5):
        for j in range(4):
            c.dot(*place(i, j))
    c.arrow((60, 152), (268, 152), GREY, 1.2, 6)
    c.text(166, 170, "x: speed [rad/s]", GREY)
    c.arrow((284, 146), (356, 85), GREY, 1.2, 6)
    c.text(394, 142, "y: voltage", GREY, "end", 12)
    c.text(78, 36, "value: map.motor(x, y)", anchor="start")


@drawing("laws", 130, "A law: a function in C or Python with named arguments and results, and its partials")
def laws(c: Canvas) -> None:
    c.box(140, 22, 130, 76, "tyre.c", "law.tyre", fill=BODY)
    for y, name in ((36, "kappa"), (60, "alpha [rad]"), (84, "load [N]")):
        c.arrow((96, y), (138, y))
        c.text(92, y + 4, name, anchor="end")
    for y, name in ((46, "fx [N]"), (76, "fy [N]")):
        c.arrow((272, y), (314, y), FORCE)
        c.text(318, y + 4, name, FORCE, "start")
    c.text(205, 120, "partials: from its file, by complex steps or differences", GREY, size=12)


@drawing("definitions", 120, "Definitions: named expressions that several formulas share, each evaluated once")
def definitions(c: Canvas) -> None:
    c.box(14, 40, 96, 34, "gap, opening", fill=BODY)
    c.box(150, 40, 84, 34, "contact", fill=BODY)
    c.arrow((110, 57), (148, 57))
    for y, name in ((22, "effort"), (57, "output"), (92, "event")):
        c.box(290, y - 13, 80, 27, name)
        c.arrow((234, 57), (288, y))
    c.text(120, 108, "one value, computed once", GREY, size=12)


@drawing("inputs", 165, "An input: the scene's signal holds unless the caller hands in another one")
def inputs(c: Canvas) -> None:
    c.box(14, 18, 100, 30, "formula(t)", fill=BODY)
    c.box(14, 56, 100, 30, "table, wave", fill=BODY)
    c.box(14, 94, 100, 30, "road", fill=BODY)
    c.circle(160, 71, 13)
    c.text(160, 76, "+")
    for y in (33, 71, 109):
        c.arrow((114, y), (146, 71 + (y - 71) * 0.2))
    c.line((173, 71), (212, 71))
    c.dot(212, 71)
    c.dot(246, 71)
    c.line((246, 71), (214, 60), width=2)
    c.dot(212, 118)
    c.line((130, 138), (212, 138), (212, 118), color=FORCE)
    c.text(124, 158, "caller, FMU, controller", FORCE, "middle", 12)
    c.arrow((246, 71), (306, 71))
    c.text(312, 76, "u(t)", anchor="start")
    c.text(392, 98, "formulas use its name", GREY, "end", 12)


def noise(x: float) -> float:
    """Return a sum of ten modes with fixed phases, as a process is one."""
    return sum(math.sin(3.1 * (k + 1) * x + 1.7 * k * k) / (k + 1.5) for k in range(10))


@drawing("random", 180, "A random process: its covariance, and one realisation from standard normal variables")
def random(c: Canvas) -> None:
    place = c.plot(34, 34, 110, 90, "lag τ [s]", "R(τ)", 0.75)
    c.curve(lambda x: place(x, 0.68 * math.exp(-2.2 * x) * math.cos(8.0 * x)), 0.0, 1.0, 60, FRAME)
    c.arrow((160, 84), (192, 84))
    c.text(176, 74, "z_i")
    line = c.plot(208, 34, 160, 90, "t [s]", "g(t)", 0.5)
    c.curve(lambda x: line(x, 0.3 * noise(x)), 0.0, 0.98, 120, FORCE, 1.6)
    c.text(200, 164, "g(t) = mean + Σ √λ_i φ_i(t) z_i", INK)


def jonswap(ratio: float, peak: float = 3.3) -> float:
    """Return the spectrum of JONSWAP over the frequency in parts of its peak, 1 at the peak."""
    width = 0.07 if ratio <= 1.0 else 0.09
    power = math.exp(-0.5 * ((ratio - 1.0) / width) ** 2)
    return ratio**-5.0 * math.exp(-1.25 * ratio**-4.0) * peak**power / (peak * math.exp(-1.25))


@drawing("waves", 190, "Waves: the spectrum of a sea, and elevation and water velocity at a place")
def waves(c: Canvas) -> None:
    place = c.plot(30, 36, 110, 96, "ω [rad/s]", "S [m² s]")
    c.curve(lambda x: place(x, 0.92 * jonswap(0.45 + 2.2 * x)), 0.02, 1.0, 80, FRAME)
    c.arrow((150, 84), (178, 84))
    c.curve(lambda x: (186 + 196 * x, 72 - 15 * math.sin(11 * x) - 8 * math.cos(19 * x + 1)), 0.0, 1.0, 90, FRAME)
    c.line((186, 72), (382, 72), color=GREY, width=1, dash="4 3")
    c.text(346, 36, "elevation [m]", FRAME, size=12)
    c.arrow((262, 104), (306, 96), FORCE)
    c.text(304, 124, "water velocity [m/s]", FORCE)
    c.ground((382, 152), (186, 152), -8.0)
    c.span((196, 72), (196, 152))
    c.text(204, 144, "depth", MEASURE, "start")
    c.text(120, 182, "components A_j cos(k_j·x - ω_j t + φ_j)", GREY, size=12)


@drawing("states", 150, "An internal state: its rate, an integrator, and the formulas that use it; and a sampled state")
def states(c: Canvas) -> None:
    c.box(18, 30, 96, 40, "f(q, v, z, t, u)", fill=BODY, size=12)
    c.box(160, 30, 46, 40, "∫")
    c.arrow((114, 50), (158, 50))
    c.text(136, 44, "z'")
    c.arrow((206, 50), (250, 50), FORCE)
    c.text(228, 44, "z", FORCE)
    c.line((228, 50), (228, 96), (66, 96), color=GREY)
    c.arrow((66, 96), (66, 72), GREY)
    place = c.plot(276, 24, 100, 80, "t [s]", "sampled")
    corners = steps([0.2, 0.5, 0.85, 0.62, 0.4])
    c.line(*(place(x / 5.2, 0.85 * y) for x, y in corners), color=FORCE, width=2)
    c.text(130, 140, "rate: integrated with the motion", GREY, size=12)


@drawing("controllers", 165, "A PI controller: signal, gains, an integral with tracking of the limits, and output")
def controllers(c: Canvas) -> None:
    c.arrow((14, 60), (60, 60))
    c.text(36, 50, "signal e", size=12)
    c.box(78, 22, 54, 30, "k_p", fill=BODY)
    c.box(78, 82, 54, 30, "k_i ∫", fill=BODY)
    c.line((60, 97), (60, 37))
    c.arrow((60, 37), (76, 37))
    c.arrow((60, 97), (76, 97))
    c.circle(176, 60, 12)
    c.text(176, 65, "+")
    c.arrow((132, 37), (168, 52))
    c.arrow((132, 97), (168, 69))
    c.arrow((188, 60), (232, 60))
    c.box(234, 38, 66, 44)
    c.line((244, 74), (258, 74), (276, 46), (290, 46), color=FORCE, width=2)
    c.text(267, 30, "minimum, maximum", size=12)
    c.arrow((300, 60), (346, 60), FORCE)
    c.text(352, 65, "output", FORCE, "start", 12)
    c.line((322, 60), (322, 136), (105, 136), color=GREY, dash="4 3")
    c.arrow((105, 136), (105, 114), GREY)
    c.text(214, 130, "tracking [s]", GREY, size=12)


@drawing("references", 140, "A reference: inverse dynamics along a motion of its own gives the effort of a servo")
def references(c: Canvas) -> None:
    c.box(12, 34, 104, 52, "reference", "q, v, a", fill=BODY)
    c.box(160, 34, 106, 52, "M a + h + b", "- gravity")
    c.arrow((116, 60), (158, 60))
    c.arrow((266, 60), (330, 60), FORCE)
    c.text(298, 50, "τ [N m]", FORCE)
    c.box(332, 42, 54, 36, "joint", fill=BODY)
    c.line((359, 78), (359, 112), (64, 112), color=GREY)
    c.arrow((64, 112), (64, 88), GREY)
    c.text(210, 106, "q, v of the joint in its formulas", GREY, size=12)
    c.text(213, 22, "tau.elbow(servo)", size=12)


@drawing("outputs", 140, "Outputs: named quantities of one or more components at every recorded row")
def outputs(c: Canvas) -> None:
    for y, name in ((22, "position, velocity"), (52, "formula"), (82, "reaction, section"), (112, "energy [J]")):
        c.box(14, y - 12, 132, 25, name, fill=BODY, size=12)
        c.line((146, y), (176, 66), color=GREY, width=1.2)
    c.arrow((176, 66), (212, 66))
    place = c.plot(232, 22, 136, 92, "t [s]", "tip [m]", 0.55)
    for phase, color in ((0.0, FRAME), (1.6, FORCE), (3.3, MEASURE)):
        c.curve(lambda x, p=phase: place(x, 0.4 * math.exp(-3.0 * x) * math.sin(13 * x + p)), 0.0, 1.0, 70, color, 1.5)


@drawing("modes", 130, "A mode: a number that keeps its value until an event switches it")
def modes(c: Canvas) -> None:
    place = c.plot(46, 24, 310, 74, "t [s]", "mode.gear")
    c.line(*(place(x, y) for x, y in ((0, 0.25), (0.35, 0.25), (0.35, 0.55), (0.7, 0.55), (0.7, 0.85), (0.96, 0.85))),
           color=FRAME, width=2.2)  # fmt: skip
    for x in (0.35, 0.7):
        c.line(place(x, 0.0), place(x, 0.95), color=FORCE, width=1, dash="3 3")
        c.dot(*place(x, 0.0), FORCE)
        c.text(place(x, 0.0)[0], 114, "event", FORCE)


def bounce(t: float) -> float:
    """Return the height of a ball that falls from 1 and bounces with a restitution of 0.75, in units of its fall."""
    start, speed, now = 0.0, 0.0, 1.0
    time = math.sqrt(2.0)
    if t < time:
        return now - 0.5 * t * t
    speed = 0.75 * time
    start = time
    while t > start + 2.0 * speed:
        start += 2.0 * speed
        speed *= 0.75
    return speed * (t - start) - 0.5 * (t - start) ** 2


@drawing("events", 185, "Events: roots of a formula along a run, and their actions")
def events(c: Canvas) -> None:
    place = c.plot(46, 30, 310, 104, "t [s]", "when")
    c.curve(lambda t: place(t / 6.6, 0.9 * bounce(t)), 0.0, 5.7, 160, FRAME)
    first = math.sqrt(2.0)
    roots = [first, first + 1.5 * first, first + 1.5 * first * 1.75]
    for root in roots:
        x, y = place(root / 6.6, 0.0)
        c.circle(x, y, 5, "#fff", FORCE, 2)
    c.arrow((150, 84), (118, 126), FORCE, 1.4, 6)
    c.text(154, 80, "root: the step ends here", FORCE, "start", 12)
    c.text(200, 176, "impact, reset, switch, stop, count or record", GREY, size=12)


@drawing("include", 160, "Include: another scene file as a part, twice, each with a prefix, a parent and a place")
def include(c: Canvas) -> None:
    c.box(14, 56, 104, 44, "suspension.toml", fill=BODY, size=12)
    for y, name in ((30, "front"), (92, "rear")):
        c.box(238, y - 16, 150, 50)
        c.text(313, y + 4, "wheel, spring, damper", size=12)
        c.text(313, y + 24, "parent, position [m]", MEASURE, size=12)
        c.arrow((118, 78), (236, y + 9))
        c.text(170, 46 if y < 60 else 116, f"prefix {name}", size=12)
    c.text(200, 150, "names with a prefix; parameters in place of the file's own", GREY, size=12)


@drawing("repeat", 165, "Repeat: entries made once for all combinations of indices, here a net of knots and springs")
def repeat(c: Canvas) -> None:
    for i in range(3):
        for j in range(3):
            x, y = 150 + 76 * i, 112 - 42 * j
            if i < 2:
                c.spring((x, y), (x + 76, y), 4, 5.0)
            if j < 2:
                c.spring((x, y), (x, y - 42), 3, 5.0)
    for i in range(3):
        for j in range(3):
            c.circle(150 + 76 * i, 112 - 42 * j, 6, BODY)
    c.text(150, 136, "i = 0", size=12)
    c.text(226, 136, "1", size=12)
    c.text(302, 136, "2", size=12)
    for j in range(3):
        c.text(132, 116 - 42 * j, f"j = {j}" if j == 0 else f"{j}", anchor="end", size=12)
    c.text(200, 158, "one entry with indices, nine bodies and twelve springs", GREY, size=12)


@drawing("simulation", 165, "Simulation: steps of the method, recorded rows, duration, and the start")
def simulation(c: Canvas) -> None:
    place = c.plot(46, 34, 310, 84, "t [s]", "q")

    def motion(x: float) -> float:
        return 0.5 + 0.36 * math.exp(-1.4 * x) * math.cos(9.0 * x)

    c.curve(lambda x: place(x, motion(x)), 0.0, 0.95, 80, FRAME)
    for k in range(20):
        x, y = place(0.05 * k, motion(0.05 * k))
        c.line((x, 116), (x, 121), color=GREY, width=1)
        if k % 2 == 0:
            c.dot(x, y, FORCE)
    c.span(place(0.5, -0.16), place(0.55, -0.16), "")
    c.text(place(0.52, 0)[0], 150, "step [s]", MEASURE, size=12)
    c.text(76, 30, "start", anchor="start", size=12)
    c.text(230, 44, "rows: record every second step", FORCE, size=12)
