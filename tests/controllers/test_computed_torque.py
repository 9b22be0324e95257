"""Controllers around the inverse dynamics: the plug-in of ROS 2, and C in float for a Cortex-M4."""

from __future__ import annotations

import ctypes
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.toolchain.compiler import zig_program
from tests.models.library import scene

HERE = Path(__file__).parent
ROBOT = """\
<robot name="Arm">
  <link name="foot"/>
  <link name="upper"><inertial><origin xyz="0.02 0 0.2" rpy="0.1 0 0"/><mass value="4"/>
    <inertia ixx="0.06" ixy="0.003" ixz="0.001" iyy="0.07" iyz="-0.002" izz="0.03"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0.01 0.15"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.004"/></inertial></link>
  <link name="tool"><inertial><origin xyz="0 0 0.05"/><mass value="0.5"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0012"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="foot"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-1.2" upper="1.5" effort="50" velocity="3"/><dynamics damping="0.7"/></joint>
  <joint name="el-bow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/>
    <axis xyz="0.6 0.8 0"/></joint>
  <joint name="wrist" type="prismatic"><parent link="lower"/><child link="tool"/>
    <origin xyz="0 0.02 0.4" rpy="0 0.1 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.2" effort="80" velocity="1"/></joint>
</robot>
"""
JOINTS, N = ("shoulder", "el-bow", "wrist"), 3
LIMITS = [50.0, 1e30, 80.0]
STRICT = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-pedantic", "-Werror"]
FLOAT = [*STRICT, "-DEOMGEN_REAL_FLOAT", "-Wdouble-promotion", "-Wfloat-conversion"]
CORTEX_M4 = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
CROSS = shutil.which("arm-none-eabi-gcc")


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ROBOT, encoding="utf-8")
    return tmp_path / "arm.urdf"


# -- ROS 2 -------------------------------------------------------------------------------------------------------------


def write_headers(folder: Path, distribution: str) -> None:
    """Write the headers of ROS 2 that a plug-in includes, each of which is the stand-in."""
    buffer = "hpp" if distribution == "JAZZY" else "h"
    for file in (
        "controller_interface/controller_interface.hpp", "pluginlib/class_list_macros.hpp", "rclcpp/rclcpp.hpp",
        f"realtime_tools/realtime_buffer.{buffer}", "trajectory_msgs/msg/joint_trajectory_point.hpp",
    ):  # fmt: skip  # a list
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(f'#include "{HERE / "stand_in.hpp"}"\n', encoding="utf-8")


def plug_in(folder: Path, distribution: str) -> Path:
    """Return the program that drives the plug-in of a package, which CMake builds with the stand-in of ROS 2."""
    modules, headers = folder / "modules", folder / "headers"
    write_headers(headers, distribution)
    modules.mkdir()
    shutil.copy(HERE / "Findament_cmake.cmake", modules)
    for name in re.findall(r"<depend>(\w+)</depend>", (folder / "package.xml").read_text(encoding="utf-8")):
        (modules / f"Find{name}.cmake").write_text(f"set({name}_FOUND TRUE)\n", encoding="utf-8")
    variables = {"CMAKE_MODULE_PATH": modules, "STAND_IN": headers, "DISTRIBUTION": distribution}
    given = [f"-D{name}={value}" for name, value in variables.items()]
    for words in (["-S", ".", "-B", "build", *given], ["--build", "build"]):
        subprocess.run(["cmake", *words], cwd=folder, check=True, capture_output=True)
    library = next((folder / "build").glob("lib*"))
    words = ["g++", "-std=c++17", f"-D{distribution}", str(HERE / "drive.cpp"), str(library), "-o", "drive"]
    subprocess.run([*words, f"-Wl,-rpath,{library.parent}"], cwd=folder, check=True)
    return folder / "drive"


def efforts(program: Path, rows: Any, *parameters: str, code: int = 0) -> tuple[list[str], np.ndarray, str]:
    """Return the first line of the driver, efforts and status of each cycle, and the last line."""
    text = "".join(" ".join(f"{number:.17g}" for number in row) + "\n" for row in rows)
    ended = subprocess.run([program, *parameters], input=text, capture_output=True, text=True, check=False)
    assert ended.returncode == code, ended.stderr
    first, *lines = ended.stdout.splitlines() or [""]
    table = np.array([[float(word) for word in line.split()] for line in lines[:-1]])
    return first.split(), table, lines[-1] if lines else ended.stderr.strip()


