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
    Failure(
        "A base that is pulled away at once",
        3,
        "description error: scene.toml:34 (base.position[0]): the rate of the position of the base jumps from 0 to 1"
        " m/s at t = 1.5 s, which takes an impulse that no step gives; try: a law that is smooth there, such as a curve"
        ' with interpolation = "quintic", or a force or an effort instead [E0299]',
        more='[base]\nposition = ["max(0, t - 1.5)", 0, 0]\n',
    ),
    Failure(
        "A curve that there is not",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): unknown function 'track' (column 1); try: one of "
        "profile, abs, acos, asin, atan, atan2, cos, cosh and 10 more [E1534]",
        old='effort = "motor"',
        new='effort = "track(t)"',
        more="[curves.profile]\npoints = [[0, 0], [1, 2]]",
    ),
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
        "A comprehension",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the formula is not well formed at 'x for x in (1,"
        " 2)]' (column 2); try: operators between terms and matching brackets [E1521]",
        old='effort = "motor"',
        new='effort = "[x for x in (1, 2)]"',
    ),
    Failure(
        "A text in a formula",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): a text in quotes is not part of formulas (column 1); "
        "try: names without quotes [E1584]",
        old='effort = "motor"',
        new="effort = \"'motor'\"",
    ),
    Failure(
        "A statement",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the character ';' is not part of formulas (column 6);"
        " try: ASCII letters, digits and + - * / ** ( ) [ ] , . < > [E1585]",
        old='effort = "motor"',
        new='effort = "motor; import os"',
    ),
    Failure(
        "A division by a zero that never changes",
        4,
        old='effort = "motor"',
        new='effort = "motor / (q.shoulder - q.shoulder)"',
    ),
    Failure(
        "A Greek letter that looks like a Latin one",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the character '\\u03bf' (U+03BF GREEK SMALL LETTER "
        "OMICRON) is not part of formulas (column 2); try: ASCII letters, digits and + - * / ** ( ) [ ] , . <"
        " > [E1585]",
        old='effort = "motor"',
        new='effort = "m\u03bftor"',
    ),
    Failure(
        "A minus sign from a word processor",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the character '\\u2212' (U+2212 MINUS SIGN) is not"
        " part of formulas (column 7); try: - [E1585]",
        old='effort = "motor"',
        new='effort = "motor \u2212 1"',
    ),
    Failure(
        "A full-width digit",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the character '\\uff12' (U+FF12 FULLWIDTH DIGIT TWO)"
        " is not part of formulas (column 1); try: ASCII letters, digits and + - * / ** ( ) [ ] , . < > [E1585]",
        old='effort = "motor"',
        new='effort = "\uff12 * motor"',
    ),
    Failure(
        "An invisible character",
        3,
        "description error: scene.toml:28 (efforts.motor.effort): the character '\\u200b' (U+200B ZERO WIDTH SPACE) is "
        "not part of formulas (column 3); try: ASCII letters, digits and + - * / ** ( ) [ ] , . < > [E1585]",
        old='effort = "motor"',
        new='effort = "mo\u200btor"',
    ),
    Failure(
        "A tunable parameter in an axis",
        3,
        "description error: scene.toml:20 (joints.shoulder.axis[1]): the tunable parameter 'load' cannot be used here "
        "(column 1); try: a fixed parameter (tunable = false) [E1556]",
        old="axis = [0, 1, 0]",
        new='axis = [0, "load", 0]',
    ),
    Failure(
        "An input that moves the base",
        3,
        "description error: scene.toml:34 (base.position[0]): the input 'motor' cannot be used here: a motion needs the"
        " derivatives of its law, and derivatives of inputs are not known (column 1); try: motion = true in the"
        " input, whose caller then gives rate and acceleration, too; or a curve at t [E1555]",
        more='[base]\nposition = ["motor", 0, 0]',
    ),
]
