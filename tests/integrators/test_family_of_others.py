"""A family from another distribution, found by its entry point, does all that eomgen's own do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.integrators.families.family import Family
from tests.codegen.test_stand_alone import compiled
from tests.codegen.test_stand_alone import run as program
from tests.integrators.adams.family import AdamsBashforth
from tests.models.distributions import distribution, register
from tests.models.scenes import LENGTH, PENDULUM_TOML, flyer, pendulum

__all__ = ["register"]

METHOD, STEP = "adams_bashforth", 1e-3
#: A family that its author forgot to say of how states between rows are interpolated.
Undense = type(
    "Undense",
    (Family,),
    {
        name: item
        for name, item in vars(AdamsBashforth).items()
        if name not in ("dense_output", "__dict__", "__weakref__")
    },
)


pytestmark = pytest.mark.usefixtures("register")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = "adams = tests.integrators.adams.family:AdamsBashforth"
    monkeypatch.syspath_prepend(distribution(tmp_path / "site", "eomgen-adams", entry))


@pytest.mark.slow_except("pendulum-1")
@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("model", [pendulum, flyer])
def test_it_converges_with_its_order(model, order: int) -> None:
    exact = model().simulate(0.4, 1e-3, method="rk4").v[-1]
    errors = [
        np.abs(model().simulate(0.4, step, method=METHOD, order=order).v[-1] - exact).max() for step in (1e-3, 5e-4)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


@pytest.mark.usefixtures("installed")
def test_names_settings_statistics_and_statuses_are_its_own() -> None:
    run = pendulum().simulate(0.1, STEP, method="ab2", settings={"largest_speed": 50.0})
    assert (run.metadata["method"], run.metadata["settings"]) == (
        METHOD,
        {"step": STEP, "order": 2.0, "largest_speed": 50.0},
    )
    assert (run.stats["steps"], run.stats["starts"]) == (100, 1) and isinstance(run.stats["starts"], int)
    assert run.stats["max_speed"] == pytest.approx(np.abs(run.v).max())
    stopped = pendulum().simulate(1.0, STEP, method=METHOD, settings={"largest_speed": 0.2})
    assert not stopped.success and "a velocity is beyond largest_speed" in stopped.message
    assert stopped.message.endswith("try: less than 0.001 s")


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"order": 3}, "order: adams_bashforth has the orders 1 and 2, not 3; try: 2"),
        ({"rho_inf": 0.9}, "rho_inf: adams_bashforth takes no rho_inf; try: only order"),
        ({"settings": {"rtol": 1e-3}}, "settings: adams has no setting 'rtol'; try: one of largest_speed"),
    ],
)
def test_mistakes_are_answered_as_those_of_other_methods(options, said: str) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        pendulum().simulate(0.1, STEP, method=METHOD, **options)
    assert said in str(caught.value)


@pytest.mark.usefixtures("installed")
def test_states_between_rows_and_changed_parameters() -> None:
    run = pendulum().simulate(0.2, STEP, method=METHOD, record_every=10, parameters={"length": 1.2 * LENGTH})
    fine = pendulum().simulate(0.2, STEP, method=METHOD, record_every=1, parameters={"length": 1.2 * LENGTH})
    np.testing.assert_allclose(run.at(fine.t).q, fine.q, atol=5e-6)  # the first step is of order 1


@pytest.mark.long
@pytest.mark.usefixtures("installed")
def test_its_c_stands_alone_and_gives_the_same_rows(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    before, section, _ = PENDULUM_TOML.partition("[simulation]")
    scene.write_text(f'{before}{section}\nmethod = "{METHOD}"\norder = 2\nstep = {STEP}\n', encoding="utf-8")
    files = eomgen.generate(scene, tmp_path / "c")
    assert {"shaken_step.c", "shaken.h"} <= {file.name for file in files}
    text = program(compiled(tmp_path / "c"), "0.1").stdout
    rows = np.array([[float(x) for x in line.split(",")] for line in text.splitlines()[1:]])
    run = eomgen.build(scene, profile="reproducible").simulate(0.1)
    assert np.array_equal(rows[:, 1:4], np.hstack([run.q, run.v, run.a]))
    assert main(["simulate", str(scene), "--t-end", "0.05", "--out", str(tmp_path / "out")]) == 0


@pytest.mark.slow
def test_a_change_of_its_files_makes_another_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = Path(__file__).parent / "adams"
    copy = tmp_path / "site" / "adams_copy"
    (copy / "templates").mkdir(parents=True)
    for file in ("family.py", "__init__.py", "templates/stepper.c.jinja", "templates/workspace.jinja"):
        text = (own / file).read_text(encoding="utf-8").replace("adams_bashforth", "adams_copied")
        (copy / file).write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(distribution(tmp_path / "site", "copied", "adams = adams_copy.family:AdamsBashforth"))
    scene = eomgen.load(_scene(tmp_path))
    first = eomgen.build(scene, method="adams_copied", profile="quick").library.fingerprint
    template = copy / "templates" / "stepper.c.jinja"
    template.write_text(template.read_text(encoding="utf-8").replace("K(1.5)", "K(1.25)"), encoding="utf-8")
    assert eomgen.build(scene, method="adams_copied", profile="quick").library.fingerprint != first


def _scene(folder: Path) -> Path:
    path = folder / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("gone = no_such_module:Family", "does not load: ModuleNotFoundError: No module named 'no_such_module'"),
        ("wrong = math:pi", "is not a subclass of eomgen.integrators.families.family.Family"),
        ("bare = eomgen.integrators.families.family:Family", "lacks data, names, statuses, terms, title"),
        ("undense = tests.integrators.test_family_of_others:Undense", "lacks the class attribute dense_output"),
        ("again = eomgen.integrators.families.taylor:Taylor", "takes the name taylor, which there is"),
    ],
)
def test_a_broken_entry_point_is_named_with_its_distribution(
    entry: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(distribution(tmp_path / "site", "broken-one", entry))
    assert pendulum().simulate(0.01, STEP, method="rk4").success  # eomgen's own methods do not look
    pendulum().library.kept.clear()  # steppers of tests before, whose distributions were whole
    with pytest.raises(eomgen.UsageError) as caught:
        pendulum().simulate(0.01, STEP, method=METHOD)
    assert "of the distribution broken-one " + said in str(caught.value)
    assert str(caught.value).endswith("try: another version of broken-one, or uninstall it")
