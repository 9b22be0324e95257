"""Each message of the source has a code, and ``eomgen explain`` finds it in the source."""

from __future__ import annotations

import ast
import json
import pickle
import re
import subprocess
import sys
import zlib
from functools import cache
from pathlib import Path

import pytest

import eomgen
from eomgen.base.message_codes import CODE, EXAMPLES, MessageRow, code_of_finding, codes, messages, rows, sources
from eomgen.cli import main
from eomgen.cli.explain import (
    examples,
    explanation,
    own_causes,
    pages,
    pages_of_codes,
    pages_of_sections,
    shown_pattern,
    topic_name,
)
from eomgen.errors import Message
from eomgen.scene.document.schema import every_document
from eomgen.simulation.judgement.register import CHECKS
from tests.failures.catalogue import CHAPTERS
from tests.messages import catalogue
from tests.messages.sentences import letters, unmarked
from tests.syntax import facts

DOCUMENT = every_document()
ROOT = Path(__file__).parents[2]
#: Bytes of the examples in the wheel at most, which compresses each file.
LARGEST = 15_000
#: Texts of other functions, with places or further values around them, and names of checks of the toolchain.
AROUND = re.compile(
    r"(?:[\w.]+: )?\{\}(?: infinite|, and here it is \{\}| is unknown)?|"
    r"python|compiler|compiles|Python\.h|temporary files"
)


@cache
def parsed(module: str, source: str) -> tuple[MessageRow, ...]:
    """Return the messages of a module, which is parsed once."""
    return tuple(messages(module, source))


@cache
def fitting() -> dict[MessageRow, re.Pattern[str]]:
    """Return all rows with patterns of their texts: more than the module ``re`` keeps."""
    return {row: re.compile(".*".join(map(re.escape, row.pattern.split("{}")))) for row in rows()}


def code_of(text: str) -> str:
    """Return the code of the message that fits a text best."""
    fits = [row for row, pattern in fitting().items() if pattern.fullmatch(text)]
    return max(fits, key=lambda row: letters(row.pattern)).code


@pytest.mark.slow
def test_the_examples_are_those_of_bad_inputs() -> None:
    assert EXAMPLES.read_text(encoding="utf-8") == catalogue.examples(), f"run: {catalogue.COMMAND}"


def test_each_error_and_warning_has_a_code_at_its_text() -> None:
    missing = [f"{path}:{place}" for path, row in facts().items() for place in row.unmarked]
    missing = [place for place in missing if not AROUND.fullmatch(place.partition(": ")[2])]
    assert missing == [], f"[E] or [W] at the end of the text, then: {catalogue.COMMAND}"


def test_each_code_has_one_meaning() -> None:
    known: dict[str, set[str]] = {}
    for module, text in sources().items():
        for row in parsed(module, text):
            known.setdefault(row.code, set()).add(row.pattern)
    for code, patterns in known.items():
        shared = set.intersection(*(set(re.findall(r"\w+", pattern)) for pattern in patterns))
        assert shared or len(patterns) == 1, f"{code} stands for different messages: {patterns}"


def rows_of(folder: Path, source: str) -> tuple[MessageRow, ...]:
    """Return the rows of a package of one module, in a new folder, without codes of kinds."""
    package = folder / "eomgen"
    package.mkdir(parents=True)
    (package / "gates.py").write_text(source, encoding="utf-8")
    return tuple(row for row in rows(package=package) if row.room == "gates")


def test_rows_follow_from_the_source(tmp_path: Path) -> None:
    narrow = 'raise ModelError(Problem(place, f"the gate of {width:.3g} m is narrow [E0011]", "a wider gate"))'
    assert rows_of(tmp_path / "narrow", narrow) == (
        MessageRow("E0011", "m", "gates", "the gate of {} m is narrow", "a wider gate"),
    )
    source = """
def gate(place):
    \"\"\"Return "a gate [E0099]".\"\"\"
    fault = "no hinge [E0012]" if hinge else f"a gate {shown(place)} {{closed}} without a {post} [E0013]"
    if rusty:
        warn(f"rusty [W0011]")
    raise UsageError(Problem(place, fault, f"a hinge of {size}"))


def other(place):
    return "low [E0014]"


ROWS = (Check("stopped [W0012]", stopped),)
"""
    assert rows_of(tmp_path / "several", source) == (
        MessageRow("E0012", "u", "gates", "no hinge", "a hinge of {}"),
        MessageRow("E0013", "u", "gates", "a gate {} {} without a {}", "a hinge of {}"),
        MessageRow("E0014", "u", "gates", "low", ""),
        MessageRow("W0011", "w", "gates", "rusty", ""),
        MessageRow("W0012", "r", "gates", "stopped", ""),
    )


