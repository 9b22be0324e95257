"""WebAssembly of a compiled model: the C of a library and of a page's motion, compiled by zig, from the cache."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from eomgen.base.version import __version__
from eomgen.codegen.targets.c.templates import environment
from eomgen.errors import ModelError, Problem, ToolchainError
from eomgen.integrators.stepper_layout import row_layout, state_layout
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import PIP_INSTALL, Compiler, run_compiler, zig_program
from eomgen.toolchain.library import Library
from eomgen.toolchain.tables import fingerprints_and_numbers, library_texts, tables_in

#: Functions of the model that a page evaluates; libraries have the first two if other functions need these.
FUNCTIONS = (
    "base",
    "inputs",
    "poses",
    "outputs",
    "energy",
    "constraint",
    "constraint_velocity",
    "constraint_jacobian",
    "mass",
)
#: The digits of the profile ``reproducible``: no fused products, and no reordering of sums.
_FLAGS = "-target wasm32-wasi -mexec-model=reactor -std=c99 -O2 -ffp-contract=off -fno-sanitize=all -Wl,--strip-all"
_REALS = {"double": (), "float": ("-DEOMGEN_REAL_FLOAT",)}
_MODULE, _SOURCE = "page.wasm", "page.c"
#: Events of one call that a page keeps.
_EVENTS = 128


class WebModule(NamedTuple):
    """A module of WebAssembly, and names and sizes of the blocks of doubles, by number."""

    code: bytes
    blocks: tuple[tuple[str, int], ...]


def web_module(library: Library, *, left_to_stepper: bool) -> WebModule:
    """Return the WebAssembly of a library with a stepper, from the cache if possible.

    Parameters
    ----------
    library : Library
        Compiled from C, not on the tape engine.
    left_to_stepper : bool
        As of ``InputSignals``.

    Raises
    ------
    ToolchainError
        There is no zig, or zig does not compile the model.
    ModelError
        Functions of the scene that are not C.
    """
    source, blocks = page_source(library.layout, left_to_stepper=left_to_stepper)
    texts = {**texts_with_numbers(library), _SOURCE: source}
    stack = int(library.layout.get("stack", 0)) + 1_000_000  # beyond the estimate for the model's functions
    flags = (*_FLAGS.split(), f"-Wl,-z,stack-size={stack - stack % 16}", *_REALS[library.real])
    program = zig_program()
    if program is None:
        fault = "a page needs WebAssembly, which the compiler zig makes, and the package ziglang is not"
        raise ToolchainError(Problem("live", f"{fault} installed [E0961]", PIP_INSTALL))
    compiler = Compiler((str(program), "cc"), program)
    digest = hashlib.sha256("\0".join(("web", compiler.identity, *flags)).encode())
    for name, text in texts.items():
        digest.update(f"\0{name}\0{text}".encode())
    cache, key = Cache(), digest.hexdigest()

    def fill(folder: Path) -> None:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        sources = [name for name in sorted(texts) if name.endswith(".c")]
        run_compiler([*compiler.command, *flags, *sources, "-o", _MODULE], folder / _MODULE)

    with cache.claim(key):
        entry = cache.get(key) or cache.put(key, fill)
    return WebModule(entry.file(_MODULE).read_bytes(), blocks)


def texts_with_numbers(library: Library) -> dict[str, str]:
    """Return the C sources and headers of a library by name, with tables of numbers as C: a page has no loader."""
    texts, prefix = library_texts(library.folder), library.layout["prefix"]
    if tables := tables_in(library.folder):
        mark, _, numbers = fingerprints_and_numbers(tables)
        arrays = {f"char {prefix}_fingerprint[24]": f'"{mark.decode()}"'}
        arrays |= {f"double {name}[{len(row)}]": f"{{ {', '.join(map(repr, row))} }}" for name, row in numbers.items()}
        lines = (f"extern const {array};\nconst {array} = {row};\n" for array, row in arrays.items())
        texts[f"{prefix}_numbers.c"] = "".join(lines)
    return texts


def page_source(layout: Mapping[str, Any], *, left_to_stepper: bool) -> tuple[str, tuple[tuple[str, int], ...]]:
    """Return the C of the page's motion, and names and sizes of the blocks of doubles; arguments as in ``web_module``.

    Raises
    ------
    ModelError
        A function of Python takes part in the motion.
    """
    method, sizes = layout["method"], layout["sizes"]
    places, row = state_layout(method), row_layout(method)
    nu, rows = sizes["u"], max(part.stop for part in row.values())
    events = "events" in method
    functions, results = _called(layout, row)
    blocks = {
        "parameters": sizes["p"],
        "settings": len(method["settings"]),
        "state": max(part.stop for part in places.values()),
        "present": sizes["p"],
        "held": nu,
        "u": nu,
        **{f"start_{name}": sizes[name] for name in "qvz"},
        "row_of_motion": rows,
        "happened": 1 + 2 * _EVENTS if events else 0,
        "base": sizes["base"],
        "inputs_u": nu,
        **{name: output["size"] for name, output in results.items()},
    }
    modes = method["events"]["modes"] if events else ()
    text = (
        environment()
        .get_template("pages/page.c.jinja")
        .render(
            prefix=layout["prefix"],
            version=__version__,
            blocks=blocks,
            results={name: output["description"] for name, output in results.items()},
            row=list(row),
            functions=functions,
            rows=method["rows_per_step"],
            within=method.get("input_times", [0.0, 1.0]),
            **{f"n{name}": sizes[name] for name in "uqvz"},
            modes=[(places["mode"].start + k, mode["parameter"]) for k, mode in enumerate(modes)],
            known=places["event_known"].start if events else 0,
            events=events,
            most_events=_EVENTS,
            left_to_stepper=left_to_stepper,
            **{name: places[name].start for name in ("origin", "count", "t", "q", "v")},
            z=places["z"].start if "z" in places else 0,
        )
    )
    return text, tuple(blocks.items())


def check_supported(layout: Mapping[str, Any], name: str) -> None:
    """Raise ModelError for functions of Python in a scene, which a page does not have."""
    hint = "the function in C, which a page compiles with the model, or eomgen animate for a recorded motion"
    if layout.get("python"):
        law = layout["python"][0]
        fault = f"the function {law['function']} of {Path(law['file']).name} is in Python, and a page has none [E0962]"
        raise ModelError(Problem(name, fault, hint))
    if layout["method"].get("samples", {}).get("from_caller"):
        fault = "a sampled controller calls a function of Python, and a page has none [E0963]"
        raise ModelError(Problem(name, fault, hint))


def _called(
    layout: Mapping[str, Any], row: Mapping[str, slice]
) -> tuple[list[dict[str, Any]], dict[str, Mapping[str, Any]]]:
    """Return the model functions that a page calls, with the C texts of all arguments, and the results of the functions
    by block. ``row`` has the places of the quantities in the row of the motion."""
    arguments = {"p": "present", "t": "row_of_motion", "u": "u", "base": "base", "lam": "row_of_motion"}
    arguments |= {"z": "row_of_motion", "a": f"row_of_motion + {row['vdot'].start}"}
    arguments |= {name: f"row_of_motion + {row[name].start}" for name in ("q", "v", "lam", "z") if name in row}
    fixed = {"base": ["base"], "inputs": ["inputs_u"]}
    called: list[dict[str, Any]] = []
    results: dict[str, Mapping[str, Any]] = {}
    for number, item in enumerate(layout["functions"]):
        if (name := item["name"]) in FUNCTIONS:
            outputs = {f"{name}_{output['name']}": output for output in item["outputs"]}
            results |= {} if name in fixed else outputs
            blocks = [arguments[block] for block in item["inputs"]]
            made = {"arguments": blocks, "outputs": fixed.get(name, list(outputs))}
            called.append({"name": name, "number": number, "description": item["description"], **made})
    return called, results