@pytest.mark.long
@pytest.mark.parametrize("distribution", ["JAZZY", "HUMBLE"])
@pytest.mark.skipif(shutil.which("cmake") is None, reason="builds by CMake")
def test_the_plug_in_of_ros_gives_the_bits_of_inverse_dynamics(
    robot: Path, tmp_path: Path, distribution: str, rng: np.random.Generator
) -> None:
    arm = eomgen.load(robot, tunable=["tool"])
    eomgen.generate(arm, tmp_path / "c", target="ros2")
    program = plug_in(tmp_path / "c", distribution)
    model = eomgen.build(arm, ["inverse_dynamics"], profile="reproducible")
    q, v, goal_q, goal_v, goal_a = rng.uniform(-1.5, 1.5, (5, 40, N))
    q[:, 2] *= 0.06
    k, d = np.array([100.0, 64.0, 400.0]), np.array([20.0, 16.0, 40.0])
    gains = [f"position_gains={','.join(map(str, k))}", f"velocity_gains={','.join(map(str, d))}"]
    _, cut, _ = efforts(program, np.hstack([q, v, goal_q, goal_v, goal_a]), *gains)
    gains.append("effort_limits=1e30,1e30,1e30")
    first, found, last = efforts(program, np.hstack([q, v, goal_q, goal_v, goal_a]), *gains)
    states = [f"{joint}/{kind}" for joint in JOINTS for kind in ("position", "velocity")]
    assert first == ["~/goal", *(f"{joint}/effort" for joint in JOINTS), *states]
    wanted = model.inverse_dynamics(q, v, goal_a + k * (goal_q - q) + d * (goal_v - v))
    assert np.array_equal(found[:, :N], wanted) and not found[:, N].any()
    assert np.array_equal(cut[:, :N], np.clip(wanted, -np.array(LIMITS), LIMITS)) and (cut != found).any()
    assert last == "allocations 0, efforts at the end 0"
    # without a goal the position of the activation is held; without gains the weight is carried
    _, found, _ = efforts(program, [[*q[0], *v[0]], [*q[1], *v[1]]], *gains)
    hold = [model.inverse_dynamics(q[i], v[i], k * (q[0] - q[i]) + d * (0.0 - v[i])) for i in range(2)]
    assert np.array_equal(found[:, :N], hold)
    zeros = ["position_gains=0,0,0", "velocity_gains=0,0,0", "model.tool_mass=3"]
    _, found, _ = efforts(program, [[*q[0], 0, 0, 0]], *zeros)
    weight = model.inverse_dynamics(q[0], np.zeros(N), np.zeros(N), parameters={"tool_mass": 3.0})
    assert np.array_equal(found[0, :N], weight)
    _, found, _ = efforts(program, [[*q[0], *v[0], 1.0, 1.0, 1.0]], "effort_limits=1,2,3")
    assert np.array_equal(np.abs(found[0, :N]), [1.0, 2.0, 3.0])
    _, found, _ = efforts(program, [[*q[0], *v[0], 1.0, float("nan"), 0.0]])
    assert np.array_equal(found[0], [0.0, 0.0, 0.0, 1.0])  # return_type::ERROR
    _, _, told = efforts(program, [], "position_gains=1,2", code=3)
    assert told == "joints and position_gains: 3 entries each are needed"
    for limit in ("-2", "nan"):
        _, _, told = efforts(program, [], f"effort_limits=1,{limit},3", code=3)
        assert told == f"effort_limits: {limit}, and no number from 0 on"


@pytest.mark.parametrize(
    ("name", "package"), [("_7axis_", "robot_7axis_controller"), ("_bot__two", "bot_two_controller")]
)
def test_names_of_packages_begin_with_a_letter_and_have_single_underscores(
    name: str, package: str, tmp_path: Path
) -> None:
    text = (HERE.parents[1] / "examples" / "robot_arm" / "scene.toml").read_text(encoding="utf-8")
    (tmp_path / "robot.toml").write_text(text.replace('name = "robot_arm"', f'name = "{name}"'), encoding="utf-8")
    eomgen.generate(tmp_path / "robot.toml", tmp_path / "c", target="ros2")
    assert f"<name>{package}</name>" in (tmp_path / "c" / "package.xml").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("distribution", ["JAZZY", "HUMBLE"])
