"""The folder for acados: its functions as acados calls them, and solvers of acados that are compiled with them."""

from __future__ import annotations

import ctypes
import json
import runpy
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen
from eomgen.scene.builder import SceneBuilder
from tests.optimisers.test_steps import hung

EXAMPLES = Path(__file__).parents[2] / "examples"
ACADOS = Path(sys.prefix) / "acados"
CART_POLE = EXAMPLES / "cart_pole_swing_up" / "model" / "scene.toml"
SERVO = EXAMPLES / "pi_servo" / "scene.toml"
Array = np.ndarray
DOUBLES = ctypes.POINTER(ctypes.c_double)

needs_acados = pytest.mark.skipif(not (ACADOS / "lib").exists(), reason="acados is missing; try: make acados")


def turned() -> eomgen.Scene:
    """Return a body on a ball joint with a hinge that a motor drives."""
    builder = SceneBuilder("turned").parameter("drag", 0.3, tunable=True).input("torque")
    builder.body("bob", 1.0, center_of_mass=[0.0, 0.1, -1.0], inertia=[0.1, 0.2, 0.15])
    builder.body("arm", 0.3, center_of_mass=[0.0, 0.1, -0.1], inertia=[0.01, 0.02, 0.015])
    builder.joint("pivot", "spherical", "base", "bob").joint("hinge", "revolute", "bob", "arm", axis=[1, 0, 0])
    return builder.effort("motor", "hinge", "torque - drag * v.hinge").build()


def scene_of(example: str) -> Any:
    return {"turned": turned, "hung": hung}[example]() if example in ("turned", "hung") else EXAMPLES / example


@cache
def folder(example: str, tmp: Path) -> Path:
    eomgen.generate(scene_of(example), tmp / "folder", target="acados")
    return tmp / "folder"


def rate_of(factors: Sequence[Any], q: Any, v: Any) -> Any:
    """Return the rates of the components of q in CasADi's symbols."""
    parts = []
    for factor in factors:
        own = v[factor.v_start : factor.v_start + factor.v_size]
        if factor.group == "R":
            parts.append(own)
            continue
        turning = q[factor.q_start : factor.q_start + 4]
        p = turning / ca.sqrt(ca.sumsqr(turning))
        w, axis = p[0], p[1:]
        parts += [-0.5 * ca.dot(axis, own[:3]), 0.5 * (w * own[:3] + ca.cross(axis, own[:3]))]
        if factor.group == "SE3":
            twice = 2.0 * ca.cross(axis, own[3:])
            parts.append(own[3:] + w * twice + ca.cross(axis, twice))
    return ca.vertcat(*parts)


class Compiled:
    """Functions of a folder with the interface of acados, by the ending of their names."""

    def __init__(self, folder: Path, start: str, *options: str) -> None:
        self.manifest = json.loads((folder / "manifest.json").read_text())
        self.prefix = self.manifest["model"]
        symbols = [name for name in self.manifest["acados"]["symbols"] if name.startswith(f"{self.prefix}_{start}")]
        library = folder / f"{start}{len(options)}.so"
        sources = [str(folder / f"{name}.c") for name in symbols]
        command = ["cc", "-std=c99", "-O1", "-fPIC", "-shared", *options, *sources, "-o", str(library), "-lm"]
        subprocess.run(command, check=True)
        self.library = ctypes.CDLL(str(library))

    def pattern(self, name: str, side: str, k: int) -> tuple[int, int, Sequence[int], Sequence[int]]:
        """Return rows, columns, and the rows and columns of the nonzeros."""
        call = getattr(self.library, f"{name}_sparsity_{side}")
        call.restype = ctypes.POINTER(ctypes.c_int)
        numbers = call(k)
        height, width = numbers[0], numbers[1]
        if numbers[2] == 1:
            return height, width, list(range(height)) * width, np.repeat(range(width), height).tolist()
        starts = numbers[2 : 3 + width]
        rows = numbers[3 + width : 3 + width + starts[-1]]
        return height, width, rows, np.repeat(range(width), np.diff(starts)).tolist()

    def __call__(self, ending: str, *arguments: Array) -> list[Array]:
        name = f"{self.prefix}_{ending}"
        inputs, outputs = (getattr(self.library, f"{name}_n_{side}")() for side in ("in", "out"))
        sizes = (ctypes.c_int * 4)()
        getattr(self.library, f"{name}_work")(*(ctypes.byref(sizes, 4 * k) for k in range(4)))
        assert inputs == len(arguments) == sizes[0] and outputs == sizes[1] and sizes[2] == 0
        given, taken, patterns = (DOUBLES * inputs)(), (DOUBLES * outputs)(), []
        kept: list[Any] = []
        for k, argument in enumerate(arguments):
            flat = np.asarray(argument, float).ravel("F")
            height, width, _, _ = self.pattern(name, "in", k)
            assert len(flat) == height * width
            kept.append(np.append(flat, np.nan))  # a number more, so that an empty array has an address, too
            given[k] = kept[-1].ctypes.data_as(DOUBLES)
        for k in range(outputs):
            patterns.append(self.pattern(name, "out", k))
            kept.append(np.full(len(patterns[-1][2]) + 1, np.nan))
            taken[k] = kept[-1].ctypes.data_as(DOUBLES)
        work = np.full(sizes[3] + 1, np.nan)
        assert getattr(self.library, name)(given, taken, None, work.ctypes.data_as(DOUBLES), None) == 0
        results = []
        for (height, width, rows, columns), values in zip(patterns, kept[inputs:], strict=True):
            whole = np.zeros((height, width))
            whole[rows, columns] = values[:-1]
            assert np.isnan(values[-1])
            results.append(whole)
        assert np.isnan(work[-1])
        return results


