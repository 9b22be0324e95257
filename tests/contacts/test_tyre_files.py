"""Files of tyres: units, texts, tables, mistakes with file and line, turn slip, keys without use."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from eomgen.errors import DescriptionError
from eomgen.products.contacts.tangential_laws import tangential_law
from eomgen.products.contacts.tyre_files import TyreFile, read_tyre_file
from tests.contacts.states import OWN, own_tyre

FORCES = ("force_x", "force_y", "moment_x", "moment_y", "moment_z")


@pytest.fixture
def tyre(tmp_path: Path) -> Callable[[str, str], TyreFile]:
    """Return a function that reads the own tyre with a replaced part."""

    def read(old: str, new: str) -> TyreFile:
        text = OWN.read_text(encoding="utf-8")
        assert old in text
        (tmp_path / "car.tir").write_text(text.replace(old, new, 1), encoding="utf-8")
        return read_tyre_file(tmp_path / "car.tir")

    return read


def test_numbers_are_in_si_and_texts_without_quotes() -> None:
    file = own_tyre()
    lengths_and_forces = {
        "UNLOADED_RADIUS": 0.31, "FNOMIN": 4000.0, "VERTICAL_STIFFNESS": 2e5, "LONGVL": 16.0, "VERTICAL_DAMPING": 50.0
    }  # fmt: skip  # a table
    for key, value in lengths_and_forces.items():
        assert file.numbers[key] == pytest.approx(value, rel=1e-15), key
    assert file.numbers["PKY1"] == -20.0 and "QSX12" in file.numbers and "1.0" not in file.numbers
    assert file.texts["TYRESIDE"] == "LEFT" and file.version == "6.1"


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("pky1 = -20", -20.0),
        ("  PKY1=-2.0D+1 ! Fortran", -20.0),
        ("PKY1 = -20.0$ a comment with = and 'quotes'", -20.0),
    ],
)
def test_case_comments_and_exponents(tyre: Callable[[str, str], TyreFile], line: str, meant: float) -> None:
    assert tyre("PKY1                    = -20.0", line).numbers["PKY1"] == meant


@pytest.mark.parametrize(
    ("fitted", "version"), [("5", "5.2"), ("6", "5.2"), ("21", "5.2"), ("61", "6.1"), ("62", "6.2")]
)
def test_versions(tyre: Callable[[str, str], TyreFile], fitted: str, version: str) -> None:
    assert tyre("= 61 ", f"= {fitted} ").version == version


def test_a_file_without_a_version_is_of_version_5_2(tyre: Callable[[str, str], TyreFile]) -> None:
    assert tyre("FITTYP ", "$").version == "5.2"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("= -20.0", "= nan", "car.tir:118 (PKY1): 'nan' is not a number"),
        ("PPY1 ", "PPY1 = O.4 $", "(PPY1): 'O.4' is not a number"),
        ("= -20.0", "= -2O.0", "car.tir:118 (PKY1): '-2O.0' is not a number"),
        ("PKY2                    = 1.8", "PKY1 = -19", "car.tir:118 (PKY1): PKY1 is in line 118 and in line 119"),
        ("PKY2 ", "PKY2 1.8 $", "car.tir:119: 'PKY2 1.8 $"),
        ("'millimeter'", "'furlong'", "car.tir (LENGTH): the unit 'furlong' is unknown"),
        ("'radians'", "'degrees'", "car.tir (ANGLE): the unit 'degrees' is unknown; try: one of radians, radian, rad"),
    ],
)
def test_mistakes_have_file_line_and_key(
    tyre: Callable[[str, str], TyreFile], old: str, new: str, message: str
) -> None:
    with pytest.raises(DescriptionError) as caught:
        tyre(old, new)
    assert message in str(caught.value)


def test_a_file_of_another_kind_is_told(tmp_path: Path) -> None:
    (tmp_path / "law.json").write_text('{\n  "PCX1": 1.6\n}\n', encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"law\.json: no line is a key with a value, .*try: a \.tir file"):
        read_tyre_file(tmp_path / "law.json")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("$ A tyre", "\ufeff$ A tyre"),
        ("= 61 ", "= '61' "),
        ("PKY1 ", "$ a page \x0c and a line \u2028 of a text\nPKY1 "),
    ],
)
def test_marks_of_editors_and_numbers_in_quotes_do_not_matter(
    tyre: Callable[[str, str], TyreFile], old: str, new: str
) -> None:
    file = tyre(old, new)
    assert file.numbers == own_tyre().numbers and file.version == "6.1"


@pytest.mark.parametrize("line", ["PKY1 = a{}b", "PKY1 = 'a'{}b", "-{}x", "[MODEL]{}x", "PKY1{}x"])
def test_long_lines_take_no_longer_by_character(line: str, tmp_path: Path) -> None:
    """A second is 50 times the time of one pass, and a 20th of the time if blanks were tried in pairs."""
    (tmp_path / "car.tir").write_text(line.format(" " * 300_000), encoding="utf-8")
    start = time.process_time()
    with pytest.raises(DescriptionError):
        read_tyre_file(tmp_path / "car.tir")
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("= 61 ", "= 70 ", "car.tir:13 (FITTYP): the Magic Formula of FITTYP = 70 is unknown"),
        ("= 124", "= 125", "car.tir:16 (USE_MODE): turn slip, by PDXP1, PKYP1, is not part of the law"),
    ],
)
def test_unfit_coefficients(tyre: Callable[[str, str], TyreFile], old: str, new: str, message: str) -> None:
    file = tyre(old, new)
    with pytest.raises(DescriptionError) as caught:
        assert file.version == "6.1"
        file.check_turn_slip()
    assert message in str(caught.value)


def test_missing_coefficients_matter_to_results_that_need_them(tyre: Callable[[str, str], TyreFile]) -> None:
    law, numbers = tangential_law("magic_formula", "6.1"), tyre("PCX1 ", "$").numbers
    assert "PCX1" not in {*law.coefficients(["stiffness_x", "force_y", "relaxation_x"], numbers), *numbers}
    assert "PCX1" in law.coefficients(["force_x"], numbers)


def test_turn_slip_without_coefficients_is_not_refused(tyre: Callable[[str, str], TyreFile]) -> None:
    file = tyre("PDXP1                   = 0.4\nPKYP1                   = 1.0", "PDXP1 = 0")
    file.numbers["USE_MODE"] = 125.0  # type: ignore[index]
    file.check_turn_slip()


def test_keys_without_use_are_listed() -> None:
    law, results = tangential_law("magic_formula", "6.1"), [*FORCES, "vertical_force", "effective_radius"]
    unused = own_tyre().unused_keys(law.coefficients(results, own_tyre().numbers))
    assert {"PDXP1", "PKYP1", "YAW_STIFFNESS", "Q_RA1", "PCFX1"} <= set(unused)
    assert not {"PCX1", "QSX12", "Q_FZ2", "KPUMIN", "FITTYP", "FILE_VERSION"} & set(unused)
