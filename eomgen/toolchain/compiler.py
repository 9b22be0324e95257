"""Discovery and processes of the C compiler: start, parallel number, end, background runs, one link; errors show
command and output."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import importlib.machinery
import importlib.util
import os
import platform
import re
import shlex
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from eomgen.base.data import dataclass
from eomgen.base.progress import Progress
from eomgen.errors import FileError, Problem, ToolchainError
from eomgen.toolchain.cache import StoppedError, default_folder, refusal, write_postponed

if TYPE_CHECKING:
    import subprocess
    from queue import PriorityQueue

#: Names of compilers on the path, in the order of the search; the compiler of the package ziglang comes after these.
CANDIDATES = ("cc", "gcc", "clang")
#: The package with the compiler zig, which the extra ``eomgen[compiler]`` installs.
ZIG_PACKAGE = "ziglang"
#: Installs a compiler without the rights of an administrator.
PIP_INSTALL = 'pip install "eomgen[compiler]"'
#: Without optimisation zig adds checks that end the process at any wrapped integer; generated C wraps none.
_OF_ZIG = ("-fno-sanitize=undefined",)
DEFAULT_TIMEOUT = 900.0

#: Messages of compilers, assemblers and linkers if a disk, a quota or a limit of file sizes is exhausted.
_FULL = ("No space left on device", "Disk quota exceeded", "File size limit exceeded", "File too large")
_COLOURS = r"\x1b\[[0-9;?]*[ -/]*[@-~]"
_WIDEST = 400
_FAULT = r"(?m)^((?:[A-Za-z]:)?[^\s:]+):(\d+):(?:\d+:)? (?:fatal )?error: (.*)$"
#: Of GNU linkers: a function in two files.
_TWICE = r"([^\s/:]+):\([^)]*\): multiple definition of [`'‘](\w+)"
_C_HINT = "C99, and int NAME(double t, const double *signals, double *values, double *memory)"
#: Variable by which zig takes another folder for its libraries.
_ZIG_FOLDER = "ZIG_GLOBAL_CACHE_DIR"
_COMMON = ("-std=c99", *(() if sys.platform == "win32" else ("-fPIC",)), "-fvisibility=hidden", "-Wno-psabi")


@dataclass(frozen=True)
class Compiler:
    """A C compiler: the words of its command (``CC`` may hold options) and the file of the first word."""

    command: tuple[str, ...]
    path: Path

    @property
    def is_zig(self) -> bool:
        """Whether this is the C compiler of zig, which makes its C library at the first use."""
        return _is_of_zig(self.command)

    @property
    def identity(self) -> str:
        """A text that changes when the compiler does; costs no process."""
        file = self.path.resolve()
        status = file.stat()
        return f"{' '.join(self.command)}|{file}|{status.st_size}|{status.st_mtime_ns}"

    @cached_property
    def version(self) -> str:
        """First line of ``cc --version``."""
        import subprocess  # noqa: PLC0415  # a library of the cache needs no process

        try:
            result = subprocess.run(
                [*self.command, "--version"],
                capture_output=True,
                encoding="utf-8",
                errors="replace",
                env=_variables(self.command),
                timeout=20,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise ToolchainError(
                f"the C compiler {self.path} does not run: {error} [E2105]", "another one with CC=..."
            ) from error
        lines = (result.stdout or result.stderr).splitlines()
        return printable(lines[0]) if lines else "unknown version"


def find_compiler(environ: Mapping[str, str] | None = None) -> Compiler:
    """Return the compiler that ``CC`` names, else the first of cc, gcc, clang on the path, else of package ziglang.

    ``environ`` replaces the process's variables.

    Raises
    ------
    ToolchainError
        None is there, or the one that ``CC`` names is not.
    """
    environ = os.environ if environ is None else environ
    path = environ.get("PATH", "")
    try:
        chosen = _words(environ.get("CC", ""))
    except ValueError as error:
        where = "environment variable CC"
        raise ToolchainError(Problem(where, f"{environ['CC']!r} cannot be read: {error} [E0902]", "CC=gcc")) from None
    if chosen:
        program = shutil.which(chosen[0], path=path)
        if program is None:
            raise ToolchainError(
                Problem(
                    "environment variable CC",
                    f"no C compiler {chosen[0]!r} on the path [E2106]",
                    "unset CC, or name one that is installed",
                )
            )
        named = Compiler(tuple(chosen), Path(program))
        return Compiler((*named.command, *_OF_ZIG), named.path) if named.is_zig else named
    for candidate in CANDIDATES:
        program = shutil.which(candidate, path=path)
        if program is not None:
            return Compiler((program,), Path(program))
    if (zig := zig_program()) is not None:
        return Compiler((str(zig), "cc", *_OF_ZIG), zig)
    raise ToolchainError(
        f"no C compiler found: looked for {', '.join(CANDIDATES)} on the path, in CC, and for the package"
        f" {ZIG_PACKAGE} [E2107]",
        ", or ".join(filter(None, (_system_command(), PIP_INSTALL))),
    )


def _is_of_zig(command: Sequence[str]) -> bool:
    return any(Path(word).stem in ("zig", ZIG_PACKAGE) for word in command)


def _variables(command: Sequence[str]) -> dict[str, str]:
    """Return the environment variables for a compiler: messages in English, and for zig a folder for libraries. This is
    zig's own folder in the user's cache, or if that cannot be written one of eomgen."""
    variables = {**os.environ, "LC_ALL": "C"}
    if os.name == "posix" and _is_of_zig(command) and not variables.get(_ZIG_FOLDER):
        home = variables.get("HOME", "")
        base = variables.get("XDG_CACHE_HOME") or (home and f"{home}/.cache")
        if not base or refusal(Path(base, "zig")):
            variables[_ZIG_FOLDER] = _zig_folder()
    return variables


@cache
def _zig_folder() -> str:
    """Return a folder for zig in the cache of eomgen, without a writable one a temporary folder of this process."""
    cache_folder = default_folder().absolute() / "zig"
    if not refusal(cache_folder):
        return str(cache_folder)
    import tempfile  # noqa: PLC0415  # for builds only

    temporary_folder = tempfile.mkdtemp(prefix="eomgen-zig-")
    atexit.register(shutil.rmtree, temporary_folder, ignore_errors=True)
    return temporary_folder


def _words(text: str) -> list[str]:
    """Return the words of a command; of Windows, in which a backslash stands between folders."""
    if os.name == "posix":
        return shlex.split(text)
    return [word.strip('"') for word in shlex.split(text, posix=False)]


def zig_program() -> Path | None:
    """Return the program zig of the package ziglang, None without the package."""
    spec = importlib.util.find_spec(ZIG_PACKAGE)
    folders = (spec.submodule_search_locations or ()) if spec is not None else ()
    programs = (Path(folder, "zig.exe" if sys.platform == "win32" else "zig") for folder in folders)
    return next((program for program in programs if program.is_file()), None)


def install_command() -> str:
    """Return the command that installs a compiler: of this system's own packages, else for this Python alone."""
    return _system_command() or f"{shlex.quote(sys.executable)} -m {PIP_INSTALL}"