def numbers(function: Any, *arguments: Array) -> list[Array]:
    return [np.array(result) for result in function.call([ca.DM(argument) for argument in arguments])]


def expected(functions: Any, factors: Sequence[Any], sizes: dict[str, int], family: str) -> dict[str, Any]:
    """Return the functions of acados by CasADi's derivatives, of functions of the scene for CasADi."""
    names = {name for function in functions.values() for name in function.name_in()}
    timed = "t" in names
    x, u, p = ca.MX.sym("x", sizes["x"]), ca.MX.sym("u", sizes["u"]), ca.MX.sym("p", sizes["p"] + (family == "dyn"))
    xdot, z, lam = ca.MX.sym("xdot", sizes["x"]), ca.MX.sym("z", sizes["z"]), ca.MX.sym("lam", sizes["x"])
    states = functions["internal_rate"].size1_out(0) if "internal_rate" in functions else 0
    n, end = sum(factor.q_size for factor in factors), sizes["x"] - states
    q, v, s = x[:n], x[n:end], x[end:]
    values = {"q": q, "v": v, "z": s, "u": u, "lam": z, "a": xdot[n:end], "x": x}
    values |= {"p": p[: sizes["p"] - timed], "t": p[sizes["p"] - timed : sizes["p"]], "h": p[sizes["p"] :]}

    def of(name: str) -> Any:
        return functions[name](*(values[block] for block in functions[name].name_in()))

    rate = [of("internal_rate")] if states else []
    if family == "impl":
        equation = of("residual" if sizes["z"] else "inverse_dynamics")
        more = [of("constraint_acceleration")] if sizes["z"] else []
        f = ca.vertcat(xdot[:n] - rate_of(factors, q, v), equation, *(xdot[end:] - part for part in rate), *more)
        w, y = ca.MX.sym("w", f.numel()), ca.vertcat(x, xdot, z, u)
        blocks = {"x": x, "xdot": xdot, "u": u, "z": z}
        jacobians = {name: ca.jacobian(f, block) for name, block in blocks.items()}
        inputs = [x, xdot, u, z, p]
        made = {"impl_dae_fun": (inputs, [f]), "impl_dae_jac_x_xdot_u_z": (inputs, list(jacobians.values()))}
        for ending in ("x_xdot_z", "x_xdot_u_z", "x_xdot_u"):
            made[f"impl_dae_fun_jac_{ending}"] = inputs, [f, *(jacobians[name] for name in ending.split("_"))]
        made["impl_dae_hess"] = [x, xdot, u, z, w, p], [ca.hessian(ca.dot(w, f), y)[0]]
    elif family == "expl":
        f, y = ca.vertcat(rate_of(factors, q, v), of("forward_dynamics"), *rate), ca.vertcat(x, u)
        Sx, Su = ca.MX.sym("Sx", x.numel(), x.numel()), ca.MX.sym("Su", x.numel(), u.numel())
        S = ca.vertcat(ca.horzcat(Sx, Su), ca.horzcat(ca.DM(u.numel(), x.numel()), ca.DM.eye(u.numel())))
        A, B, adj = ca.jacobian(f, x), ca.jacobian(f, u), ca.jtimes(f, y, lam, True)
        H = S.T @ ca.hessian(ca.dot(lam, f), y)[0] @ S
        triangle = ca.vertcat(*(H[k:, k] for k in range(y.numel())))
        made = {
            "expl_ode_fun": ([x, u, p], [f]),
            "expl_vde_forw": ([x, Sx, Su, u, p], [f, A @ Sx, A @ Su + B]),
            "expl_vde_adj": ([x, lam, u, p], [adj]),
            "expl_ode_hess": ([x, Sx, Su, lam, u, p], [adj, triangle]),
        }
    else:
        phi, y = of("step"), ca.vertcat(u, x)
        first, second = ca.jacobian(phi, y).T, ca.hessian(ca.dot(lam, phi), y)[0]
        made = {
            "dyn_disc_phi_fun": ([x, u, p], [phi]),
            "dyn_disc_phi_fun_jac": ([x, u, p], [phi, first]),
            "dyn_disc_phi_fun_jac_hess": ([x, u, lam, p], [phi, first, second]),
        }
    return {name: ca.Function(name, *pair) for name, pair in made.items()}


