"""Functions on a card, by the stand-in: bits of the processor for arrays of every kind, and messages of refused
calls."""

from __future__ import annotations

import ctypes
import re
import threading
import time
import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import ModelError, NumericalError, ToolchainError, UsageError
from eomgen.products.gpu import driver, nvrtc
from eomgen.products.gpu.functions import GpuFunctions
from eomgen.products.gpu.kernels import compile_term
from eomgen.products.gpu.requirements import card
from tests.gpu.arrays_on_card import OnCard, cupy_array, forget

PENDULUM = "examples/double_pendulum_on_shaking_base/scene.toml"
SERVO = "examples/pi_servo/scene.toml"
FOUR_BAR = "examples/four_bar/scene.toml"
CAR = "examples/active_quarter_car/scene.toml"  # with inputs by formulas, and partials that depend on time in steps
ARM = "examples/robot_arm/scene.toml"  # forward dynamics alone have another order of operations
SAMPLES = 7


@cache
def model_of(scene: str, real: str = "double") -> Any:
    """Return the model of a scene with the bits of every machine."""
    return eomgen.build(scene, profile="reproducible", real=real)


def states(model: Any, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, v and a of some samples."""
    generator = np.random.default_rng(seed)
    q = model.initial_q + generator.uniform(-0.5, 0.5, (SAMPLES, model.nq))
    return q, generator.uniform(-1, 1, (SAMPLES, model.nv)), generator.uniform(-1, 1, (SAMPLES, model.nv))


def rows(array: Any) -> Any:
    return cupy_array(array)


def columns(array: Any) -> Any:
    return cupy_array(array, "F")


def every_second(array: Any) -> Any:
    """Return an array whose rows and numbers are apart in memory."""
    wide = np.zeros((2 * array.shape[0], 3 * array.shape[1]), array.dtype)
    wide[::2, ::3] = array
    return cupy_array(wide)[::2, ::3]


@pytest.mark.usefixtures("stand_in", "cupy")
@pytest.mark.parametrize("form", [rows, columns, every_second])
def test_arrays_in_place_give_the_bits_of_the_processor(form: Callable[[Any], Any]) -> None:
    model = model_of(PENDULUM)
    q, v, a = states(model)
    functions = eomgen.gpu(model)
    result = functions.inverse_dynamics(form(q), form(v), rows(a), 0.3)
    assert type(result) is type(rows(q))
    assert np.array_equal(result, model.inverse_dynamics(q, v, a, 0.3))
    assert result.flags.f_contiguous == (form is columns)


@pytest.mark.slow_cases("servo", "four_bar", "car", "arm")
@pytest.mark.usefixtures("stand_in")
@pytest.mark.filterwarnings("ignore:the arrays are NumPy's")
@pytest.mark.parametrize(
    "scene", [PENDULUM, SERVO, FOUR_BAR, CAR, ARM], ids=["pendulum", "servo", "four_bar", "car", "arm"]
)
def test_all_terms_have_the_bits_of_the_processor(scene: str) -> None:
    model = model_of(scene)
    q, v, a = states(model)
    functions = eomgen.gpu(model)
    for term in model.terms if scene in (SERVO, FOUR_BAR) else ("forward_dynamics", "partials", "outputs"):
        expected, found = model.evaluate(term, q, v, a, 0.2), functions.evaluate(term, q, v, a, 0.2)
        assert list(found) == list(expected)
        for name, values in expected.items():
            assert np.array_equal(found[name], values), (term, name)


@pytest.mark.usefixtures("cupy")
@pytest.mark.slow_cases("partials")
@pytest.mark.parametrize("term", ["mass", "partials"])
def test_long_outputs_in_rows_have_a_kernel_of_their_own(stand_in: ctypes.CDLL, term: str) -> None:
    model = model_of(ARM)
    functions, arrays = eomgen.gpu(model), states(model)
    kernels = [f"robot_arm_{term}{ending}_kernel".encode() for ending in ("", "_rows")]
    for form, loaded in ((rows, [0, 1]), (columns, [1, 0])):
        before = [stand_in.stand_in_calls(name) for name in kernels]
        found = functions.evaluate(term, *map(form, arrays if term == "partials" else arrays[:1]))
        assert [stand_in.stand_in_calls(name) - n for name, n in zip(kernels, before, strict=True)] == loaded
        for name, expected in model.evaluate(term, *arrays).items():
            assert np.array_equal(found[name], expected)


@pytest.mark.usefixtures("stand_in", "cupy")
def test_arguments_broadcast_as_on_the_processor() -> None:
    model = model_of(PENDULUM)
    q, v, _ = states(model)
    functions, masses = eomgen.gpu(model), np.linspace(0.4, 0.9, SAMPLES)[:, None]
    found = functions.forward_dynamics(rows(q), rows(v[:1]), parameters=rows(masses))
    assert np.array_equal(found, model.forward_dynamics(q, v[:1], parameters=masses))
    found = functions.forward_dynamics(rows(q[:, None]), rows(v[None, :3]), parameters={"m2": 0.5})
    assert np.array_equal(found, model.forward_dynamics(q[:, None], v[None, :3], parameters={"m2": 0.5}))
    times = np.linspace(0.0, 1.0, SAMPLES)
    found = functions.forward_dynamics(rows(q), rows(v), rows(times))
    assert np.array_equal(found, model.forward_dynamics(q, v, times))
    assert functions.forward_dynamics(rows(q[:0]), rows(v[:0])).shape == (0, 2)
    many = np.tile(q, (50, 1))  # in three blocks of threads
    assert np.array_equal(functions.forward_dynamics(rows(many), rows(v[0])), model.forward_dynamics(many, v[0]))


@pytest.mark.usefixtures("cupy")
def test_results_can_be_given_and_streams_chosen(stand_in: ctypes.CDLL) -> None:
    model = model_of(PENDULUM)
    q, v, a = states(model)
    functions, out = eomgen.gpu(model), cupy_array(np.zeros((SAMPLES, 4)))[:, ::2]
    assert functions.inverse_dynamics(rows(q), rows(v), rows(a), out=out) is out
    assert np.array_equal(out, model.inverse_dynamics(q, v, a)) and stand_in.stand_in_stream() == 77
    functions.inverse_dynamics(rows(q), rows(v), rows(a), out=out, stream=5)
    assert stand_in.stand_in_stream() == 5
    with pytest.raises(UsageError, match=r"out: the shape is \(7, 3\), \(7, 2\) is needed"):
        functions.inverse_dynamics(rows(q), rows(v), rows(a), out=cupy_array(np.zeros((SAMPLES, 3))))
    for wrong in (np.zeros((SAMPLES, 2)), "here", [out, out]):
        with pytest.raises(UsageError, match="out: an array of the package of the arguments is needed for tau each"):
            functions.inverse_dynamics(rows(q), rows(v), rows(a), out=wrong)
    with pytest.raises(UsageError, match=r"stream: the handle of a stream is needed, not object; try: stream\.ptr"):
        functions.inverse_dynamics(rows(q), rows(v), rows(a), stream=object())
    with pytest.raises(UsageError, match=r"do not broadcast: q \(7,\), v \(3,\), a \(7,\)"):
        functions.inverse_dynamics(rows(q), rows(v[:3]), rows(a))


@pytest.mark.usefixtures("stand_in")
def test_arrays_by_dlpack_are_read_and_results_written() -> None:
    model = model_of(PENDULUM)
    q, v, a = states(model)
    functions, out = eomgen.gpu(model), OnCard(np.zeros((SAMPLES, 2)))
    functions.inverse_dynamics(OnCard(q), OnCard(np.asfortranarray(v)), OnCard(a[0]), out=out)
    assert np.array_equal(out.array, model.inverse_dynamics(q, v, a[0]))
    result = functions.inverse_dynamics(OnCard(np.asfortranarray(q)), OnCard(v), OnCard(a[0]))
    made = result.__cuda_array_interface__
    assert made["shape"] == (SAMPLES, 2) and made["strides"] == (8, 8 * SAMPLES)
    numbers = (ctypes.c_double * (2 * SAMPLES)).from_address(made["data"][0])
    assert np.array_equal(np.reshape(numbers, (2, SAMPLES)).T, out.array)


def test_numpy_arrays_are_copied_with_one_warning(stand_in: ctypes.CDLL) -> None:
    model = model_of(PENDULUM)
    q, v, a = states(model)
    functions, expected = eomgen.gpu(model), model.inverse_dynamics(q, v, a)
    with pytest.warns(RuntimeWarning, match="the arrays are NumPy's") as raised:
        found = functions.inverse_dynamics(q, v, a)
    assert np.array_equal(found, expected) and raised[0].filename == __file__
    held = stand_in.stand_in_memory()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(functions.inverse_dynamics(q.tolist(), v, a), expected)
    assert stand_in.stand_in_memory() == held


@pytest.mark.usefixtures("stand_in", "cupy")
def test_numbers_in_single_precision() -> None:
    model = model_of(PENDULUM, "float")
    q, v, a = (array.astype(np.float32) for array in states(model))
    found = eomgen.gpu(model_of(PENDULUM), real="float").inverse_dynamics(rows(q), rows(v), rows(a))
    assert found.dtype == np.float32
    assert np.array_equal(found, model.inverse_dynamics(q, v, a).astype(np.float32))


@pytest.mark.usefixtures("stand_in", "cupy")
@pytest.mark.filterwarnings("ignore:the arrays are NumPy's")
def test_a_base_by_the_law_of_the_scene_is_an_array_of_each_caller() -> None:
    model = model_of(PENDULUM)
    functions = eomgen.gpu(model)
    found = [functions.evaluate("base", form(model.initial_q))["base"] for form in (rows, np.array)]
    assert [type(array) for array in found] == [type(rows(0.0)), np.ndarray]
    assert found[1].tolist() == found[0].tolist() and found[1][6] == 0.02


Q, V = np.zeros((3, 2)), np.zeros((3, 2))
FIELD = cupy_array(np.zeros(3, [("number", "i4"), ("q", "f8", 2)]))["q"]


@pytest.mark.usefixtures("stand_in", "cupy")
@pytest.mark.parametrize(
    ("q", "v", "message"),
    [
        (rows(np.zeros((3, 3))), rows(V), "q: the shape is (3, 3), (..., 2) is needed; try: samples along leading"),
        (rows(Q), rows(V[:2]), "the leading axes do not broadcast: parameters (3,), q (3,), v (2,)"),
        (
            rows(Q.astype(np.float32)),
            rows(V),
            "q: the numbers are float32, and the functions are compiled for float64; try: numbers of float64 or"
            ' eomgen.gpu(model, real="float")',
        ),
        (rows(Q.astype(int)), rows(V), "functions are compiled for float64; try: numbers of float64"),
        (FIELD, rows(V), "strides: the strides (20, 8) are not multiples of the 8 bytes of a number; try: a"),
        (rows(Q), OnCard(V, 1), "v: the array is on device 1, and the first array on device 0; try: all arrays on"),
        (rows(Q), OnCard(V, -1), "v: the array is in memory of the processor, and the first array on device 0"),
        (rows(Q), None, "v: the term forward_dynamics needs v; try: v=..."),
        (rows(Q), "fast", "v: an array of real numbers is needed, not str"),
    ],
    ids=["shape", "axes", "type", "whole numbers", "field", "device", "processor", "missing", "word"],
)
def test_refused_arrays(q: Any, v: Any, message: str) -> None:
    with pytest.raises(UsageError, match=re.escape(message)):
        eomgen.gpu(model_of(PENDULUM)).forward_dynamics(q, v, parameters=rows(np.full((3, 1), 0.5)))


@pytest.mark.usefixtures("stand_in")
def test_refused_models_and_options() -> None:
    with pytest.raises(ModelError, match="four_bar has constraints: accelerations need a solver"):
        eomgen.gpu(model_of(FOUR_BAR)).forward_dynamics(np.zeros(3), np.zeros(3))
    with pytest.raises(UsageError, match=r"mass: there is no argument torque; try: one of t, q, .*, stream"):
        eomgen.gpu(model_of(PENDULUM)).evaluate("mass", np.zeros(2), torque=1.0)
    for name in ("p", "lam"):  # of the C
        with pytest.raises(UsageError, match=f"mass: there is no argument {name}; try: one of t, q, .*parameters"):
            eomgen.gpu(model_of(PENDULUM)).evaluate("mass", np.zeros(2), **{name: np.ones(1)})
    with pytest.raises(UsageError, match=r"parameters: the shape is \(3,\), \(..., 1\) is needed"):
        eomgen.gpu(model_of(PENDULUM)).mass(OnCard(np.zeros(2)), parameters=OnCard(np.zeros(3)))
    assert "stand-in" in repr(eomgen.gpu(model_of(PENDULUM), device=np.int64(0)))  # type: ignore[arg-type]
    with pytest.warns(RuntimeWarning), pytest.raises(UsageError, match="the term masses is not in this model"):
        eomgen.gpu(model_of(PENDULUM)).evaluate("masses", np.zeros(2))
    with pytest.raises(UsageError, match="gpu: a model is needed, not int"):
        GpuFunctions(3)
    with pytest.raises(UsageError, match="real = 'half'"):
        eomgen.gpu(model_of(PENDULUM), real="half")
    with pytest.raises(ToolchainError, match="there is no device 3 among 1; try: device 0 to 0"):
        eomgen.gpu(model_of(PENDULUM), device=3)
    with pytest.raises(ToolchainError, match="there is no device '0' among 1"):
        eomgen.gpu(model_of(PENDULUM), device="0")
    with pytest.raises(UsageError, match=r"the term \['mass'\] is not in this model"):
        eomgen.gpu(model_of(PENDULUM)).evaluate(["mass"], np.zeros(2))


def test_machine_code_is_kept(stand_in: ctypes.CDLL, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    model = model_of(PENDULUM)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    before = stand_in.stand_in_calls(b"nvrtcCompileProgram")
    for _ in range(2):
        with pytest.warns(RuntimeWarning, match="copies"):
            assert eomgen.gpu(model).mass(np.zeros(2)).shape == (2, 2)
    assert stand_in.stand_in_calls(b"nvrtcCompileProgram") == before + 1


@pytest.mark.usefixtures("cupy")
@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.usefixtures("cupy")
def test_two_threads_at_once(stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STAND_IN_STRICT", "1")  # launches need a current context, which new threads have not
    model = model_of(PENDULUM)
    functions, faults = eomgen.gpu(model), list[int]()

    def work(seed: int) -> None:
        q, v, a = states(model, seed)
        expected = model.inverse_dynamics(q, v, a)
        for _ in range(300):
            if not np.array_equal(functions.inverse_dynamics(rows(q), rows(v), rows(a)), expected):
                faults.append(seed)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert faults == []


@pytest.mark.usefixtures("cupy")
def test_threads_that_begin_together_share_the_constants(
    stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second upload would replace the first one, whose memory a prepared call still reads."""
    model, uploads, upload = model_of(PENDULUM), list[int](), driver.Device.upload

    def slow(device: driver.Device, array: Any) -> driver.Memory:
        uploads.append(array.size)
        time.sleep(0.05)
        return upload(device, array)

    q, v, a = (rows(block) for block in states(model, 1))
    monkeypatch.setattr(driver.Device, "upload", slow)
    eomgen.gpu(model).inverse_dynamics(q, v, a)
    needed, functions = len(uploads), eomgen.gpu(model)
    threads = [threading.Thread(target=functions.inverse_dynamics, args=(q, v, a)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert needed > 0 and len(uploads) == 2 * needed


@pytest.mark.filterwarnings("ignore:the arrays are NumPy's")
def test_messages_without_driver_card_and_compiler(stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    model = model_of(PENDULUM)
    with monkeypatch.context() as patch:
        patch.setattr(nvrtc, "candidates", lambda: iter(()))
        nvrtc.nvrtc.cache_clear()
        with pytest.raises(
            ToolchainError, match=r"NVRTC: .* was not found; try: pip install 'eomgen\[gpu\]'"
        ) as raised:
            eomgen.gpu(model).mass(np.zeros(2))
        assert raised.value.exit_code == 5
    with monkeypatch.context() as patch:
        patch.setenv("STAND_IN_WITHOUT_CARD", "1")
        forget()
        with pytest.raises(ToolchainError, match=r"GPU: .*no CUDA-capable device is detected; try: .*nvidia-smi"):
            eomgen.gpu(model)
        patch.setattr(driver, "NAMES", ("/nowhere/libcuda.so.1",))
        forget()
        with pytest.raises(ToolchainError, match=r"GPU: no driver for cards of NVIDIA was found: .*nowhere"):
            eomgen.gpu(model)


def test_memory_that_is_not_there(stand_in: ctypes.CDLL) -> None:
    stand_in.stand_in_room(ctypes.c_longlong(1000))
    try:
        device = driver.driver().device()
        with pytest.raises(NumericalError, match="memory of stand-in: 2e-06 GB are needed, and 1e-06 of 1e-06 GB"):
            device.allocate(2000)
    finally:
        stand_in.stand_in_room(ctypes.c_longlong(1 << 32))


@pytest.mark.usefixtures("stand_in")
def test_faults_of_a_text_are_shown(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    with pytest.raises(ToolchainError, match=r"(?s)NVRTC 13.0, sources kept in .*failed.*error: .*wrong") as raised:
        nvrtc.compile_cubin({"kernel.cu": "wrong"}, "kernel.cu", "sm_90")
    folder = raised.value.problems[0].where.partition("kept in ")[2]
    assert (tmp_path / "failed" / folder.rpartition("/")[2] / "kernel.cu").read_text(encoding="utf-8") == "wrong"


@pytest.mark.usefixtures("cupy")
def test_a_call_in_a_record_of_a_graph_is_one_launch(stand_in: ctypes.CDLL) -> None:
    model = model_of(PENDULUM)
    functions, q, other = eomgen.gpu(model), rows(states(model)[0]), states(model, 1)[0]
    out = rows(np.full((SAMPLES, model.nv, model.nv), np.nan))
    counted = [b"copies", b"cuLaunchKernel"]
    functions.mass(q, out=out)
    out[:] = np.nan
    before, memory = [*map(stand_in.stand_in_calls, counted)], stand_in.stand_in_memory()
    stand_in.stand_in_record(len(functions._terms["mass"].blocks) + 2)
    functions.mass(q, out=out)
    with pytest.raises(ToolchainError, match=r"900.*; try: for a record of a graph: one call before it, and"):
        eomgen.gpu(model).mass(q, out=out)
    stand_in.stand_in_record(0)
    assert [*map(stand_in.stand_in_calls, counted)] == [before[0], before[1] + 1]
    assert np.isnan(out).all() and stand_in.stand_in_memory() == memory
    q[:] = other
    assert stand_in.stand_in_replay() == 1
    assert np.array_equal(out, model.mass(other))


def test_tensors_of_pytorch(stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    torch = pytest.importorskip("torch")
    from eomgen.products.gpu import arrays

    monkeypatch.setattr(arrays.TorchArrays, "kind", "cpu")
    monkeypatch.setattr(arrays.TorchArrays, "stream", lambda self, device: 9)
    model = model_of(PENDULUM)
    q, v, a = states(model)
    functions, tensors = eomgen.gpu(model), [torch.from_numpy(array) for array in (q, v, a)]
    found = functions.inverse_dynamics(*tensors)
    assert isinstance(found, torch.Tensor) and np.array_equal(found.numpy(), model.inverse_dynamics(q, v, a))
    assert stand_in.stand_in_stream() == 9
    turned = [tensor.t().contiguous().t() for tensor in tensors]
    stiffness, _, mass = functions.partials(*turned)
    assert np.array_equal(stiffness.numpy(), model.partials(q, v, a)[0]) and mass.stride() == (1, 14, 7)
    with pytest.raises(UsageError, match="torch: the tensor requires a gradient"):
        functions.inverse_dynamics(tensors[0].requires_grad_(), *tensors[1:])


def test_the_doctor_says_whether_driver_and_compiler_are_there(
    stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert re.fullmatch(r"stand-in \(sm_90\), driver for CUDA 13.0; NVRTC 13.0 \(.*\)", card().found) and card().ok
    monkeypatch.setattr(nvrtc, "candidates", lambda: iter(()))
    forget()
    assert not card().ok and card().remedy == "pip install 'eomgen[gpu]'" and not card().needed
    monkeypatch.setattr(driver, "NAMES", ("/nowhere/libcuda.so.1",))
    forget()
    assert card().ok and "no driver" in card().found and "NVRTC" in card().found and not card().remedy


@pytest.mark.slow
def test_the_installed_compiler_takes_the_text() -> None:
    if not [*nvrtc.candidates()]:
        pytest.skip("NVRTC is not installed: pip install 'eomgen[gpu]'")
    for term in ("base", "forward_dynamics"):
        usage = compile_term(model_of(PENDULUM), term, "sm_90").usage[f"double_pendulum_on_shaking_base_{term}_kernel"]
        assert 20 <= usage.registers <= 64 and usage.spills == 0


LOG = """ptxas info    : 0 bytes gmem
ptxas info    : Compiling entry function 'panda_mass_kernel' for 'sm_90'
ptxas info    : Function properties for panda_mass_kernel
    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
ptxas info    : Used 71 registers, used 0 barriers
ptxas info    : Compiling entry function 'panda_partials_kernel' for 'sm_90'
ptxas info    : Function properties for panda_partials_kernel
    2216 bytes stack frame, 3000 bytes spill stores, 4116 bytes spill loads
ptxas info    : Used 255 registers, used 1 barriers, 2216 bytes cumulative stack size
ptxas info    : Function properties for panda_partials_part2
    0 bytes stack frame, 8 bytes spill stores, 12 bytes spill loads
"""


def test_registers_stack_and_spills_of_the_log() -> None:
    usage = nvrtc.Cubin(b"", LOG).usage
    assert usage == {
        "panda_mass_kernel": nvrtc.Usage(71, 0, 0),
        "panda_partials_kernel": nvrtc.Usage(255, 2216, 7136),
    }


@pytest.mark.usefixtures("stand_in", "cupy")
def test_inputs_and_states_that_a_scene_lacks_are_refused_as_by_the_processor() -> None:
    model = model_of(PENDULUM)
    functions, q = eomgen.gpu(model), np.zeros((3, 2))
    for given in ({"u": [[1.0], [1.0, 2.0]]}, {"z": "fast"}):
        with pytest.raises(UsageError) as of_processor:
            model.forward_dynamics(q, q, **given)
        with pytest.raises(UsageError) as of_card:
            functions.forward_dynamics(cupy_array(q), cupy_array(q), **given)
        assert str(of_card.value) == str(of_processor.value)
    for given in ({"u": np.ones((3, 1))}, {"z": np.ones((3, 1))}):
        with pytest.raises(UsageError) as of_processor:
            model.forward_dynamics(q, q, **given)
        for kind in (np.asarray, cupy_array):
            with pytest.raises(UsageError) as of_card:
                functions.forward_dynamics(kind(q), kind(q), **{name: kind(array) for name, array in given.items()})
            assert str(of_card.value) == str(of_processor.value)