def _system_command() -> str:
    """Return the shell command by which this system installs a compiler, empty if none is known."""
    if sys.platform == "darwin":
        return "xcode-select --install"
    tools = {"apt-get": "apt-get install -y gcc libc6-dev", "dnf": "dnf install -y gcc", "apk": "apk add gcc musl-dev"}
    for tool, command in tools.items():
        if shutil.which(tool):
            return as_root(command)
    return ""


def as_root(command: str) -> str:
    """Return a command with the prefix that this user needs to act as root."""
    return command if not hasattr(os, "geteuid") or os.geteuid() == 0 else f"sudo {command}"


@cache
def processor_digest() -> str:
    """Return a short digest of the processor features used by ``-march=native``."""
    text = platform.machine()
    try:
        with Path("/proc/cpuinfo").open(encoding="ascii", errors="replace") as stream:
            text += "".join(
                line
                for _, line in zip(range(40), stream, strict=False)
                if line.startswith(("model name", "flags", "Features"))
            )
    except OSError:
        text += platform.processor() + platform.platform()  # on some systems a process of its own
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def compilers_at_once() -> int:
    """Return the number of compilers to run: one for each processor of this process, two at least."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    # each may take some 200 MB
    return min(max(2, processors), 8)


def compile_library(
    compiler: Compiler,
    sources: Sequence[Path],
    output: Path,
    flags: Sequence[str],
    *,
    timeout: float = DEFAULT_TIMEOUT,
) -> list[str]:
    """Compile sources side by side, for ``timeout`` seconds at most, link the objects to a shared library ``output``,
    remove the objects, and return the commands.

    Raises
    ------
    ToolchainError
        With the compiler's command, its exit status, its last lines, and the folder of the sources.
    """
    with Compilation(compiler, flags, timeout=timeout) as compilation:
        for source in sorted(sources, key=_longest_first):
            compilation.add(source)
        commands = compilation.link(sources, output, list)
    for source in sources:
        source.with_suffix(".o").unlink(missing_ok=True)
    return commands


def _longest_first(source: Path) -> int:
    """Return a key by which sources are compiled, so that no long one is left alone at the end."""
    return -source.stat().st_size


class Begun:
    """Compilation of a source that was begun in the background before the library; ``ended`` is set at the end.

    Parameters
    ----------
    made : returns the object, None if the compilation failed
    """

    def __init__(self, made: Callable[[], Path | None]) -> None:
        self.ended = threading.Event()
        self._made = made

    def copy_object(self, target: Path, running: RunningCompilers) -> bool:
        """Wait for the end of the compilation, copy the object to ``target``, and return whether there is one. False
        also if the compilers of the library, ``running``, are stopped meanwhile."""
        while not self.ended.wait(0.1):
            if running.is_stopped:
                return False
        object_file = self._made()
        if object_file is not None:
            shutil.copyfile(object_file, target)
        return object_file is not None


class Compilation:
    """Sources that are compiled side by side while further ones are written; the longest waiting source first.

    A context: an exception that leaves the context ends the running compilers. Its threads do not keep the process from
    its end, as threads of an executor do.

    Parameters
    ----------
    jobs : compilers at once, as many as there are processors by default
    timeout : for all files together, seconds
    running : collection of the processes, for a caller who may stop the processes
    progress : called with the numbers of compiled and of all files so far, by the threads that compile
    """

    def __init__(
        self,
        compiler: Compiler,
        flags: Sequence[str],
        *,
        jobs: int | None = None,
        timeout: float = DEFAULT_TIMEOUT,
        running: RunningCompilers | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Begin without sources, with a deadline and a queue for the compilers."""
        from queue import PriorityQueue  # noqa: PLC0415  # a library of the cache needs no threads

        self._progress = progress
        self._added = 0
        self._compiler = compiler
        self._flags = flags
        self._deadline = time.monotonic() + timeout
        self._waiting: PriorityQueue[tuple[int, Path | None, tuple[str, ...]]] = PriorityQueue()
        self._begun: dict[Path, Begun] = {}
        self._made: dict[Path, tuple[Path, str]] = {}
        self._keep: dict[Path, Callable[[], object]] = {}
        self._running = RunningCompilers() if running is None else running
        self._most, self._threads = compilers_at_once() if jobs is None else jobs, list[threading.Thread]()
        self._failures: list[BaseException] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._running.stop()
        self._wait()

    def add(
        self,
        source: Path,
        flags: Sequence[str] | None = None,
        begun: Begun | None = None,
        keep: Callable[[], object] | None = None,
    ) -> None:
        """Compile a source, which lies in one folder with all files that it includes, to an object in the same folder.

        Parameters
        ----------
        flags : of this source, in place of the common flags
        begun : compilation of the same text that runs already, whose object is taken
        keep : called when the object is made
        """
        self._added += 1
        if keep is not None:
            self._keep[source] = keep
        length = _longest_first(source)
        if begun is not None:
            self._begun[source] = begun
            length = -sys.maxsize  # the process takes a processor, so that one worker waits for its end
        self._waiting.put((length, source, tuple(self._flags if flags is None else flags)))
        if len(self._threads) < self._most:
            self._threads.append(threading.Thread(target=self._work, name="eomgen-compiler", daemon=True))
            self._threads[-1].start()

    def take(self, source: Path, flags: Sequence[str]) -> None:
        """Link the object that exists for a source already, compiled with these flags."""
        self._made[source] = source.with_suffix(".o"), shlex.join(_object_command(self._compiler, source, flags))

    def _work(self) -> None:
        """Compile waiting sources, up to the mark of the end or the first failure."""
        try:
            while (item := self._waiting.get())[1] is not None and not self._failures:
                self._compile(item[1], item[2])
        except BaseException as error:
            self._failures.append(error)
            self._running.stop()

    def _wait(self) -> None:
        """Wait until all sources are compiled, or one cannot be."""
        for number, _ in enumerate(self._threads):
            self._waiting.put((sys.maxsize - number, None, ()))
        for thread in self._threads:
            thread.join()

    def _compile(self, source: Path, flags: Sequence[str]) -> None:
        begun = self._begun.get(source)
        if begun is not None and begun.copy_object(source.with_suffix(".o"), self._running):
            self.take(source, flags)
        else:
            self._made[source] = compile_object(self._compiler, source, flags, self._deadline, self._running)
        if source in self._keep:
            self._keep[source]()
        if self._progress is not None:
            self._progress(len(self._made), self._added)

    def link(self, sources: Sequence[Path], output: Path, objects: Callable[[], Sequence[Path]]) -> list[str]:
        """Wait for all sources, link them in this order to the shared library ``output``, and return all commands.
        ``objects`` returns further object files for the library, compiled meanwhile if missing. Raises the error of a
        source that could not be compiled."""
        write_postponed()
        ready = objects()
        self._wait()
        if self._failures:
            raise self._failures[0]
        done = [self._made[source] for source in sources]
        items = [*(str(item) for item, _ in done), *map(str, ready)]
        link = [*self._compiler.command, *_link_flags(), *items, "-o", str(output), "-lm"]
        run_compiler(link, output, deadline=self._deadline, running=self._running)
        return [*(command for _, command in done), shlex.join(link)]