@pytest.mark.slow
@pytest.mark.long_except("double_pendulum_on_shaking_base/scene.toml-impl", "pi_servo/scene.toml-expl")
@pytest.mark.parametrize(
    ("example", "family"),
    [
        *(("double_pendulum_on_shaking_base/scene.toml", family) for family in ("expl", "impl", "dyn")),
        *(("turned", family) for family in ("expl", "impl", "dyn")),
        *(("hung", family) for family in ("impl", "dyn")),
        *(("pi_servo/scene.toml", family) for family in ("expl", "dyn")),
    ],
)
def test_functions_are_those_of_acados_formulas(
    example: str, family: str, tmp_path: Path, rng: np.random.Generator
) -> None:
    """By CasADi's derivatives of the scene's functions."""
    scene, compiled = scene_of(example), Compiled(folder(example, tmp_path), family)
    functions, system = eomgen.casadi(scene, profile="quick"), eomgen.derive(scene, ["mass"])
    sizes = compiled.manifest["acados"]["sizes"]
    for name, function in expected(functions, system.factors, sizes, family).items():
        for _ in range(3):
            point = [rng.normal(size=function.size_in(k)) for k in range(function.n_in())]
            if family == "dyn" and system.multipliers:  # near the constraints, or the step has no solution
                point[0] = np.concatenate(
                    [system.initial_q, 0.1 * rng.normal(size=len(point[0]) - len(system.initial_q))]
                )
            for factor in (factor for factor in system.factors if factor.group != "R"):
                turning = point[0][factor.q_start : factor.q_start + 4]
                turning /= np.linalg.norm(turning)
            p = point[-1]
            p[: compiled.manifest["sizes"]["p"], 0] = rng.uniform(0.5, 1.5, compiled.manifest["sizes"]["p"])
            if family == "dyn":
                p[-1] = 0.02
            for found, wanted in zip(compiled(name, *point), numbers(function, *point), strict=True):
                assert found.shape == wanted.shape, name
                assert np.max(np.abs(found - wanted), initial=0.0) <= 1e-12 * np.max(np.abs(wanted), initial=1.0), name


