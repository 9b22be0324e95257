"""Failure catalogue: names."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("C that ends a comment", 3, old='name = "arm"', new='name = "arm */ int main(void) { abort(); } /*"'),
    Failure(
        "A preprocessor's line",
        3,
        "description error: scene.toml:2 (name): the name '#include <evil.h>' is not legal; try: up to 64 ASCII"
        " letters, digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "#include <evil.h>"',
    ),
    Failure(
        "A template's tag",
        3,
        "description error: scene.toml:2 (name): the name '{{ 7 * 7 }}' is not legal; try: up to 64 ASCII letters, "
        "digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "{{ 7 * 7 }}"',
    ),
    Failure(
        "A template's statement",
        3,
        "description error: scene.toml:2 (name): the name \"{% include '/etc/passwd' %}\" is not legal; try: up to 64 "
        "ASCII letters, digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new="name = \"{% include '/etc/passwd' %}\"",
    ),
    Failure(
        "A command of the shell",
        3,
        "description error: scene.toml:2 (name): the name 'arm; rm -rf ~' is not legal; try: up to 64 ASCII letters, "
        "digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "arm; rm -rf ~"',
    ),
    Failure(
        "A path",
        3,
        "description error: scene.toml:2 (name): the name '../../etc/passwd' is not legal; try: up to 64 ASCII letters,"
        " digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "../../etc/passwd"',
    ),
    Failure(
        "A letter that C does not know",
        3,
        "description error: scene.toml:2 (name): the name '\\xe4rm' is not legal; try: up to 64 ASCII letters, digits"
        " and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "\xe4rm"',
    ),
    Failure(
        "A text that turns the line around",
        3,
        "description error: scene.toml:2 (name): the name 'arm\\u202e' is not legal; try: up to 64 ASCII letters,"
        " digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "arm\\u202e"',
    ),
    Failure(
        "A terminal's escape",
        3,
        "description error: scene.toml:2 (name): the name 'arm\\x1b[31m' is not legal; try: up to 64 ASCII letters, "
        "digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "arm\\u001b[31m"',
    ),
    Failure(
        "An empty name",
        3,
        "description error: scene.toml:2 (name): the name '' is not legal; try: up to 64 ASCII letters, digits and "
        "underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = ""',
    ),
    Failure(
        "A name of 65 letters",
        3,
        "description error: scene.toml:2 (name): the name 'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa...' is not "
        "legal; try: up to 64 ASCII letters, digits and underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "' + 65 * "a" + '"',
    ),
    Failure(
        "A digit first",
        3,
        "description error: scene.toml:2 (name): the name '2arm' is not legal; try: up to 64 ASCII letters, digits and "
        "underscores, no digit first [E0715]",
        old='name = "arm"',
        new='name = "2arm"',
    ),
    Failure("A body called base", 3, more="[bodies.base]\nmass = 1.0"),
    Failure("A parameter called like the time", 3, old="length = { value = 0.5", new="t = 1.0\nlength = { value = 0.5"),
    Failure(
        "A parameter called like a function",
        3,
        "description error: scene.toml:5 (parameters.sin): the name sin is a word of formulas; try: sin_value [E0729]",
        old="length = { value = 0.5",
        new="sin = 1.0\nlength = { value = 0.5",
    ),
    Failure(
        "A parameter and an input of one name",
        3,
        old="length = { value = 0.5",
        new="motor = 1.0\nlength = { value = 0.5",
    ),
    Failure(
        "A name in quotes with a blank",
        3,
        "description error: 2 problems\n  1. scene.toml:22 (points.'the tip'): the name 'the tip' is not legal; try: up"
        " to 64 ASCII letters, digits and underscores, no digit first [E0715]\n  2. scene.toml:31"
        " (outputs.tip.position): there"
        " is no point 'tip'; try: a [points] section [E0100]",
        old="[points.tip]",
        new='[points."the tip"]',
    ),
]
