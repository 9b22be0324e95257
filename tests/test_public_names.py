"""Public names stay: Python's with their parameters, verbs with their options, keys of scenes."""

from __future__ import annotations

import pytest

import eomgen
from eomgen.base.calls import unknown_attribute
from eomgen.base.message_codes import rows
from eomgen.base.products import replacements
from eomgen.cli import main
from eomgen.errors import UsageError
from eomgen.integrators.families.register import canonical_name
from tests import public_names
from tests.public_names import COMMAND, REMOVED, gone, lines, read_lines


@pytest.mark.slow
def test_public_names_only_grow() -> None:
    before, now = read_lines(), lines()
    assert not gone(before, set(now)), "callers lose these names; a removed name has a message, and a row in REMOVED"
    assert before == now, f"`{COMMAND}` writes the new names"


def test_removed_names_have_a_message() -> None:
    now, codes = lines(), {row.code for row in rows()}
    for name, code in REMOVED.items():
        assert code in codes and not any(line.startswith(name) for line in now), name


@pytest.mark.parametrize("name", replacements("method"))
def test_removed_methods_name_the_replacement(name: str) -> None:
    replacement = replacements("method")[name]
    with pytest.raises(UsageError) as caught:
        canonical_name(name)
    assert str(caught.value) == f"usage error: method: the method {name} was removed; try: {replacement}"
    assert canonical_name(replacement.partition(",")[0])


@pytest.mark.parametrize("name", replacements("option"))
def test_removed_options_name_the_replacement(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*name.split(), "1"]) == 2
    expected = f"the option {name} was removed; try: {replacements('option')[name]}"
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize("name", replacements("name"))
def test_removed_names_name_the_replacement(name: str) -> None:
    with pytest.raises(AttributeError) as caught:
        getattr(eomgen, name)
    assert f"the name {name} was removed [E2236]; try: {replacements('name')[name]}" in str(caught.value)


@pytest.mark.parametrize("name", replacements("attribute"))
def test_removed_attributes_name_the_replacement(name: str) -> None:
    kind, _, attribute = name.partition(".")
    error = unknown_attribute(type(kind, (), {})(), attribute)
    assert f"the attribute {name} was removed; try: {replacements('attribute')[name]}" in str(error)


@pytest.mark.parametrize("name", replacements("argument"))
def test_removed_arguments_name_the_replacement(name: str) -> None:
    function, _, argument = name.rstrip(")").partition("(")
    with pytest.raises(UsageError) as caught:
        getattr(eomgen, function)({}, **{argument: 1})
    assert f"the argument {name} was removed; try: {replacements('argument')[name]}" in str(caught.value)


def test_lines_that_go_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    before = ["eomgen.build", "eomgen.build(scene)", "eomgen.old", "eomgen.old(a=1)"]
    assert gone(before, {"eomgen.build"}) == before[1:]
    monkeypatch.setattr(public_names, "REMOVED", {"eomgen.old": "E0001"})
    assert gone(before, {"eomgen.build"}) == ["eomgen.build(scene)"]
