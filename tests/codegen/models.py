"""Small Systems on hand-made tapes, for tests that need no mechanics."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.tape import Ref, Tape
from eomgen.system import BASE_LAYOUT, Block, Factor, Facts, Function, Quantity, System


def make_system(name: str, tape: Tape, functions: Sequence[Function], **changes: object) -> System:
    """Return a System of two coordinates around the functions of a tape."""
    data: dict[str, object] = {
        "name": name,
        "tape": tape,
        "factors": (Factor("R", "first", 0, 1, 0, 1), Factor("R", "second", 1, 1, 1, 1)),
        "functions": {function.name: function for function in functions},
        "parameters": (Quantity("mass", 2.0, unit="kg"), Quantity("length", 0.5, unit="m", description="of the rod")),
        "inputs": (),
        "outputs": (),
        "bodies": ("first", "second"),
        "initial_q": (0.1, 0.2),
        "initial_v": (0.3, -0.4),
        "dof_parent": (-1, 0),
        "facts": Facts(constant_mass=False, velocity_forces=False, smooth=True, moving_base=False),
    }
    return System(**{**data, **changes})  # type: ignore[arg-type]


def pendulum() -> System:
    """Return a double pendulum of point masses: mass matrix, coupling and energies, with shared sines and cosines."""
    tape = Tape()
    m, length = tape.input("p", 0), tape.input("p", 1)
    q = [tape.input("q", k) for k in range(2)]
    v = [tape.input("v", k) for k in range(2)]
    from eomgen.symbolic.tape import Op

    with tape.block("relative angle of the rods"):
        between = tape.sub(q[0], q[1])
        c, s = tape.call(Op.COS, between), tape.call(Op.SIN, between)
    with tape.block("inertia"):
        inertia = tape.mul(m, tape.mul(length, length))
        off = tape.mul(inertia, c)
        mass = (tape.mul(tape.constant(2.0), inertia), off, off, inertia)
    with tape.block("coupling"):
        h = (tape.mul(tape.mul(inertia, s), tape.mul(v[1], v[1])), -tape.mul(tape.mul(inertia, s), tape.mul(v[0], v[0])))
    functions = [
        Function("mass", "inertia matrix", ("p", "q"), (Block("M", (2, 2), mass),)),
        Function("coupling", "nonlinear inertia terms", ("p", "q", "v"), (Block("h", (2,), h),)),
    ]
    return make_system("pendulum", tape, functions)


def base_size() -> int:
    return sum(size for _, size, _ in BASE_LAYOUT)


def refs_of(tape: Tape, block: str, size: int) -> list[Ref]:
    return [tape.input(block, k) for k in range(size)]