def test_a_new_message_gets_the_next_code(tmp_path: Path) -> None:
    rows_of(tmp_path / "new", 'fault = "without a hinge [E]" if hinge else "without a post [E]"\nwarn("rusty [W]")\n')
    before = json.loads(catalogue.LAST.read_text(encoding="utf-8"))
    last = catalogue.number_new(tmp_path / "new" / "eomgen")
    assert last == {"E": before["E"] + 2, "W": before["W"] + 1}
    text = (tmp_path / "new" / "eomgen" / "gates.py").read_text(encoding="utf-8")
    numbered = [row.code for row in rows_of(tmp_path / "numbered", text)]
    assert numbered == [f"E{last['E'] - 1:04d}", f"E{last['E']:04d}", f"W{last['W']:04d}"]


def test_the_last_codes_are_not_below_those_of_the_source() -> None:
    last = json.loads(catalogue.LAST.read_text(encoding="utf-8"))
    assert all(int(code[1:]) <= last[code[0]] for code in codes()), f"run: {catalogue.COMMAND}"


def test_an_error_without_a_code_is_found() -> None:
    source = 'raise ModelError("the gate is narrow")\nraise ModelError("the gate is low [E0001]")\n'
    assert list(unmarked(source, ast.walk(ast.parse(source)))) == ["1: the gate is narrow"]


def test_a_text_carries_its_code_to_the_problem() -> None:
    message = Message("the mass is negative [E1709]")
    assert message == "the mass is negative" and message.code == "E1709" and message.line == f"{message} [E1709]"
    assert pickle.loads(pickle.dumps(message)).code == Message(message).code == "E1709"
    assert Message("beams.a: the mass is negative [E1709], and no lint [W0001]").code == "W0001"
    error = eomgen.ModelError(f"bodies.a: {message.line}; 2 more")
    assert error.problems[0].what == "bodies.a: the mass is negative; 2 more" and error.code == "E1709"
    problem = eomgen.Problem("a.toml:1", "the mass -1 is negative", row="E0009", data={"mass": -1.0})
    assert problem.code == "E0009" and problem.data["mass"] == -1.0
    assert eomgen.ModelError("the gate of 2 m is narrow", code="E0002").code == "E0002"


def test_examples_are_found_again_and_every_entry_with_one_problem_has_one_code() -> None:
    assert len(examples()) > 150 and examples().keys() <= {row.code for row in rows()}
    titles = {entry.title for _, _, entries in CHAPTERS for entry in entries}
    assert {title for title, _ in examples().values()} <= titles
    assert all(f"[{code}]" in text for code, (_, text) in examples().items())


def test_codes_are_unique() -> None:
    every = [row.code for row in rows()]
    assert len(set(every)) == len(every) > 2000
    assert not [row for row in rows() if CODE.search(row.pattern + row.remedy)]


def test_a_remedy_stands_next_to_its_fault() -> None:
    source = """
def check(heavy):
    known = ("no such option [E0002]", "missing option [E0003]")
    if heavy:
        fault = "the load is heavy [E0004]"
        raise UsageError(Problem("load", fault, lighter()))
    fault = "the load is light [E0005]"
    fault += " and small"
    raise UsageError(Problem("load", fault, "a heavier one"))
"""
    remedies = {row.code: row.remedy for row in messages("module", source)}
    assert remedies == {"E0002": "", "E0003": "", "E0004": "", "E0005": "a heavier one"}


def test_errors_have_codes_in_python() -> None:
    with pytest.raises(eomgen.DescriptionError) as caught:
        eomgen.SceneBuilder("broken").body("arm", -1.0, inertia=[1, 1, 1]).joint(
            "hinge", "revolute", "base", "arm", axis=[0, 1, 0]
        ).build()
    error = caught.value
    assert error.code == error.problems[0].code == "E1709"
    assert str(error).count("[E") == 0 and f"[{error.code}]" in error.report(codes=True)
    assert eomgen.ModelError("a text of another distribution").code == "E0004"
    general = [row for row in rows() if "E0001" <= row.code <= "E0007"]
    assert all(explanation(row)["kind"].endswith(f"exit code {int(row.code[1:])}") for row in general)


def test_findings_have_codes_by_name() -> None:
    names = [check.name for check in CHECKS]
    assert len({code_of_finding(name) for name in names}) == len(names) and code_of_finding("no such check") == ""


def test_every_room_has_a_page() -> None:
    assert all((ROOT / "docs" / page).is_file() for page in pages().values())
    assert {topic_name(row.room) for row in rows()} == pages().keys()


def test_every_section_has_a_page() -> None:
    sections = {name for name in pages_of_sections() if "." not in name}
    assert sections == DOCUMENT.model_fields.keys()
    assert {row.code for row in rows()} >= pages_of_codes().keys()
    every = {*pages_of_sections().values(), *pages_of_codes().values()}
    assert all((ROOT / "docs" / page).is_file() for page in every)