class RunningCompilers:
    """The compiler processes of one library, so that Ctrl-C in the main thread need not wait for processes of the
    workers.

    Attributes
    ----------
    started : set when the first process runs, and at the end of work in the background
    is_stopped : whether ``stop`` was called
    """

    def __init__(self) -> None:
        self._processes: set[subprocess.Popen[str]] = set()
        self._lock = threading.Lock()
        self.is_stopped = False
        self.started = threading.Event()

    def stop(self) -> bool:
        """Kill running processes, and processes started from now on; return whether there were any."""
        with self._lock:
            self.is_stopped = True
            for process in self._processes:
                _end(process)
            return bool(self._processes)

    @contextlib.contextmanager
    def watch(self, process: subprocess.Popen[str]) -> Iterator[None]:
        with self._lock:
            self._processes.add(process)
            if self.is_stopped:
                _end(process)
        self.started.set()
        try:
            yield
        finally:
            with self._lock:
                self._processes.discard(process)


def in_background(name: str, work: Callable[[RunningCompilers], None], *, lower: bool = True) -> RunningCompilers:
    """Start work on a thread of its own, and return the collection of its compilers.

    At the end of the process these compilers are killed, and the thread removes their folder.

    Parameters
    ----------
    name : of the thread
    work : takes the collection in which the work enters its compilers
    lower : whether the work has a lower priority than the rest of the process
    """
    running = RunningCompilers()

    def end() -> None:
        if running.stop():
            # for the folder of an ended compiler
            thread.join(2.0)

    def whole() -> None:
        if lower and sys.platform == "linux":
            with contextlib.suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 5)
        try:
            work(running)
        finally:
            running.started.set()
            atexit.unregister(end)

    thread = threading.Thread(target=whole, name=name, daemon=True)
    atexit.register(end)
    thread.start()
    return running