def solved(folder: Path, kind: str, hessian: str, model: Any, solver: Any) -> tuple[int, float, int]:
    """Return status, cost and iterations of a swing-up by SQP."""
    from acados_template import AcadosOcp  # installed apart

    folder.mkdir()
    ocp, nodes = AcadosOcp(), 20
    ocp.model, ocp.dims.N, ocp.code_export_directory = model, nodes, str(folder / "c")
    ocp.cost.cost_type = ocp.cost.cost_type_e = "LINEAR_LS"
    ocp.cost.W, ocp.cost.yref = np.diag([1.0, 1.0, 0.1, 0.1, 0.01]), np.zeros(5)
    ocp.cost.Vx, ocp.cost.Vu = np.eye(5, 4), np.eye(5)[:, 4:]
    ocp.cost.W_e, ocp.cost.Vx_e, ocp.cost.yref_e = np.eye(4) * 10.0, np.eye(4), np.array([0.5, 0.0, 0.0, 0.0])
    ocp.constraints.x0 = np.array([0.0, 0.4, 0.0, 0.0])
    ocp.constraints.idxbu, ocp.constraints.lbu, ocp.constraints.ubu = np.array([0]), np.array([-9.0]), np.array([9.0])
    options = ocp.solver_options
    options.tf, options.integrator_type, options.hessian_approx, options.nlp_solver_type = 1.0, kind, hessian, "SQP"
    made = solver(ocp, json_file=str(folder / "ocp.json"))
    status = made.solve()
    return status, made.get_cost(), int(np.ravel(made.get_stats("sqp_iter"))[0])


