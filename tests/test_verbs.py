"""The register of verbs: commands and methods of ``Model`` and ``Solution`` by rows of eomgen and of other
distributions."""

from __future__ import annotations

import inspect
import pydoc
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import click
import pytest

import eomgen
from eomgen.base.calls import UnknownAttribute
from eomgen.cli import main
from eomgen.cli.options import FunctionOption, argument_of
from eomgen.compiled.model import CompiledModel
from eomgen.verbs import OWNERS, Verb, methods, methods_of, others, own
from tests.messages.answers import plain
from tests.model_stub import COMMAND, STUBS, module_stubs, stub
from tests.models.scenes import pendulum

ROWS = {(owner, name): target for owner in OWNERS for name, _, target in methods_of(own(), owner)}
#: Methods that the classes have without the register.
BASES = {"Model": set(dir(CompiledModel)), "Solution": {"at", "plot", "save", "poses", "section_loads"}}


def run_of_pendulum() -> eomgen.Solution:
    return pendulum().simulate(0.02, 1e-3)


def target_of(text: str) -> object:
    module, _, name = text.partition(":")
    return getattr(import_module(module), name)


@pytest.mark.parametrize("verb", own(), ids=lambda verb: verb.name)
def test_every_row_names_what_is_there(verb: Verb) -> None:
    assert verb.command or verb.methods or verb.solution_methods or verb.parts
    if verb.command:
        command = target_of(verb.command)
        assert isinstance(command, click.Command) and command.name == verb.name and verb.summary.endswith(".")
    for owner in OWNERS:
        for _, _, target in methods_of((verb,), owner):
            function = target_of(target)
            assert inspect.isfunction(function)
            assert next(iter(inspect.signature(function).parameters)) == owner.lower()


def test_names_are_used_once_and_hide_no_function_of_the_model() -> None:
    assert len({verb.name for verb in own()}) == len(own())
    for owner in OWNERS:
        assert len(methods(owner)) == len([*methods_of(own(), owner)])
        assert not methods(owner) & BASES[owner]


@pytest.mark.parametrize(("owner", "name"), sorted(ROWS))
def test_a_method_has_signature_and_docstring_of_its_function(owner: str, name: str) -> None:
    function = target_of(ROWS[owner, name])
    method = getattr(pendulum() if owner == "Model" else run_of_pendulum(), name)
    assert callable(function)
    arguments = list(inspect.signature(function).parameters.values())
    assert list(inspect.signature(method).parameters.values()) == arguments[1:]
    assert inspect.getdoc(method) == inspect.getdoc(function)
    text = pydoc.plain(pydoc.render_doc(method))
    assert "Raises\n    ------\n" in text and all(f"{item.name}" in text for item in arguments)


@pytest.mark.parametrize("owner", OWNERS)
def test_help_of_the_class_has_every_method(owner: str) -> None:
    text = pydoc.plain(pydoc.render_doc(getattr(eomgen, owner)))
    first = owner.lower()
    assert not [name for name in methods(owner) if not re.search(rf"^ \|  {name}\({first}: ", text, re.MULTILINE)]


@pytest.mark.parametrize("owner", OWNERS)
def test_the_stub_is_up_to_date(owner: str) -> None:
    assert STUBS[owner].read_text(encoding="utf-8") == stub(owner), f"out of date: {COMMAND}"


def test_the_stubs_of_public_modules_are_up_to_date() -> None:
    for file, text in module_stubs().items():
        assert file.read_text(encoding="utf-8") == text, f"out of date: {COMMAND}"


@pytest.mark.long
def test_a_type_checker_knows_methods_with_all_their_arguments(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import eomgen; from pathlib import Path\n"
        'model = eomgen.build("scene.toml")\n'
        'model.simulate(2.0, 1e-3, method="rk4").plot()\n'
        'model.simulate_many(1.0, vary={"mass": "normal(1, 0.1)"}, samples=16, rho_inf=0.9).plot("figures")\n'
        "model.start().step()\n"
        'model.simulate(2.0, metod="rk4")\n'
        'model.simulate_many(1.0, samples="16")\n'
        "model.linearize().modes().oscillate\n"
        'model.equilibrium_path("load")\n'
        'path: Path = model.simulate(1.0).animate("run.html")\n'
        'model.simulate(1.0).rainflow("tip").equivalent_range(slope="3")\n',
        encoding="utf-8",
    )
    package = Path(eomgen.__file__).parents[1]
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(script)],
        capture_output=True, text=True, check=False, cwd=package, env={"MYPYPATH": str(package)},
    )  # fmt: skip  # a command line
    lines = [line.partition("script.py:")[2] for line in run.stdout.splitlines() if ": error: " in line]
    assert [line.partition(": error: ")[0] for line in lines] == ["6", "7", "8", "9", "11"], run.stdout + run.stderr
    assert 'Unexpected keyword argument "metod"' in lines[0] and 'expected "int"' in lines[1]
    assert 'has no attribute "oscillate"' in lines[2] and "Too few arguments" in lines[3]
    assert 'expected "float"' in lines[4]