def compile_object(
    compiler: Compiler,
    source: Path,
    flags: Sequence[str],
    deadline: float | None = None,
    running: RunningCompilers | None = None,
) -> tuple[Path, str]:
    """Compile one source to an object in the same folder; return the path of the object and the command. ``deadline``
    is a time of ``time.monotonic``. Raises ToolchainError or FileError."""
    made = source.with_suffix(".o")
    command = _object_command(compiler, source, flags)
    run_compiler(command, made, deadline=deadline, running=running)
    return made, shlex.join(command)


def compile_and_link(
    compiler: Compiler,
    source: Path,
    flags: Sequence[str],
    objects: Sequence[Path],
    output: Path,
    running: RunningCompilers | None = None,
) -> str:
    """Compile one file and link it with ready objects to a shared library by one command, which is returned."""
    words = [*compiler.command, *_COMMON, *flags, *_link_flags()]
    command = [*words, str(source), *map(str, objects), "-o", str(output), "-lm"]
    run_compiler(command, output, running=running)
    return shlex.join(command)


def _object_command(compiler: Compiler, source: Path, flags: Sequence[str]) -> list[str]:
    return [*compiler.command, *_COMMON, *flags, "-c", str(source), "-o", str(source.with_suffix(".o"))]


def write_texts(folder: Path, files: Mapping[str, str]) -> None:
    """Write files to a folder, by name."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def preprocess(compiler: Compiler, files: Mapping[str, str], name: str) -> str:
    """Return a file without directives of the preprocessor.

    Parameters
    ----------
    files : mapping from name to text
        All files that the file includes; no header of the system is used.
    """
    import tempfile  # noqa: PLC0415  # for lanes only

    with tempfile.TemporaryDirectory() as folder:
        write_texts(Path(folder), files)
        output = Path(folder) / "preprocessed.i"
        flags = ["-E", "-P", "-undef", "-nostdinc", "-Dsize_t=long", f"-I{folder}"]
        command = [*compiler.command, *flags, str(Path(folder) / name), "-o", str(output)]
        run_compiler(command, output)
        return output.read_text(encoding="utf-8")


def _link_flags() -> list[str]:
    if sys.platform == "darwin":
        return ["-bundle", "-undefined", "dynamic_lookup"]
    return ["-shared"] if sys.platform == "win32" else ["-shared", "-Wl,-Bsymbolic"]


def printable(text: str) -> str:
    """Return a program's output without colours, and with all other control characters of terminals escaped."""
    import unicodedata  # noqa: PLC0415  # a table of all characters, for texts of compilers alone

    plain = re.sub(_COLOURS, "", text)
    kept = (
        c if c in "\n\t" or unicodedata.category(c)[0] != "C" else c.encode("unicode_escape").decode() for c in plain
    )
    lines = "".join(kept).split("\n")
    return "\n".join(line if len(line) <= _WIDEST else f"{line[:_WIDEST]} ..." for line in lines)


