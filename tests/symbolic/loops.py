"""Three loops to test with: a chain that carries, a sum over constants, and a mesh that gathers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ZERO, Tape
from tests.symbolic.random_tapes import apply_tamed

LINKS = 6


def chain(tape: Tape, count: int = LINKS) -> Map:
    """Planar pendulum of ``count`` links with relative angles: energies, tip, and the position of every joint."""
    kernel = Tape()
    length, mass = (kernel.input("element", k) for k in range(2))
    gravity = kernel.input("shared", 0)
    angle, rate = (kernel.input("gather", k) for k in range(2))
    theta, omega, x, y, vx, vy = (kernel.input("carry", k) for k in range(6))
    theta, omega = kernel.add(theta, angle), kernel.add(omega, rate)
    sine, cosine = kernel.call(Op.SIN, theta), kernel.call(Op.COS, theta)
    x, y = kernel.add(x, kernel.mul(length, sine)), kernel.sub(y, kernel.mul(length, cosine))
    speed = kernel.mul(length, omega)
    vx, vy = kernel.add(vx, kernel.mul(speed, cosine)), kernel.add(vy, kernel.mul(speed, sine))
    squares = kernel.add(kernel.mul(vx, vx), kernel.mul(vy, vy))
    kinetic = kernel.mul(kernel.mul(kernel.constant(0.5), mass), squares)
    potential = kernel.mul(kernel.mul(mass, gravity), y)
    return Map(
        kernel,
        count,
        (tuple(0.5 + 0.1 * k for k in range(count)), tuple(2.0 - 0.2 * k for k in range(count))),
        (tape.input("p"),),
        (tuple(tape.input("q", k) for k in range(count)), tuple(tape.input("v", k) for k in range(count))),
        (ZERO,) * 6,
        (kinetic, potential),
        (theta, omega, x, y, vx, vy),
        (x, -y),
        "pendulum",
    )


def chain_point(count: int = LINKS):
    rng = np.random.default_rng(3)
    return {"q": rng.normal(size=count), "v": rng.normal(size=count), "p": [9.81]}


def harmonics(tape: Tape, s, count: int = 5) -> Map:
    """sum_i A_i cos(k_i s + phi_i): a road profile."""
    kernel = Tape()
    amplitude, wave_number, phase = (kernel.input("element", k) for k in range(3))
    value = kernel.mul(
        amplitude, kernel.call(Op.COS, kernel.add(kernel.mul(wave_number, kernel.input("shared", 0)), phase))
    )
    columns = ((0.3, 0.2, 0.1, 0.05, 0.02), (1.0, 2.5, 4.0, 7.0, 11.0), (0.1, 1.0, -2.0, 3.0, 0.5))
    return Map(kernel, count, columns, shared=(s,), sums=(value,))


def springs(tape: Tape, count: int = 7) -> Map:
    """Quartic springs between neighbours: energy, and both forces of every spring; shared stiffness."""
    kernel = Tape()
    rest = kernel.input("element", 0)
    stiffness = kernel.input("shared", 0)
    left, right = kernel.input("gather", 0), kernel.input("gather", 1)
    stretch = kernel.sub(kernel.sub(right, left), rest)
    square = kernel.mul(stretch, stretch)
    force = kernel.mul(stiffness, kernel.mul(square, stretch))
    energy = kernel.mul(kernel.mul(kernel.constant(0.25), stiffness), kernel.mul(square, square))
    nodes = [tape.input("q", k) for k in range(count + 1)]
    return Map(
        kernel,
        count,
        (tuple(0.1 * k for k in range(count)),),
        (tape.input("p"),),
        (tuple(nodes[:-1]), tuple(nodes[1:])),
        sums=(energy,),
        stacked=(force, -force),
    )


def springs_point(count: int = 7):
    return {"q": np.random.default_rng(5).normal(size=count + 1), "p": [3.0]}


MODELS = {"chain": (chain, chain_point), "springs": (springs, springs_point)}


def random_loop(tape: Tape, program: Sequence[tuple[Op, int, int, bool]]) -> Map:
    """Three elements of a random kernel: its last results are summed, carried (twice) and stacked (twice)."""
    kernel = Tape()
    refs = [
        kernel.input("element"),
        kernel.input("shared"),
        kernel.input("gather", 0),
        kernel.input("gather", 1),
        kernel.input("carry", 0),
        kernel.input("carry", 1),
    ]
    for op, first, second, negative in program:
        x, y = refs[first % len(refs)], refs[second % len(refs)]
        refs.append(apply_tamed(kernel, op, -x if negative else x, y))
    x = [tape.input("x", k) for k in range(3)]
    product = tape.mul(x[0], x[1])
    gather = ((x[0], -x[1], product), (x[1], x[1], tape.constant(0.4)))
    return Map(
        kernel, 3, ((0.3, -0.7, 1.1),), (x[2],), gather, (product, tape.constant(0.2)), (refs[-1],),
        (refs[-2], -refs[-3]), (refs[-4], refs[-1]),
    )  # fmt: skip  # parts
