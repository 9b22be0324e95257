"""The catalogue of messages is that of the source, every place that makes a message has a code, and ``eomgen explain``
prints it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zlib
from functools import cache
from pathlib import Path

import pytest

import eomgen
from eomgen.base.message_codes import (
    FOLDER,
    Row,
    code_of,
    code_of_finding,
    general_code,
    is_general,
    lines_of,
    row_of,
    rows,
)
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
from eomgen.scene.document.schema import every_document
from tests.failures.catalogue import CHAPTERS
from tests.messages import catalogue
from tests.messages.extraction import ROOT, Source

DOCUMENT = every_document()

#: Bytes of the catalogue in the wheel at most, which compresses each file.
LARGEST = 63_000
#: Places that pass a text on which is made elsewhere: fields of other errors and names of them.
PASSED_ON = re.compile(
    r"(\w+\.)?(problems?|refused|faults|unknown\.problems)(\[0\])?|\w+\.(what|last|text|message|problem)|"
    r"(\w+\.)?problems\[0\]\.what|error\.problems\[0\]\.what|str\(error\)|.*\b(error|note)\b.*|\*?named or .*"
)
#: The others, with the function that makes the text or the problem.
ELSEWHERE = {
    "text[:1].lower() + text[1:]": "click: rows of FOREIGN",
    "stages[min(stages)]": "problems of compiled.arguments",
    "self._no_controller()": "a Problem",
    "_circle(derivation, sampled, levels)": "a Problem",
    "'; '.join(clauses)": "notes of the scene",
    "replace(problem, hint=f'fewer names in hold, {problem.hint}')": "solvers.consistency",
    "fault": "a text of a caller, of a C function or of Python",
    "fault[1]": "products.laws.code",
    "bound[1]": "rules of values",
    "last": "products.reliability.tails",
    "reached": "products.reliability.tails",
    "self.fault": "a text of a caller",
    "_nothing(bought, refused, cycle)": "an error",
    "''": "a hint alone",
    "terms.text.replace('the formula', 'the equation')": "analyses of terms",
    "self.what": "the fault with its column",
    "replace(problem, hint=hint)": "solvers.consistency",
}


@cache
def source() -> Source:
    """Return the parsed package."""
    return Source()


@pytest.mark.slow
def test_the_catalogue_is_that_of_the_source_and_no_error_is_without_a_code() -> None:
    made = catalogue.renewed(rows(), source())
    for letter, lines in made.items():
        assert lines == lines_of(letter), f"run: {catalogue.COMMAND}"
    assert (FOLDER / "examples.txt").read_text(encoding="utf-8") == catalogue.examples()
    silent = [
        f"{site.module}:{site.line}: {site.text}"
        for site in catalogue.sites(source())
        if site.kind != "w" and not site.patterns and site.text not in ELSEWHERE
        if not PASSED_ON.fullmatch(site.text) and not re.match(r"(failed_step|_?too_many|ending|refused)\(", site.text)
    ]
    assert silent == []
    assert len(catalogue.sites(source())) > 2000


def numbered(lines: list[str]) -> list[Row]:
    """Return the rows of lines."""
    made: list[Row] = []
    for place, line in enumerate(lines, 1):
        row = row_of(f"E{place:04d}", line)
        made.append(row if row.room else row._replace(room=made[-1].room))
    return made


def test_a_reworded_message_keeps_its_code() -> None:
    lines = catalogue.renewed(rows()[:0], small := Source(ROOT / "eomgen" / "products" / "maps"))
    before = [row._replace(pattern=row.pattern.replace("increasing", "growing")) for row in numbered(lines["E"])]
    assert catalogue.renewed(before, small)["E"] == lines["E"]
    gone = [
        row._replace(pattern="no longer said by anybody at all, never") if k == 30 else row
        for k, row in enumerate(before)
    ]
    made = catalogue.renewed(gone, small)["E"]
    assert made[30] == "" and made[:30] == lines["E"][:30] and len(made) == len(lines["E"]) + 1


def test_a_message_with_a_code_at_its_source_is_identified_by_this_code_alone(tmp_path: Path) -> None:
    package = tmp_path / "eomgen"
    package.mkdir()
    (package / "gates.py").write_text(
        'def gate(width):\n    raise ModelError(f"the gate of {width} m is narrow", "a wider gate", code="E0002")\n'
    )
    (package / "errors.py").write_text("class EomgenError(Exception): ...\nclass ModelError(EomgenError): ...\n")
    before = numbered(["m\tgates\tthe first", "m\tgates\tanother text altogether"])
    assert "the gate of {} m is narrow" in catalogue.renewed(before, Source(package))["E"][1]
    error = eomgen.ModelError("the gate of 2 m is narrow", code="E0002")
    assert error.code == error.problems[0].code == "E0002"
    problem = eomgen.Problem("a.toml:1", "the mass -1 is negative", row="E0009", data={"mass": -1.0})
    assert problem.code == "E0009" and problem.data["mass"] == -1.0


def test_examples_are_found_again_and_every_entry_with_one_problem_has_one_code() -> None:
    assert len(examples()) > 150 and examples().keys() <= {row.code for row in rows()}
    titles = {entry.title for _, _, entries in CHAPTERS for entry in entries}
    assert {title for title, _ in examples().values()} <= titles
    assert all(f"[{code}]" in text for code, (_, text) in examples().items())


def test_codes_are_unique_and_the_most_literal_row_holds() -> None:
    codes = [row.code for row in rows()]
    assert len(set(codes)) == len(codes) > 2000
    pairs = [(row.code[0], row.pattern) for row in rows()]
    assert len(set(pairs)) == len(pairs)
    negative = code_of("the mass -1 is negative")
    assert negative and code_of("the mass -2.5 is negative at load = 1") == negative
    assert code_of("no such text was ever written in these sources") == ""
    sample = [row for row in rows()[7::97] if row.kinds != "r" and row.letters > 20]
    for row in sample:
        found = code_of(row.pattern.replace("{}", "7.5"), notes=row.code[0] == "W")
        assert found and next(one for one in rows() if one.code == found).letters >= row.letters, row


def test_errors_have_codes_in_python() -> None:
    with pytest.raises(eomgen.DescriptionError) as caught:
        eomgen.SceneBuilder("broken").body("arm", -1.0, inertia=[1, 1, 1]).joint(
            "hinge", "revolute", "base", "arm", axis=[0, 1, 0]
        ).build()
    error = caught.value
    assert error.code == error.problems[0].code == code_of(error.problems[0].what) != ""
    assert str(error).count("[E") == 0 and f"[{error.code}]" in error.report(codes=True)
    assert eomgen.ModelError("a text of another distribution").code == general_code(4)
    assert all(explanation(row)["kind"].endswith(f"exit code {int(row.code[1:])}") for row in rows() if is_general(row))


def test_findings_have_codes_by_name() -> None:
    names = catalogue.findings()
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
            ["this is not TOML: Illegal character", "'hinge' is not known here", "the key stiffness is missing"],
        ),
        ("scene/beams.md", ["the beam deforms in no way"]),
        ("scene/bodies.md", ["the mass -1 is negative"]),
        ("scene/constraints.md", ["the equation names no coordinate, so it holds no motion"]),
        ("scene/curves.md", ["there is no column 'hight'; there are time, height", "'road.csv' cannot be read: no"]),
        (
            "scene/curves.md",
            ["the points are not in order: 1 comes after 2", "column 'y': 'high' is not a number"],
        ),
        ("scene/joints.md", ["the axis has no direction"]),
        ("scene/mjcf.md", ["a ball joint with armature on a body that moves is not supported"]),
        ("scene/mjcf.md", ["the sidesite 'a' is not on the body of its geom"]),
        ("scene/sdf.md", [next(row.pattern for row in rows() if row.room == "products.robots.sdf")]),
        ("scene/simulation.md", ["a number is needed here, not 'fast'"]),
        ("scene/top_level.md", ["the key format is missing"]),
        ("scene/units.md", ["there is no unit degg"]),
        ("scene/values_and_formulas.md", ["unknown function 'sinus'"]),
    ],
)
def test_explanations_name_the_page_of_the_key(page: str, texts: list[str]) -> None:
    named = {row.code: explanation(row)["page"] for row in rows()}
    assert {named[code_of(text)] for text in texts} == {f"docs/{page}"}


def test_notes_name_the_page_of_their_subject() -> None:
    named = {row.pattern: explanation(row)["page"] for row in rows()}
    assert named["its unit {} is a label, and its values are in {}"] == "docs/scene/outputs.md"


def test_no_cause_is_shown_that_is_not_of_the_code() -> None:
    assert {row.code for row in rows() if explanation(row)["cause"]} == own_causes().keys()
    assert shown_pattern("{}.{}{}: {} in {}") == "...: ... in ..."


def test_causes_of_single_codes_are_of_codes_in_use() -> None:
    codes = {row.code for row in rows()}
    for code, topic in own_causes().items():
        assert code in codes and topic["cause"].endswith(".") and (ROOT / "docs" / topic["page"]).is_file(), code


def test_frequent_mistakes_have_causes_of_their_own(capsys: pytest.CaptureFixture[str]) -> None:
    for text, words in (
        ("the key dampening is unknown here", "has a key that the section does not know"),
        ("there is no body 'rodd'", "names a body that the scene does not have"),
        ("the key parent is missing", "A key that the section needs"),
        ("there is no unit degg", "no unit that eomgen knows"),
    ):
        assert main(["explain", code_of(text)]) == 0
        assert words in capsys.readouterr().out


def test_the_catalogue_is_small() -> None:
    sizes = {file.name: len(zlib.compress(file.read_bytes(), 9)) for file in FOLDER.iterdir()}
    assert sum(sizes.values()) <= LARGEST, sizes


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
    assert main(["explain", "the"]) == 0
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) == 40 and printed.err.startswith("and ")
    assert main(["explain", "E9999"]) == 2
    assert "there is no code E9999; try: eomgen explain mass, a search [E" in capsys.readouterr().err
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