def faults_in(output: str, written: Mapping[str, str]) -> list[Problem]:
    """Return the problems that a compiler or linker reports in files written by the user, each with file and line.

    Parameters
    ----------
    output : of the compiler, with the compiler's command
    written : names of these files, by the names given to the compiler
    """
    result: dict[tuple[str, str], Problem] = {}
    for name, shown_as in written.items():
        if not re.search(rf"[/\\]{re.escape(name)} ", output):  # the command was for another file
            continue
        for file, line, fault in re.findall(_FAULT, output):
            if re.split(r"[/\\]", file)[-1] == shown_as:
                problem = Problem(f"{shown_as}:{line}", f"the C compiler finds {fault} [E2108]", _C_HINT)
                result.setdefault((shown_as, line), problem)
    for name, function in re.findall(_TWICE, output):
        if name in written:
            shown_as = written[name]
            fault = f"the function {function} is defined in another file, too, and models have all files linked [E2109]"
            result.setdefault((shown_as, function), Problem(shown_as, fault, f"static before {function}"))
    return list(result.values())


def library_suffix() -> str:
    """Return the suffix of an extension module of this Python."""
    return importlib.machinery.EXTENSION_SUFFIXES[0]


#: Status of a shell whose command is not there or no program.
_NOT_RUN = (126, 127)
#: Script of the shell that runs a compiler in a process group of its own: if the pipe to this process, the input of the
#: shell, breaks, which any end of this process causes, the group with all parts of the compiler is ended.
_GUARD = """exec 3<&0
"$@" 3<&- </dev/null & made=$!
{ read -r _ <&3; kill -KILL 0; } & guard=$!
wait "$made"; code=$?
kill "$guard"; exit "$code\""""