@pytest.mark.parametrize(
    ("page", "texts"),
    [
        (
            "scene.md",
            [
                "this is not TOML: Illegal character",
                "'hinge' is not known here",
                "the key stiffness is missing",
                "a number is needed here, not 'fast'",
            ],
        ),
        ("scene/beams.md", ["the beam deforms in no way"]),
        ("scene/bodies.md", ["the mass -1 is negative"]),
        ("scene/constraints.md", ["the equation names no coordinate, so it holds no motion"]),
        (
            "scene/curves.md",
            ["there is no column 'hight'; there are time, height", "the points are not in order: 1 comes after 2"],
        ),
        ("scene/mjcf.md", ["a ball joint with armature on a body that moves is not supported"]),
        ("scene/top_level.md", ["the key format is missing"]),
        ("scene/values_and_formulas.md", ["unknown function 'sinus'"]),
    ],
)
def test_explanations_name_the_page_of_the_key(page: str, texts: list[str]) -> None:
    named = {row.code: row for row in rows()}
    assert {explanation(named[code_of(text)])["page"] for text in texts} == {f"docs/{page}"}


def test_explanations_of_a_format_name_its_page() -> None:
    row = next(row for row in rows() if row.room.startswith("products.robots.sdf."))
    assert explanation(row)["page"] == "docs/scene/sdf.md"


def test_notes_name_the_page_of_their_subject() -> None:
    named = {row.pattern: explanation(row)["page"] for row in rows()}
    assert named["its unit {} is a label, and its values are in {}"] == "docs/scene/outputs.md"


def test_no_cause_is_shown_that_is_not_of_the_code() -> None:
    assert {row.code for row in rows() if explanation(row)["cause"]} == own_causes().keys()
    assert shown_pattern("{}.{}{}: {} in {}") == "...: ... in ..."


def test_causes_of_single_codes_are_of_codes_in_use() -> None:
    for code, topic in own_causes().items():
        assert code in codes() and topic["cause"].endswith(".") and (ROOT / "docs" / topic["page"]).is_file(), code


def test_frequent_mistakes_have_causes_of_their_own(capsys: pytest.CaptureFixture[str]) -> None:
    for text, words in (
        ("the key dampening is unknown here", "has a key that the section does not know"),
        ("there is no body 'rodd'", "names a body that the scene does not have"),
        ("the key parent is missing", "A key that the section needs"),
        ("there is no unit degg", "no unit that eomgen knows"),
    ):
        assert main(["explain", code_of(text)]) == 0
        assert words in capsys.readouterr().out


def test_the_examples_are_small() -> None:
    assert len(zlib.compress(EXAMPLES.read_bytes(), 9)) <= LARGEST


def test_explain_prints_a_code_with_its_example(capsys: pytest.CaptureFixture[str]) -> None:
    code = code_of("the mass -1 is negative")
    for words in (
        [code],
        [code.lower()],
        ["the mass -1 is negative"],
        [f"scene.toml: the mass -1 is negative [{code}]"],
    ):
        assert main(["explain", *words]) == 0
        shown = capsys.readouterr().out
        assert shown.startswith(f"{code}: description error, exit code 3\n\nmessage  the mass ... is negative\nsee ")
        assert "\nsee      docs/scene/bodies.md\n" in shown and "\nremedy " not in shown
        assert shown.endswith(f"the mass -1 is negative; try: a positive number of kg [{code}]\n")
    assert main(["explain", code, "--json"]) == 0
    (data,) = json.loads(capsys.readouterr().out)
    assert data["code"] == code and data["title"] == "A negative mass"


def test_explain_searches_and_counts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain"]) == 0
    assert re.match(r"\d{4} errors, E0001 to E\d{4}, and \d+ notes, W0001 to W\d{4}\.\n", capsys.readouterr().out)
    assert main(["explain", "mass", "negative"]) == 0
    assert f"{code_of('the mass -1 is negative')}  the mass ... is negative\n" in capsys.readouterr().out
    assert main(["explain", "joint"]) == 0
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) == 40 and printed.err.startswith("and ")
    assert main(["explain", "E9999"]) == 2
    assert "this version has no message E9999; try: eomgen explain mass, a search [E" in capsys.readouterr().err
    assert main(["explain", "xyzzy", "plugh"]) == 2
    assert "no message contains 'xyzzy plugh'; try: fewer words" in capsys.readouterr().err


def test_with_json_an_error_is_json_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "nowhere.toml", "--json"]) == 7
    printed = capsys.readouterr()
    error = json.loads(printed.out)["error"]
    assert error["kind"] == "input/output error" and error["exit_code"] == 7 and len(error["problems"]) == 1
    assert error["code"] == error["problems"][0]["code"] and printed.err.endswith(f"[{error['code']}]\n")


@pytest.mark.slow
def test_a_run_without_messages_does_not_read_the_catalogue() -> None:
    script = (
        "import sys; from eomgen.cli import main\n"
        "assert main(['info', 'examples/heavy_top/joint_coordinates.toml', '--json']) == 0\n"
        "sys.exit('eomgen.base.message_codes' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.DEVNULL, timeout=60, check=False)
    assert run.returncode == 0
