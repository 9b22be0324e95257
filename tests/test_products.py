"""The core works without any product: copies of the package, each with one product deleted."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

import eomgen
from eomgen.base.files import template_folder
from eomgen.base.products import products
from tests.models.scenes import PENDULUM_TOML
from tests.product_names import COMMAND, text_of

PACKAGE = Path(eomgen.__file__).parent
#: Deleted in the first tier.
FIRST = "studies"
#: Uses of each product: Python, which has the pendulum's ``scene`` and its ``model``, and command lines; place and name
#: of each message.
USES: Mapping[str, tuple[tuple[str, str], ...]] = {
    "comparison": (
        ("eomgen.compare", "module 'eomgen' has no attribute 'compare'"),
        ("cli('compare', 'pendulum.toml', 'pendulum.toml')", "eomgen: there is no verb 'compare'"),
    ),
    "derivatives": (("model.sensitivities", "a Model has no 'sensitivities'"),),
    "doubts": (),
    "ensembles": (
        ("model.simulate_many", "a Model has no 'simulate_many'"),
        ("cli('ensemble', 'pendulum.toml')", "eomgen: there is no verb 'ensemble'"),
    ),
    "fields": (
        ("eomgen.sampling", "module 'eomgen' has no attribute 'sampling'"),
        ("cli('sample', 'field.toml')", "eomgen: there is no verb 'sample'"),
        ("eomgen.load('hamiltonian.toml')", "hamiltonian.toml:2 (kind): there is no kind of file 'hamiltonian'"),
    ),
    "fmu": (
        ("eomgen.fmu", "module 'eomgen' has no attribute 'fmu'"),
        ("cli('fmu', 'pendulum.toml')", "eomgen: there is no verb 'fmu'"),
    ),
    "laws": (
        ("cli('info', 'laws.toml')", "laws.toml:51 (laws): the section 'laws' is unknown"),
        ("cli('info', 'law.toml')", "law.toml:52 (outputs.height.formula[0]): unknown quantity 'law'"),
    ),
    "linear": (
        ("eomgen.control", "module 'eomgen' has no attribute 'control'"),
        ("eomgen.with_controller", "module 'eomgen' has no attribute 'with_controller'"),
        ("model.linearize", "a Model has no 'linearize'"),
        ("run.psd", "a Solution has no 'psd'"),
        ("cli('linearize', 'pendulum.toml')", "eomgen: there is no verb 'linearize'"),
        ("eomgen.build('calibration.toml')", "controllers.hold.calibration: "),
    ),
    "maps": (
        ("cli('info', 'maps.toml')", "maps.toml:51 (maps): the section 'maps' is unknown"),
        ("cli('info', 'map.toml')", "map.toml:52 (outputs.height.formula[0]): unknown quantity 'map'"),
    ),
    "optimisers": (
        ("eomgen.casadi", "module 'eomgen' has no attribute 'casadi'"),
        ("eomgen.generate('pendulum.toml', 'c', target='casadi')", "target: there is no target 'casadi'"),
    ),
    "pictures": (
        ("run.animate", "a Solution has no 'animate'"),
        ("run.plot_sections", "a Solution has no 'plot_sections'"),
        ("run.rainflow", "a Solution has no 'rainflow'"),
        ("cli('animate', 'pendulum.toml')", "eomgen: there is no verb 'animate'"),
        ("cli('equilibrium', 'pendulum.toml', '--plot', 'rest.png')", "no such option '--plot'"),
    ),
    "pages": (
        ("model.live", "a Model has no 'live'"),
        ("cli('live', 'pendulum.toml')", "eomgen: there is no verb 'live'"),
        ("cli('report', 'pendulum.toml')", "eomgen: there is no verb 'report'"),
        ("cli('latex', 'pendulum.toml')", "eomgen: there is no verb 'latex'"),
    ),
    "robots": (
        (
            "eomgen.load('robot.urdf')",
            "'robot.urdf' cannot be read: it is part of the product robots of eomgen, which is not installed",
        ),
        ("cli('info', 'robot.sdf')", "'robot.sdf' cannot be read: it is part of the product robots of eomgen"),
    ),
    "sympy_mechanics": (("eomgen.from_sympy", "module 'eomgen' has no attribute 'from_sympy'"),),
    "reliability": (
        ("eomgen.random_vibration", "module 'eomgen' has no attribute 'random_vibration'"),
        ("cli('random', 'pendulum.toml')", "eomgen: there is no verb 'random'"),
        ("cli('info', 'random.toml')", "random.toml:51 (random): the section 'random' is unknown"),
    ),
    "statics": (
        ("model.equilibrium_path", "a Model has no 'equilibrium_path'"),
        ("model.steady_motion", "a Model has no 'steady_motion'"),
        ("model.buckling_loads", "a Model has no 'buckling_loads'"),
        ("cli('equilibrium', 'pendulum.toml', '--path', 'length=1:2')", "no such option '--path'"),
        ("cli('equilibrium', 'pendulum.toml', '--buckling', 'length')", "no such option '--buckling'"),
    ),
    "studies": (
        ("eomgen.tune", "module 'eomgen' has no attribute 'tune'"),
        ("cli('check', 'pendulum.toml')", "eomgen: there is no verb 'check'"),
    ),
    "testing": (("eomgen.testing", "module 'eomgen' has no attribute 'testing'"),),
    "waves": (
        ("eomgen.waves", "module 'eomgen' has no attribute 'waves'"),
        ("cli('info', 'waves.toml')", "waves.toml:51 (waves): the section 'waves' is unknown"),
        ("cli('info', 'hulls.toml')", "hulls.toml:51 (hulls): the section 'hulls' is unknown"),
        ("cli('info', 'word.toml')", "word.toml:52 (outputs.height.formula[0]): unknown quantity 'elevation'"),
        ("cli('info', 'slope.toml')", "slope.toml:52 (outputs.height.formula[0]): unknown quantity 'slope'"),
        ("cli('info', 'key.toml')", "key.toml:16 (base.follow): the key 'follow' is unknown here"),
    ),
}
#: A scene with gains from its own linear model.
CALIBRATION_TOML = f"""{PENDULUM_TOML}
[controllers.hold]
type = "state_feedback"
coordinates = ["hinge"]
calibration = {{ method = "lqr", position_weights = {{ hinge = 1 }}, effort_weights = 1 }}