@contextlib.contextmanager
def _guard(command: Sequence[str]) -> Iterator[tuple[list[str], dict[str, Any]]]:
    """Yield a command, and options of Popen, by which a compiler ends with this process; unchanged on Windows."""
    if os.name != "posix":
        import subprocess  # noqa: PLC0415  # as in run_compiler

        yield list(command), {"stdin": subprocess.DEVNULL}
        return
    reading, writing = os.pipe()
    try:
        yield ["/bin/sh", "-c", _GUARD, "sh", *command], {"stdin": reading, "process_group": 0}
    finally:
        os.close(reading)
        os.close(writing)


def _end(process: subprocess.Popen[str]) -> None:
    """Kill a compiler with all of its parts."""
    if os.name != "posix":
        process.kill()
    elif process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def run_compiler(
    command: Sequence[str],
    target: Path,
    location: str = "",
    deadline: float | None = None,
    running: RunningCompilers | None = None,
) -> str:
    """Run a compiler in the folder of the file ``target`` that the command makes, and return the warnings as text.

    Parameters
    ----------
    location : place of faults in messages; the folder by default, which has to be kept then
    deadline : a time of ``time.monotonic``; after ``DEFAULT_TIMEOUT`` seconds by default
    running : collection of processes, in which the compiler is entered

    Raises
    ------
    ToolchainError, FileError
        The compiler fails; a disk is full.
    StoppedError
        ``running`` was stopped.
    """
    import subprocess  # noqa: PLC0415  # a library of the cache needs no process

    where = location or f"C compiler, sources kept in {target.parent}"
    called = shlex.join(command)
    try:
        with (
            _guard(command) as (words, options),
            subprocess.Popen(
                words,
                cwd=target.parent,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                env=_variables(command),
                **options,
            ) as process,
            (running or RunningCompilers()).watch(process),
        ):
            try:
                left = DEFAULT_TIMEOUT if deadline is None else max(0.1, deadline - time.monotonic())
                output, complaints = process.communicate(timeout=left)
            except BaseException:
                _end(process)
                raise
    except subprocess.TimeoutExpired as error:
        hint = "a longer timeout, fewer functions, or a smaller scene"
        raise ToolchainError(Problem(where, f"{called} did not finish in time [E2110]", hint)) from error
    except OSError as error:
        fault = f"{called} does not run: {error.strerror} [E2111]"
        raise ToolchainError(Problem(where, fault, install_command())) from error
    if process.returncode != 0 and running is not None and running.is_stopped:
        raise StoppedError(Problem(where, f"{called} was ended with its process [E2112]"))
    printed = printable("\n".join((complaints or output).splitlines()[-20:])) or "(it said nothing)"
    if process.returncode in _NOT_RUN:
        fault = f"{called} does not run: {printed.rpartition(': ')[2]} [E2111]"
        raise ToolchainError(Problem(where, fault, install_command()))
    if process.returncode != 0 and (full := next((word for word in _FULL if word in complaints), None)):
        import tempfile  # noqa: PLC0415  # for a fault only

        fault = f"the compiler found no room here, or in {tempfile.gettempdir()} for its own files: {full} [E2113]"
        hint = "space there, or EOMGEN_CACHE=<another folder>, or TMPDIR=<another folder>"
        raise FileError(Problem(str(target.parent.parent), fault, hint))
    if process.returncode == 0 and not target.is_file():
        fault = f"{called} reported success but wrote no {target.name}, and said:\n{printed}\n [E2114]"
        raise ToolchainError(Problem(where, fault, "another compiler with CC=..."))
    if process.returncode != 0:
        fault = f"{called} ended with status {process.returncode} and said:\n{printed}\n [E2115]"
        hint = "eomgen doctor; if the compiler is sound, report this with the folder"
        raise ToolchainError(Problem(where, fault, hint))
    return str(complaints)