@pytest.mark.long_cases("ERK-GAUSS_NEWTON")
@needs_acados
@pytest.mark.usefixtures("acados")
@pytest.mark.long_except_every(4)
@pytest.mark.parametrize(
    ("kind", "hessian"),
    [
        ("ERK", "GAUSS_NEWTON"),
        *(
            pytest.param(kind, hessian, marks=pytest.mark.slow)
            for kind, hessian in (("ERK", "EXACT"), ("IRK", "GAUSS_NEWTON"), ("IRK", "EXACT"), ("DISCRETE", "EXACT"))
        ),
    ],
)
def test_a_solver_of_acados_has_the_optimum_and_iterations_of_one_made_by_casadi(
    kind: str, hessian: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    eomgen.generate(CART_POLE, tmp_path / "folder", target="acados")
    monkeypatch.syspath_prepend(str(tmp_path / "folder"))
    own = runpy.run_path(str(tmp_path / "folder" / "cart_pole_acados.py"))
    template = sys.modules["acados_template"]
    native, demo = template.AcadosModel(), runpy.run_path(str(EXAMPLES / "cart_pole_swing_up" / "demo.py"))
    native.name = "native"
    p = own["parameters"](kind, step=0.05)
    x, xdot, u = ca.SX.sym("x", 4), ca.SX.sym("xdot", 4), ca.SX.sym("u")
    native.x, native.xdot, native.u, native.p = x, xdot, u, ca.SX.sym("p", len(p))
    native.f_expl_expr = demo["native_rate"](x, u, native.p)
    native.f_impl_expr = xdot - native.f_expl_expr
    if kind == "DISCRETE":
        native.disc_dyn_expr = demo["native_step"]()(x, u, native.p[:3], native.p[3])

    def by_casadi(ocp: Any, json_file: str) -> Any:
        ocp.parameter_values = p
        return template.AcadosOcpSolver(ocp, json_file=json_file, verbose=False)

    found = solved(tmp_path / "own", kind, hessian, own["model"](kind), own["solver"])
    wanted = solved(tmp_path / "native", kind, hessian, native, by_casadi)
    assert found[0] == wanted[0] == 0
    assert found[1] == pytest.approx(wanted[1], rel=1e-9)
    assert abs(found[2] - wanted[2]) <= (1 if kind == "IRK" else 0)


@pytest.fixture
def acados(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let acados be found, and write its files to a folder of the test."""
    monkeypatch.setenv("ACADOS_SOURCE_DIR", str(ACADOS))
    monkeypatch.chdir(tmp_path)


def integrator_of(scene: Any, name: str, kind: str, step: float, tmp: Path) -> tuple[dict[str, Any], Any]:
    """Return the module that is written for acados, and an integrator of acados over its functions."""
    eomgen.generate(scene, tmp / "folder", target="acados")
    own = runpy.run_path(str(tmp / "folder" / f"{name}_acados.py"))
    sim = sys.modules["acados_template"].AcadosSim()
    sim.model, sim.code_export_directory = own["model"](kind), str(tmp / "c")
    options = sim.solver_options
    options.T, options.integrator_type, options.num_stages = step, kind, 4 if kind == "ERK" else 3
    options.newton_iter, options.newton_tol = 20, 1e-13
    return own, own["integrator"](sim, json_file=str(tmp / "sim.json"))


@pytest.mark.long
@needs_acados
@pytest.mark.slow
@pytest.mark.usefixtures("acados")
def test_an_integrator_of_acados_follows_a_loop_with_its_multipliers_as_algebraic_variables(tmp_path: Path) -> None:
    scene = EXAMPLES / "four_bar" / "scene.toml"
    own, integrator = integrator_of(scene, "four_bar", "IRK", 1e-3, tmp_path)
    model = eomgen.build(scene, profile="quick")
    run = model.simulate(0.1, 1e-5, record_every=100)
    state = np.concatenate([run.q[0], run.v[0]])
    assert own["X0"] == pytest.approx(state, abs=1e-9)
    for k in range(1, 101):
        integrator.set("x", state)
        assert integrator.solve() == 0
        state = integrator.get("x")
        assert state == pytest.approx(np.concatenate([run.q[k], run.v[k]]), abs=2e-5)
    assert np.max(np.abs(model.evaluate("constraint", state[:3])["Phi"])) < 1e-7


@pytest.mark.long
@needs_acados
@pytest.mark.slow
@pytest.mark.usefixtures("acados")
def test_a_receding_horizon_swings_a_heavier_pole_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    demo = runpy.run_path(str(EXAMPLES / "receding_horizon" / "demo.py"))
    loop = demo["controlled"](demo["controller"](tmp_path), 2.5)
    assert np.max(np.abs(loop.u)) == pytest.approx(demo["FORCE"], rel=1e-6)
    assert loop.x[-1] == pytest.approx(demo["UPRIGHT"], abs=0.1)
    assert np.median(loop.seconds) < demo["SAMPLE"]


@pytest.mark.parametrize("modern", [False, True])
def test_the_length_of_a_step_follows_the_number_of_nodes(
    modern: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """acados has the number in ``solver_options.N_horizon`` from version 0.4 on, and in ``dims.N`` before."""
    eomgen.generate(CART_POLE, tmp_path / "c", ["forward_dynamics"], target="acados")

    def generate(ocp: Any, json_file: str) -> None:
        raise InterruptedError(json_file)

    solver = SimpleNamespace(generate=generate)
    template: Any = SimpleNamespace(AcadosModel=solver, AcadosOcpSolver=solver, AcadosSimSolver=solver)
    monkeypatch.setitem(sys.modules, "acados_template", template)
    made = runpy.run_path(str(tmp_path / "c" / "cart_pole_acados.py"))
    options = SimpleNamespace(tf=2.0, integrator_type="DISCRETE", **({"N_horizon": 40} if modern else {}))
    ocp = SimpleNamespace(solver_options=options, dims=SimpleNamespace(N=None if modern else 40), parameter_values=[])
    with pytest.raises(InterruptedError):
        made["solver"](ocp)
    assert ocp.parameter_values.tolist() == [*made["PARAMETERS"].values(), 0.05]
    with pytest.raises(ValueError, match="cart_pole has no functions for the integrator 'IRK'; try: one of ERK, DISC"):
        made["parameters"]("IRK")


def test_mistakes_are_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for described, term, said in (
        (CART_POLE, "mass", "terms: the target acados writes dynamics with derivatives, and 'mass' is none; try: one"),
        (CART_POLE, "internal_rate", "cart_pole has none of the functions that the terms name; try: no terms, for all"),
        (SERVO, "internal_rate", "terms: no dynamics for acados are among the terms; try: inverse_dynamics, forward_"),
    ):
        with pytest.raises(eomgen.UsageError, match=said):
            eomgen.generate(described, tmp_path / "c", [term], target="acados")
    eomgen.generate(CART_POLE, tmp_path / "c", target="acados")
    monkeypatch.delenv("ACADOS_SOURCE_DIR", raising=False)
    monkeypatch.setitem(sys.modules, "acados_template", None)
    with pytest.raises(ImportError, match="acados_template is not installed; try: the installation of acados"):
        runpy.run_path(str(tmp_path / "c" / "cart_pole_acados.py"))