def test_models_and_solutions_are_imported_without_their_verbs() -> None:
    targets = sorted({target.partition(":")[0] for target in ROWS.values()})
    program = (
        "import sys, eomgen.pipeline.model; dir(eomgen.Model); dir(eomgen.Solution);"
        f" print([name for name in {targets} if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "[]\n"


OPTIONS = [
    (verb.name, option)
    for verb in own()
    if verb.command
    for option in target_of(verb.command).params  # type: ignore[attr-defined]
    if isinstance(option, FunctionOption)
]


@pytest.mark.parametrize(("verb", "option"), OPTIONS, ids=[f"{verb} {option.opts[0]}" for verb, option in OPTIONS])
def test_an_option_has_default_and_text_of_its_argument(verb: str, option: FunctionOption) -> None:
    function = target_of(option.function)
    assert callable(function)
    default, text = option.argument
    assert default == inspect.signature(function).parameters[str(option.name)].default
    assert text.endswith(".") and "``" not in text
    assert text in " ".join((inspect.getdoc(function) or "").replace("``", "").split())
    context = click.Context(click.Command(verb))
    shown = option.get_help_record(context)
    assert shown is not None and shown[1].startswith(text)
    if not option.multiple:
        assert option.get_default(context) in (("", None) if default == () else (default,))


def test_texts_of_arguments_are_their_first_sentences(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "documented.py").write_text(
        "def f(model, first=3, second='', other=()):\n"
        '    """Return 3.\n\n    Parameters\n    ----------\n    first, second : int\n        Sizes as in\n'
        '        ``g``, 1.5 by default. More.\n\n    Raises\n    ------\n    ValueError\n        None.\n    """\n',
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert argument_of("documented:f", "first") == (3, "Sizes as in g, 1.5 by default.")
    assert argument_of("documented:f", "second") == ("", "Sizes as in g, 1.5 by default.")
    assert argument_of("documented:f", "other") == ((), "")


def test_only_help_and_defaults_import_the_function() -> None:
    program = "import sys; from eomgen.cli.simulate import simulate; print('eomgen.simulation.simulate' in sys.modules)"
    assert (
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "False\n"
    )


#: A verb of somebody else.
PLUGIN = """
import click
from eomgen.verbs import Verb

METHODS = {"methods": ("unitverbs:units_of_parameters",), "solution_methods": ("unitverbs:rows_in",)}
UNITS = Verb("units", "Convert a quantity to SI units.", "unitverbs:units", **METHODS)


@click.command()
@click.argument("quantity")
def units(quantity):
    \"\"\"Convert a QUANTITY, a number with its unit, to SI units.\"\"\"
    if quantity == "nothing":
        raise RuntimeError("no quantity")
    click.echo(f"{quantity} of the verb")
    return 0


def units_of_parameters(model, prefix="", *, upper=False):
    \"\"\"Return the units of the tunable parameters by name.\"\"\"
    found = {item.name: item.unit for item in model.description.parameters if item.name.startswith(prefix)}
    return {name: unit.upper() for name, unit in found.items()} if upper else found


def rows_in(solution, unit="s"):
    \"\"\"Return the times of the rows.\"\"\"
    return solution.t / {"s": 1.0, "ms": 1e-3}[unit]
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install a distribution that adds a verb, and return its module."""
    (tmp_path / "unitverbs.py").write_text(PLUGIN, encoding="utf-8")
    information = tmp_path / "unitverbs-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: unitverbs\nVersion: 1.0\n", encoding="utf-8")
    (information / "entry_points.txt").write_text("[eomgen.verbs]\nunits = unitverbs:UNITS\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    others.cache_clear()
    yield tmp_path / "unitverbs.py"
    others.cache_clear()
    sys.modules.pop("unitverbs", None)


def test_a_distribution_adds_a_command(installed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert re.search(r"^  units +Convert a quantity to SI units\.$", capsys.readouterr().out, re.MULTILINE)
    assert main(["units", "--help"]) == 0
    assert "Usage: eomgen units [OPTIONS] QUANTITY" in capsys.readouterr().out
    assert main(["units", "3 mm"]) == 0
    assert capsys.readouterr().out == "3 mm of the verb\n"
    assert main(["unit", "3 mm"]) == 2
    assert plain(capsys.readouterr().err) == "usage error: eomgen: there is no verb 'unit'; try: units\n"
    assert main(["units"]) == 2
    assert "eomgen units: missing argument 'QUANTITY'" in capsys.readouterr().err


def test_a_distribution_adds_a_method(installed: Path) -> None:
    model = pendulum()
    expected = {item.name: item.unit for item in model.description.parameters}
    assert expected and model.units_of_parameters() == expected
    assert model.units_of_parameters("zz", upper=True) == {}
    assert "units_of_parameters" in dir(model) and hasattr(model, "units_of_parameters")
    assert str(inspect.signature(model.units_of_parameters)) == "(prefix='', *, upper=False)"
    assert "Return the units of the tunable parameters by name." in pydoc.render_doc(model.units_of_parameters)
    with pytest.raises(eomgen.UsageError, match="units_of_parameters: there is no argument 'uper'; try: upper"):
        model.units_of_parameters(uper=True)
    with pytest.raises(UnknownAttribute, match="a Model has no 'unit_of_parameters'; try: units_of_parameters"):
        model.unit_of_parameters  # noqa: B018


def test_a_fault_in_a_command_of_a_distribution_is_not_eomgen_s(
    installed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["units", "nothing"]) == 1
    assert plain(capsys.readouterr().err) == (
        "internal error: RuntimeError: no quantity; this is a fault of unitverbs; try: the same with --debug\n"
    )


NAMED = "the entry point 'units' (unitverbs:UNITS) in eomgen.verbs of the distribution unitverbs"
#: A method of a Solution that a product brings.
TAKEN = min(methods("Solution"))
REMEDY = "try: another version of unitverbs, or uninstall it"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("raise RuntimeError('no licence')", "does not load: RuntimeError: no licence"),
        ("UNITS = 3", "is not an eomgen.verbs.Verb"),
        (PLUGIN.replace('Verb("units"', 'Verb("unit"'), "has the row of another verb, 'unit'"),
        (PLUGIN.replace('"unitverbs:units"', '"unitverbs.units"'), "names 'unitverbs.units', which is not module:name"),
        (
            PLUGIN.replace("unitverbs:units_of_parameters", "unitverbs:simulate"),
            "takes the name simulate, which there is",
        ),
        (PLUGIN.replace("unitverbs:rows_in", f"unitverbs:{TAKEN}"), f"takes the name {TAKEN}, which there is"),
    ],
)
def test_a_row_that_cannot_be_used_is_named_once(
    installed: Path, capsys: pytest.CaptureFixture[str], text: str, fault: str
) -> None:
    installed.write_text(text, encoding="utf-8")
    message = f"usage error: eomgen.verbs: {NAMED} {fault}; {REMEDY}\n"
    assert main(["units", "3 mm"]) == 2
    assert plain(capsys.readouterr().err) == message
    assert main(["--help"]) == 0  # with the verbs that there are
    said = capsys.readouterr()
    assert said.err == f"left out: {message}" and "  simulate " in said.out and "  units " not in said.out
    assert main(["simulate", "--help"]) == 0
    assert capsys.readouterr().err == ""
    assert not hasattr(pendulum(), "units_of_parameters")
    for use in (lambda: pendulum().units_of_parameters, lambda: run_of_pendulum().rows_in):
        with pytest.raises(UnknownAttribute, match=re.escape(f"2. eomgen.verbs: {NAMED} {fault}")):
            use()


@pytest.mark.parametrize(
    ("name", "replaced", "fault"),
    [
        ("units", "nowhere:units", "does not load: ModuleNotFoundError: No module named 'nowhere'"),
        ("units", "unitverbs:UNITS", "is not a click.Command"),
        ("units_of_parameters", "unitverbs:nothing", "does not load: AttributeError: module 'unitverbs' has no"),
        ("units_of_parameters", "unitverbs:UNITS", "is not a function"),
    ],
)
def test_a_target_that_cannot_be_used_is_named(
    installed: Path, capsys: pytest.CaptureFixture[str], name: str, replaced: str, fault: str
) -> None:
    installed.write_text(PLUGIN.replace(f'"unitverbs:{name}"', f'"{replaced}"', 1), encoding="utf-8")
    message = f"eomgen.verbs: {NAMED} names {replaced}, which {fault}"
    if name == "units":
        assert main(["units", "3 mm"]) == 2
        assert capsys.readouterr().err.startswith(f"usage error: {message}")
        return
    attribute = replaced.partition(":")[2]
    with pytest.raises(UnknownAttribute, match=re.escape(message)):
        getattr(pendulum(), attribute)


def test_a_verb_of_eomgen_is_not_replaced(installed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = installed.parent / "unitverbs-1.0.dist-info" / "entry_points.txt"
    points.write_text("[eomgen.verbs]\nsimulate = unitverbs:UNITS\n", encoding="utf-8")
    installed.write_text(PLUGIN.replace('Verb("units"', 'Verb("simulate"'), encoding="utf-8")
    assert main(["simulate", "--help"]) == 0
    assert "Integrate a SCENE" in capsys.readouterr().out
    assert main(["--help"]) == 0
    assert "takes the name simulate, which there is" in capsys.readouterr().err