[efforts.holder]
joint = "hinge"
effort = "hold"
"""
#: Scene files that need a product, by name.
SCENES: Mapping[str, str] = {
    **{section: f"{PENDULUM_TOML}\n[{section}.sea]\n" for section in ("random", "waves", "hulls", "laws", "maps")},
    "word": f'{PENDULUM_TOML}\n[outputs.height]\nformula = "1 + elevation.sea(0, 0)"\n',
    "law": f'{PENDULUM_TOML}\n[outputs.height]\nformula = "law.hill(0, 0)"\n',
    "map": f'{PENDULUM_TOML}\n[outputs.height]\nformula = "map.hill(0, 0)"\n',
    "slope": f'{PENDULUM_TOML}\n[outputs.height]\nformula = "slope.sea[0]"\n',
    "calibration": CALIBRATION_TOML,
    "key": PENDULUM_TOML.replace("[base]", '[base]\nfollow = { waves = "sea" }'),
}
HAMILTONIAN_TOML = """
kind = "hamiltonian"
name = "oscillator"
"""
#: The contract of the core, in one process.
_CORE = """
import contextlib, io, json, sys
from pathlib import Path
import eomgen
from eomgen.cli import main
from eomgen.base.products import products
from eomgen.base.files import template_folder

def cli(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    if code:
        raise RuntimeError(err.getvalue())
    return out.getvalue()

model = eomgen.build(eomgen.load("pendulum.toml"), profile="quick")
run = model.simulate(0.1, 1e-3)
messages = []
for use in json.loads(sys.argv[1]):
    try:
        eval(use)
        messages.append("no message")
    except Exception as error:
        messages.append(str(error).strip())
print(json.dumps({
    "file": eomgen.__file__,
    "products": list(products()),
    "public": [name for name in eomgen.__all__ if getattr(eomgen, name) is None],
    "success": run.success,
    "notes": run.metadata["notes"],
    "checked": [finding.name for finding in model.simulate(10.0, 0.25, parameters={"shake": 0.0}).findings],
    "motion": run.q[-1].tolist(),
    "poses": list(run.poses),
    "stored": list(eomgen.Solution.load(run.save("run.npz")).poses),
    "rest": json.loads(cli("equilibrium", "pendulum.toml", "--json"))["stable"],
    "help": cli("--help"),
    "schema": sorted(json.loads(cli("schema"))["properties"]),
    "info": json.loads(cli("info", "pendulum.toml", "--json"))["degrees_of_freedom"],
    "shown": cli("info", "pendulum.toml"),
    "messages": messages,
}))
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of libraries that all copies share: they are of one version of the code."""
    return tmp_path_factory.mktemp("cache")


def without(deleted: Sequence[str], folder: Path) -> list[str]:
    """Copy the package as it is installed, without products, and return the deleted and the dependent products."""
    shutil.copytree(PACKAGE, folder / "eomgen")
    shutil.copytree(PACKAGE.parent / "templates", folder / "eomgen" / "_templates")
    for product in deleted:
        shutil.rmtree(folder / "eomgen" / "products" / product)
        shutil.rmtree(folder / "eomgen" / "_templates" / product, ignore_errors=True)
    gone = [*deleted]
    while more := [name for name, row in products().items() if name not in gone and set(row.needs) & set(gone)]:
        gone += more
    return gone


@pytest.mark.long_cases("studies")
@pytest.mark.parametrize(
    "deleted",
    [
        pytest.param([FIRST], id=FIRST),
        pytest.param([*USES], id="all", marks=pytest.mark.slow),
        *(pytest.param([name], id=name, marks=pytest.mark.long) for name in USES if name != FIRST),
    ],
)
def test_the_core_works_without_products(deleted: list[str], tmp_path: Path, cache: Path) -> None:
    gone = without(deleted, tmp_path)
    (tmp_path / "pendulum.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    for name, text in SCENES.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    (tmp_path / "hamiltonian.toml").write_text(HAMILTONIAN_TOML, encoding="utf-8")
    uses = [use for name in gone for use in USES[name]]
    run = subprocess.run(
        [sys.executable, "-c", _CORE, json.dumps([use for use, _ in uses])],
        capture_output=True, text=True, check=False, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path), "EOMGEN_CACHE": str(cache)},
    )  # fmt: skip  # a command line
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert Path(result["file"]).is_relative_to(tmp_path)
    assert set(result["products"]) == set(products()) - set(gone)
    assert result["success"] and result["info"] == 1 and "Configuration" in result["shown"]
    assert "  simulate " in result["help"] and "bodies" in result["schema"] and not result["public"]
    assert ("checks: not installed" in result["notes"]) == ("doubts" in gone)
    assert "discretisation_error" in result["checked"]
    assert result["poses"] == result["stored"] == ["link", "base"] and result["rest"]
    owners = [name for name in gone for _ in USES[name]]
    for message, (_, fault), owner in zip(result["messages"], uses, owners, strict=True):
        because = f"it is part of the product {owner} of eomgen, which is not installed"
        assert fault in message and because in message and "; try: all of eomgen" in message and "\n" not in message


def test_every_product_is_deleted_once() -> None:
    assert set(USES) == set(products())


def test_templates_are_of_the_core_or_of_one_product() -> None:
    folders = {folder.name for folder in template_folder().iterdir() if folder.is_dir()} - {"__pycache__"}
    assert "c" in folders and folders - {"c"} <= set(products())


def test_names_for_messages_are_up_to_date() -> None:
    text = (PACKAGE / "products" / "offered.py").read_text(encoding="utf-8")
    assert text == text_of(text), f"out of date: {COMMAND}"
