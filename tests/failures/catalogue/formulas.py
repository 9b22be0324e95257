"""Failure catalogue: formulas."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("A name that there is not", 3, old='effort = "motor"', new='effort = "motr + 1"'),
    Failure("A joint in the place of its coordinate", 3, old='effort = "motor"', new='effort = "-5 * shoulder"'),
    Failure("A component that there is not", 3, old='effort = "motor"', new='effort = "q.shoulder[1]"'),
    Failure("A vector in the place of a number", 3, old='effort = "motor"', new='effort = "position.tip"'),
    Failure("An acceleration in a force", 3, old='effort = "motor"', new='effort = "-0.1 * a.shoulder"'),
    Failure("A function that there is not", 3, old='effort = "motor"', new='effort = "sine(t)"'),
    Failure("A number as NumPy writes it", 3, old='effort = "motor"', new='effort = "np.float64(0.3) * motor"'),
    Failure("A base that jumps", 3, more='[base]\nposition = [0, 0, "0.1 if t > 2 else 0"]\n'),
    Failure("A function with too many arguments", 3, old='effort = "motor"', new='effort = "sin(t, 2)"'),
    Failure("A formula cut short", 3, old='effort = "motor"', new='effort = "2 * (motor + "'),
    Failure("A caret for a power", 3, old='effort = "motor"', new='effort = "motor ^ 2"'),
    Failure("An implied product", 3, old='effort = "motor"', new='effort = "2 motor"'),
    Failure("A huge constant power", 3, old='effort = "motor"', new='effort = "motor ** 100"'),
    Failure(
        "A formula of too many levels",
        3,
        old='effort = "motor"',
        new='effort = "' + 60 * "(" + "motor" + 60 * ")" + '"',
    ),
    Failure(
        "A formula of too many characters", 3, old='effort = "motor"', new='effort = "motor' + 400 * " + motor" + '"'
    ),
    Failure("An import", 3, old='effort = "motor"', new="effort = \"__import__('os').system('rm -rf ~')\""),
    Failure("An attribute of Python", 3, old='effort = "motor"', new='effort = "motor.__class__"'),
    Failure("A lambda", 3, old='effort = "motor"', new='effort = "(lambda: 1)()"'),
    Failure(
        "A division by a zero that never changes",
        4,
        old='effort = "motor"',
        new='effort = "motor / (q.shoulder - q.shoulder)"',
    ),
]
