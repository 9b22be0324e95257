"""From three lines of C to a call with NumPy arrays, in both modes of cffi, through the cache and its failures."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.errors import ToolchainError, UsageError
from eomgen.toolchain import builder as builder_module
from eomgen.toolchain import cffi_build
from eomgen.toolchain import compiler as compiler_module
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import Compiler
from eomgen.toolchain.library import Library

CDEF = """const char *eomgen_fingerprint(void);
const char *eomgen_number_type(void);
long eomgen_size(int what);
int eomgen_call(int function, long count, const double *const *inputs, const long *strides, double *const *outputs);
"""
FILES = {
    "interface.h": "#pragma GCC visibility push(default)\n" + CDEF + "#pragma GCC visibility pop\n",
    "model.c": (
        '#include "interface.h"\nconst char *eomgen_fingerprint(void) { return "f00d"; }\nconst char'
        ' *eomgen_number_type(void) { return "double"; }\nlong eomgen_size(int what) { return what == 0 ? 1 : -1;'
        " }\nint eomgen_call(int function, long count, const double *const *inputs, const long *strides, double *const"
        " *outputs)\n{ long i; if (function) return -1;\n  for (i = 0; i < count; ++i) outputs[0][i] = inputs[0][i *"
        " strides[0]] + 10 * inputs[1][i * strides[1] + 1];\n  return 0; }\n"
    ),
    "main.c": "#error not for the library\n",
}
LAYOUT = {
    "functions": [{"name": "f", "inputs": ["t", "q"], "input_sizes": [1, 2], "outputs": [{"name": "y", "size": 1}]}]
}


def build(folder: Path, mode: str | None = None, content: bytes = b"content", files: dict[str, str] = FILES) -> Library:
    return Builder("quick", mode=mode, cache=Cache(folder)).build(content, files, CDEF, LAYOUT)


@pytest.mark.parametrize("mode", ["api", "abi"])
def test_both_modes_give_the_same_numbers(mode: str, tmp_path: Path) -> None:
    library = build(tmp_path, mode)
    assert library.mode == mode
    assert (library.fingerprint, library.real) == ("f00d", "double")
    y = np.zeros(3)
    library.call("f", [np.array([1.0]), np.array([[0, 1], [0, 2], [0, 3.0]])], [y])
    assert y.tolist() == [11.0, 21.0, 31.0]
    library.call(0, [np.array([[1.0], [2.0], [4.0]]), np.array([0, 0.5])], [y])
    assert y.tolist() == [6.0, 7.0, 9.0]


def test_a_source_that_was_begun_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[str] = []
    compile_object = compiler_module.compile_object

    def counted(compiler: Compiler, source: Path, *arguments: Any, **named: Any) -> tuple[Path, str]:
        compiled.append(source.name)
        return compile_object(compiler, source, *arguments, **named)

    monkeypatch.setattr(compiler_module, "compile_object", counted)
    monkeypatch.setattr(builder_module, "compile_object", counted)
    builder = Builder("quick", cache=Cache(tmp_path))
    builder.begin_source("model.c", {name: FILES[name] for name in ("interface.h", "model.c")}, ())
    library = builder.build(b"content", FILES, CDEF, LAYOUT)
    y = np.zeros(1)
    library.call("f", [np.array([1.0]), np.array([0, 2.0])], [y])
    assert y.tolist() == [21.0]
    assert compiled.count("model.c") == 1


def test_faults_of_a_source_that_was_begun_are_those_of_its_library(tmp_path: Path) -> None:
    builder, files = Builder("quick", cache=Cache(tmp_path)), {**FILES, "model.c": "int broken(void) { return x; }\n"}
    builder.begin_source("model.c", {"model.c": files["model.c"]}, ())
    with pytest.raises(ToolchainError, match="'x' undeclared"):
        builder.build(b"content", files, CDEF, LAYOUT)


def test_arrays_that_do_not_fit_are_refused_by_name(tmp_path: Path) -> None:
    library = build(tmp_path)
    t, q, y = np.zeros(1), np.zeros(2), np.zeros(1)
    for inputs, outputs, message in (
        ([t], [y], r"f takes 2 arrays and fills 1, not 1 and 1; try: inputs t, q"),
        ([t, np.zeros(3)], [y], r"input q of f has shape \(3,\); try: \(2,\) or \(samples, 2\)"),
        ([t, np.zeros((0, 2))], [y], r"input q of f has shape \(0, 2\)"),
        (
            [np.zeros((2, 1)), np.zeros((3, 2))],
            [y],
            r"input q of f has shape \(3, 2\) where other inputs have 2 samples; try: .*\(2, 2\)",
        ),
        (
            [t, q.astype(np.float32)],
            [y],
            r"input q of f is float32; try: numpy.ascontiguousarray\(x, dtype=numpy.float64\)",
        ),
        ([t, np.zeros((2, 2))[:, 0]], [y], r"input q of f is float64, not contiguous"),
        ([t, q], [np.zeros(2)], r"output y of f has 2 numbers for 1 samples of 1"),
        ([t, q], [np.zeros(1, complex)], r"output y of f is complex128"),
    ):
        with pytest.raises(UsageError, match=message):
            library.call("f", inputs, outputs)
    y.flags.writeable = False
    with pytest.raises((BufferError, ValueError)):
        library.call("f", [t, q], [y])


def test_the_second_time_nothing_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = build(tmp_path)
    monkeypatch.setattr(builder_module, "Compilation", None)
    assert build(tmp_path).folder == first.folder
    assert Builder("quick", cache=Cache(tmp_path)).find(b"content") is not None
    assert Builder("quick", cache=Cache(tmp_path)).find(b"other") is None
    assert Builder("reproducible", cache=Cache(tmp_path)).find(b"content") is None


def test_the_log_tells_compiled_files_from_kept_objects(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", "eomgen"):
        build(tmp_path)
        build(tmp_path, content=b"other content")
    first, second = (message for message in caplog.messages if "lines of C" in message)
    assert first.startswith("compiled 1 of 1 files, ")
    assert second.startswith("linked 1 kept objects, ")


def test_what_fails_while_sources_are_written_is_passed_on(tmp_path: Path) -> None:
    def written() -> Iterator[tuple[str, str]]:
        yield "interface.h", FILES["interface.h"]
        raise ValueError("no more")

    builder = Builder("quick", cache=Cache(tmp_path))
    with pytest.raises(ValueError, match="no more"):
        builder.build(b"content", written(), CDEF, LAYOUT)
    assert builder.find(b"content") is None


@pytest.mark.slow
def test_a_cached_library_loads_without_cffi_sympy_and_jinja(tmp_path: Path) -> None:
    build(tmp_path, "api")
    script = (
        "import sys\nfrom eomgen.toolchain.builder import Builder\nfrom eomgen.toolchain.cache import Cache\nlibrary ="
        f" Builder('quick', cache=Cache({str(tmp_path)!r})).find(b'content')\nprint(library.fingerprint,"
        " sorted({'sympy', 'jinja2', 'setuptools', 'pycparser', 'cffi', 'scipy'} & set(sys.modules)))\n"
    )
    assert (
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout == "f00d []\n"
    )


def test_a_consistent_entry_that_is_no_library_is_built_again(tmp_path: Path) -> None:
    builder = Builder("quick", mode="abi", cache=Cache(tmp_path))

    def fake(folder: Path) -> None:
        (folder / "layout.json").write_text("{}", encoding="utf-8")

    builder.cache.put(builder.key(b"content"), fake)
    assert builder.find(b"content") is None
    assert builder.build(b"content", FILES, CDEF, LAYOUT).fingerprint == "f00d"


def test_failed_sources_are_kept_where_the_message_says(tmp_path: Path) -> None:
    with pytest.raises(ToolchainError, match="sources kept in") as caught:
        build(tmp_path, files={**FILES, "model.c": "int broken\n"})
    folder = Path(caught.value.problems[0].where.removeprefix("C compiler, sources kept in "))
    assert (folder / "model.c").read_text(encoding="utf-8") == "int broken\n"
    assert not any(path.name.startswith("tmp-") for path in tmp_path.iterdir())


def test_without_python_headers_the_abi_mode_serves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(builder_module, "python_headers", lambda: None)
    assert build(tmp_path).mode == "abi"
    with pytest.raises(ToolchainError, match=r"Python\.h is missing.*try: apt install python3-dev, or mode abi"):
        Builder("quick", mode="api", cache=Cache(tmp_path))


@pytest.mark.slow
def test_the_wrapper_is_compiled_while_the_caller_derives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fault in the background is reported by the build alone."""
    names, plain = list[str](), builder_module.compile_object

    def noted(compiler: Compiler, source: Path, *arguments: Any, **options: Any) -> tuple[Path, str]:
        names.append(threading.current_thread().name)
        return plain(compiler, source, *arguments, **options)

    monkeypatch.setattr(builder_module, "compile_object", noted)
    builder = Builder("quick", mode="api", cache=Cache(tmp_path))
    builder.begin_wrapper(CDEF, FILES["interface.h"])
    _end_of_wrapper()
    assert builder.build(b"content", FILES, CDEF, LAYOUT).fingerprint == "f00d"
    builder.begin_wrapper(CDEF, FILES["interface.h"])
    _end_of_wrapper()
    assert names == ["eomgen-wrapper"]
    builder.begin_wrapper(CDEF, "#error no header\n")
    _end_of_wrapper()
    assert names == ["eomgen-wrapper"] * 2
    with pytest.raises(ToolchainError, match="ended with status 1"):
        builder.build(b"other", {**FILES, "interface.h": "#error no header\n"}, CDEF, LAYOUT)


def _end_of_wrapper() -> None:
    for thread in threading.enumerate():
        if thread.name == "eomgen-wrapper":
            thread.join()


def test_the_wrapper_is_compiled_once_for_all_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(tmp_path, "api")
    monkeypatch.setattr(builder_module, "wrapper_source", None)
    assert build(tmp_path, "api", content=b"second model").mode == "api"


def test_a_file_that_is_no_library_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "no.so"
    file.write_bytes(b"no")
    for load in (lambda: cffi_build.load_api(file), lambda: cffi_build.load_abi(file, CDEF)):
        with pytest.raises(ToolchainError, match=r"no\.so cannot be loaded: .*; try: building again"):
            load()


def test_unknown_number_types_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ToolchainError, match="no number type 'quad'; try: one of double, float, complex, lanes"):
        Builder("quick", "quad", cache=Cache(tmp_path))