def test_the_plug_in_fits_the_headers(robot: Path, tmp_path: Path, distribution: str) -> None:
    eomgen.generate(eomgen.load(robot, tunable=["tool"]), tmp_path / "c", target="ros2")
    write_headers(tmp_path / "headers", distribution)
    words = ["g++", "-std=c++17", f"-D{distribution}", "-Wall", "-Wextra", "-pedantic", "-Werror", "-I../headers"]
    subprocess.run([*words, "-fsyntax-only", "arm_controller_plugin.cpp"], cwd=tmp_path / "c", check=True)


@pytest.mark.slow
def test_the_step_in_double_has_the_bits_of_inverse_dynamics(
    robot: Path, tmp_path: Path, rng: np.random.Generator
) -> None:
    eomgen.generate(robot, tmp_path / "c", target="ros2")
    words = ["gcc", *STRICT, "-fPIC", "-shared", "Arm.c", "arm_controller.c", "-o", "step.so", "-lm"]
    subprocess.run(words, cwd=tmp_path / "c", check=True)
    library = ctypes.CDLL(str(tmp_path / "c" / "step.so"))
    memory = np.zeros(1 + 9 * N)  # parameters; gains, limits, goals, q, v, tau
    pointer = memory.ctypes.data_as(ctypes.c_void_p)
    library.arm_controller_start(pointer)
    k, d, limit, goal_q, goal_v, goal_a, q, v, tau = memory[1:].reshape(9, N)
    assert (k == 100.0).all() and (d == 20.0).all() and np.array_equal(limit, LIMITS)
    limit[:] = 1e30
    memory[1 + 3 * N : 1 + 8 * N] = rng.uniform(-0.1, 0.1, 5 * N)
    wanted = eomgen.build(robot, ["inverse_dynamics"], profile="reproducible").inverse_dynamics(
        q, v, goal_a + k * (goal_q - q) + d * (goal_v - v)
    )
    assert library.arm_controller_step(pointer) == 0
    assert np.array_equal(tau, wanted) and np.abs(tau).max() > 1.0
    goal_a[1] = np.inf
    assert library.arm_controller_step(pointer) == 1
    assert not tau.any()


def test_a_package_of_ros_names_its_parts_alike(robot: Path, tmp_path: Path) -> None:
    eomgen.generate(robot, tmp_path / "c", target="ros2", terms=["mass"])
    texts = {file.name: file.read_text(encoding="utf-8") for file in (tmp_path / "c").iterdir()}
    assert "<name>arm_controller</name>" in texts["package.xml"]
    assert 'type="arm_controller_plugin::InverseDynamics"' in texts["arm_controller_plugin.xml"]
    assert "namespace arm_controller_plugin\n" in texts["arm_controller_plugin.cpp"]
    assert 'joints: ["shoulder", "el-bow", "wrist"]' in texts["arm_controller.yaml"]  # names of the URDF
    assert "effort_limits: [50.0, 1.0e+30, 80.0]" in texts["arm_controller.yaml"]
    assert (
        "add_library(arm_controller SHARED Arm.c arm_controller.c arm_controller_plugin.cpp)" in texts["CMakeLists.txt"]
    )
    assert (
        '/arm_controller/goal trajectory_msgs/msg/JointTrajectoryPoint \\\n        "positions: [0.1, 0.1, 0.1]"'
        in texts["README.md"]
    )
    assert json.loads(texts["manifest.json"])["functions"].keys() == {"inverse_dynamics", "mass"}


# -- Cortex-M4 ---------------------------------------------------------------------------------------------------------


def compiled(folder: Path, *flags: str, compiler: str = "gcc") -> int:
    """Compile the C files of a folder to objects, and return the sum of the stacks of the three deepest functions."""
    sources = [file.name for file in folder.glob("*.c") if file.name != "main.c"]
    subprocess.run([compiler, *FLOAT, *flags, "-fstack-usage", "-c", *sources], cwd=folder, check=True)
    usage = "".join(file.read_text(encoding="utf-8") for file in folder.glob("*.su"))
    return sum(sorted(map(int, re.findall(r"\t(\d+)\t", usage)))[-3:])


def facts(folder: Path) -> dict[str, int]:
    return dict(json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["cortex_m4"])


@pytest.mark.slow
def test_the_step_in_float_is_inverse_dynamics_in_float(robot: Path, tmp_path: Path) -> None:
    assert main(["generate", str(robot), "--target", "cortex-m4", "--out", str(tmp_path / "c")]) == 0
    folder = tmp_path / "c"
    assert compiled(folder) <= facts(folder)["stack"] < 2000
    text = (folder / "main.c").read_text(encoding="utf-8")
    text = text.replace("return status;", 'printf("%d\\n", (int)sizeof c); return status;')
    (folder / "main.c").write_text(text, encoding="utf-8")
    program = [*FLOAT, "main.c", "Arm.o", "arm_controller.o", "-o", "arm", "-lm"]
    subprocess.run(["gcc", *program], cwd=folder, check=True)
    told = subprocess.run([folder / "arm"], capture_output=True, text=True, check=True).stdout
    *tau, size = map(float, told.split())
    model = eomgen.build(robot, ["inverse_dynamics"])
    wanted = np.clip(model.inverse_dynamics(np.zeros(N), np.zeros(N), np.full(N, 50.0)), *np.outer([-1, 1], LIMITS))
    np.testing.assert_allclose(tau, wanted, rtol=2e-6)
    assert size == facts(folder)["data"] == 4 * (9 * N + 1)
    ended = subprocess.run(["gcc", "-c", "arm_controller.c"], cwd=folder, capture_output=True, text=True, check=False)
    assert "compile all files with -DEOMGEN_REAL_FLOAT" in ended.stderr


def test_cycles_are_counted_from_operations(robot: Path, tmp_path: Path) -> None:
    eomgen.generate(robot, tmp_path / "c", target="cortex-m4")
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    counts = manifest["functions"]["inverse_dynamics"]["counts"]
    plain = counts["additions"] + counts["multiplications"] + counts["selections"]
    cycles = plain + 14 * counts["divisions"] + 26 * counts["functions"] + 16 * N
    assert manifest["cortex_m4"]["cycles"] == cycles and counts["functions"] == 4 and counts["multiplications"] > 100
    assert f"| {cycles} cycles, an estimate" in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")


@pytest.mark.skipif(CROSS is None, reason="arm-none-eabi-gcc is not installed")
def test_the_processor_computes_in_float_alone(robot: Path, tmp_path: Path) -> None:
    eomgen.generate(robot, tmp_path / "c", target="cortex-m4")
    folder = tmp_path / "c"
    assert compiled(folder, *CORTEX_M4, compiler="arm-none-eabi-gcc") <= facts(folder)["stack"]
    listed = subprocess.run(["arm-none-eabi-nm", "-u", *folder.glob("*.o")], capture_output=True, text=True, check=True)
    outside = set(re.findall(r" U (\w+)", listed.stdout))
    assert outside <= {"Arm_default_parameters", "Arm_inverse_dynamics", "memset", "memcpy"}  # no __aeabi_dmul


@pytest.mark.slow
@pytest.mark.skipif(zig_program() is None, reason="the package ziglang is not installed")
def test_an_object_of_zig_keeps_to_the_stack(robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["generate", str(robot), "--target", "cortex-m4", "--for", "cortex-m4", "--out", str(tmp_path / "c")]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    (made,) = told["machines"]
    assert made["stack"] <= facts(tmp_path / "c")["stack"] and told["step"] == {}
    assert b"__aeabi_d" not in Path(made["file"]).read_bytes()


# -- refusals ----------------------------------------------------------------------------------------------------------

MISTAKES = {
    "free_body": "has more numbers than a position; try: hinges and slides, one for each drive",
    "slider_crank": "its loops are closed by constraints, so a position does not determine the efforts; try: actuator_",
    "double_pendulum_on_shaking_base/scene": "its inverse dynamics depends on the motion of its base",
}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--target", "ros2", "--real", "float"], "real: the files of ros2 have no stepper and one number type"),
        (["--target", "cortex-m4", "--method", "rk4"], "method: the files of cortex-m4 have no stepper and one number"),
        (["--target", "ros2", "--target", "c"], "--target: ros2, c have a folder each"),
    ],
)
def test_options_without_effect_are_refused(
    words: list[str], told: str, robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["generate", str(robot), *words, "--out", str(tmp_path / "c")]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize("target", ["ros2", "cortex-m4"])
@pytest.mark.parametrize("name", MISTAKES)
def test_machines_without_a_controller_are_refused(name: str, target: str, tmp_path: Path) -> None:
    with pytest.raises(eomgen.ModelError, match=re.escape(MISTAKES[name])):
        eomgen.generate(scene(name), tmp_path / "c", target=target)
    assert not (tmp_path / "c").exists()
