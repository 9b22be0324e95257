"""The target ``acados``: the model folder of acados, with explicit, implicit and discrete dynamics.

acados compiles files of fixed names with the interface of CasADi's C. NAME_expl_ode_fun.c (for explicit integrators),
NAME_impl_dae_fun.c (implicit ones) and NAME_dyn_disc_phi_fun.c (discrete dynamics) include the C of the model; Hessians
stand in files that acados compiles for exact Hessians alone.
Verschueren, Frison et al., acados: a modular open-source framework for fast embedded optimal control, Mathematical
Programming Computation 14 (2022).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import nearest, shown
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import generate_files
from eomgen.codegen.targets.c.templates import environment
from eomgen.codegen.targets.target import Target
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.optimisers.casadi_code import Texts, check_named, exported_functions
from eomgen.products.optimisers.discrete_steps import StepChain, chain_of
from eomgen.products.optimisers.functions import Equations, Exported, Pattern, dense, rates, symmetric

#: Terms of the functions of acados: of scenes without constraints, with constraints.
_FREE, _CONSTRAINED = ("inverse_dynamics", "forward_dynamics"), ("residual", "constraint_acceleration")
_TERMS = (*_FREE, *_CONSTRAINED, "internal_rate", "momenta", "constraint", "constraint_velocity")


@dataclass(frozen=True)
class AcadosFunctions:
    """Functions of acados with the same equations.

    Attributes
    ----------
    name : explicit, implicit or discrete
    equations : with derivatives in (x, u), or in (x, xdot, z, u); None of the discrete functions
    step : of the discrete functions, in place of equations
    """

    name: str
    equations: Any
    step: StepChain | None = None

    @cached_property
    def functions(self) -> list[Exported]:
        """Functions of the model."""
        if self.step is not None:
            return [function.exported for function in self.step.functions if function.group is None]
        return [part.function for part in self.equations.parts if part.group is None]

    @property
    def takes_time(self) -> bool:
        """Whether a function takes the time."""
        return self.step.timed if self.step is not None else bool(self.equations.takes_time)

    @cached_property
    def entries(self) -> Mapping[str, Callable[[_Sizes, Texts], dict[str, Any]]]:
        """Files by the ending of the name, with the functions that describe each; the first holds the model."""
        return {"explicit": _EXPLICIT, "implicit": _IMPLICIT, "discrete": _DISCRETE}[self.name]


@dataclass(frozen=True)
class _Sizes:
    """Numbers of the arguments x, u, z and p of acados' functions, with the family of these functions.

    Attributes
    ----------
    p : parameters, the time and for discrete functions the length of the step
    """

    family: AcadosFunctions
    x: int
    u: int
    z: int
    p: int

    def dense(self, texts: Texts, *names: str) -> list[dict[str, Any]]:
        """Return the descriptions of arguments that are full vectors or matrices, by their names in acados."""
        x, u, width = self.x, self.u, self.x + self.u
        sizes = {"x": (x, 1), "xdot": (x, 1), "u": (u, 1), "z": (self.z, 1), "p": (self.p, 1), "lam": (x, 1)}
        sizes |= {"Sx": (x, x), "Su": (x, u), "Sx_dot": (x, x), "Su_dot": (x, u), "adj": (width, 1)}
        sizes |= {"multiplier": (x + self.z, 1), "hess": (width * (width + 1) // 2, 1)}
        return [texts.argument(name, dense(*sizes[name])) for name in names]


def _entry(kind: str, inputs: list[Any], outputs: list[Any], work: int, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "inputs": inputs, "outputs": outputs, "work": work, **more}


def _tables(texts: Texts, pattern: Pattern, start: str = "") -> dict[str, int]:
    """Return the numbers of the tables of a pattern by name, and the count of nonzeros."""
    parts = {"rows": pattern.rows, "columns": pattern.columns, "numbers": pattern.places}
    tables = {f"{start}{name}": texts.table(part) for name, part in parts.items() if len(part)}
    return tables | {f"{start}count": len(pattern.rows)}


def _numbers(sizes: _Sizes) -> int:
    return int(sizes.family.equations.count) + 2 + int(sizes.family.equations.scratch)


def _explicit(kind: str, inputs: str, outputs: str, sizes: _Sizes, texts: Texts) -> dict[str, Any]:
    """Return the description of a function of the explicit rates: values, or first or second derivatives."""
    equations, width = sizes.family.equations, sizes.x + sizes.u
    arguments, taken = (sizes.dense(texts, *names.split()) for names in (inputs, outputs))
    work, tables = 0, dict[str, int]()
    if kind != "value":
        work, tables = _numbers(sizes), _tables(texts, equations.jacobian)
    if kind == "hessian":
        work += equations.hessian_count + 2 * width * width
        tables |= _tables(texts, equations.lower, "second_")
    return _entry(kind, arguments, taken, work, **tables)


def _implicit(sizes: _Sizes, texts: Texts, blocks: Sequence[str], *, value: bool = True) -> dict[str, Any]:
    """Return the description of a function of the implicit equations: its values, unless `value` is false, and then
    sparse blocks of the Jacobian in the arguments `blocks`."""
    equations, outputs, gathered = sizes.family.equations, [], []
    if value:
        outputs.append(texts.argument("f", dense(sizes.x + sizes.z)))
    for name in blocks:
        block = equations.block(name)
        table = texts.table(block.places) if len(block.rows) else 0
        gathered.append({"number": len(outputs), "count": len(block.rows), "table": table})
        outputs.append(texts.argument(f"jac_{name}", block))
    inputs = sizes.dense(texts, "x", "xdot", "u", "z", "p")
    return _entry("blocks" if blocks else "value", inputs, outputs, _numbers(sizes), blocks=gathered, valued=value)


def _impl_dae_hess(sizes: _Sizes, texts: Texts) -> dict[str, Any]:
    """Return the description of acados' function for the Hessian of multipliers times the implicit equations, as one
    sparse symmetric matrix in (x, xdot, z, u)."""
    equations, lower = sizes.family.equations, sizes.family.equations.lower
    width, both = equations.width, symmetric(equations.width, lower.rows, lower.columns)
    numbers = lower.places[both.places]
    distinct, targets = np.unique(both.columns * width + both.rows, return_inverse=True)
    pattern = Pattern((width, width), distinct % width, distinct // width, np.arange(len(distinct)))
    inputs, outputs = sizes.dense(texts, "x", "xdot", "u", "z", "multiplier", "p"), [texts.argument("hess", pattern)]
    tables = {"targets": texts.table(targets), "numbers": texts.table(numbers)} if len(numbers) else {}
    work = equations.hessian_count + equations.scratch
    more = {"nonzeros": len(distinct), "second_count": len(numbers), **tables}
    return _entry("implicit_hessian", inputs, outputs, work, **more)


def _disc(sizes: _Sizes, texts: Texts, level: int) -> dict[str, Any]:
    step, width = sizes.family.step, sizes.x + sizes.u
    inputs = sizes.dense(texts, "x", "u", *(["lam"] if level > 1 else []), "p")
    outputs = [texts.argument("phi", dense(sizes.x))]
    outputs += [texts.argument("jac_ut_xt", dense(width, sizes.x))] if level else []
    outputs += [texts.argument("hess", dense(width, width))] if level > 1 else []
    return _entry(f"step_{level}", inputs, outputs, step.first["work"] if step else 0, level=level)


_Entries = Mapping[str, Callable[[_Sizes, Texts], dict[str, Any]]]
_EXPLICIT: _Entries = {
    "expl_ode_fun": partial(_explicit, "value", "x u p", "xdot"),
    "expl_vde_forw": partial(_explicit, "forward", "x Sx Su u p", "xdot Sx_dot Su_dot"),
    "expl_vde_adj": partial(_explicit, "adjoint", "x lam u p", "adj"),
    "expl_ode_hess": partial(_explicit, "hessian", "x Sx Su lam u p", "adj hess"),
}
_IMPLICIT: _Entries = {
    "impl_dae_fun": lambda sizes, texts: _implicit(sizes, texts, ()),
    "impl_dae_fun_jac_x_xdot_z": lambda sizes, texts: _implicit(sizes, texts, ("x", "xdot", "z")),
    "impl_dae_jac_x_xdot_u_z": lambda sizes, texts: _implicit(sizes, texts, ("x", "xdot", "u", "z"), value=False),
    "impl_dae_fun_jac_x_xdot_u_z": lambda sizes, texts: _implicit(sizes, texts, ("x", "xdot", "u", "z")),
    "impl_dae_fun_jac_x_xdot_u": lambda sizes, texts: _implicit(sizes, texts, ("x", "xdot", "u")),
    "impl_dae_hess": _impl_dae_hess,
}
_DISCRETE: _Entries = {
    "dyn_disc_phi_fun": lambda sizes, texts: _disc(sizes, texts, 0),
    "dyn_disc_phi_fun_jac": lambda sizes, texts: _disc(sizes, texts, 1),
    "dyn_disc_phi_fun_jac_hess": lambda sizes, texts: _disc(sizes, texts, 2),
}


def implicit(program: Program, functions: Sequence[Exported]) -> Equations | None:
    """Return 0 = (qdot - v, residual, zdot - rates, accelerations of constraints) in (x, xdot, z, u), x = (q, v, z).
    The variables z of acados are the multipliers of the constraints. None without the functions that are needed."""
    nq, nv, states, rows = program.input_size("q"), *(program.sizes[name] for name in ("v", "z", "lam"))
    by_name, nx = {function.name: function for function in functions}, nq + nv + states
    needed = [*(("residual",) if rows else ("inverse_dynamics",)), *(("internal_rate",) if states else ())]
    needed += ["constraint_acceleration"] if rows else []
    if not all(name in by_name for name in needed):
        return None
    firsts = dict(zip(needed, [nq, *([nq + nv] if states else []), *([nx] if rows else [])], strict=True))
    parts = [(by_name[name], first, -1 if name == "internal_rate" else 1) for name, first in firsts.items()]
    sizes = {"x": nx, "xdot": nx, "z": rows, "u": program.sizes["u"]}
    places = {"q": 0, "v": nq, "z": nq + nv, "a": nx + nq, "lam": 2 * nx, "u": 2 * nx + rows}
    return Equations(program, sizes, parts, places, implicit=True)


def families(program: Program, method: str | None) -> list[AcadosFunctions]:
    """Return the families of acados' functions that a model has: explicit, implicit, discrete; ``method``: of discrete
    steps.

    Raises
    ------
    ModelError
        A model with sampled states, or with angles that are counted over turns.
    """
    if names := program.angles:
        fault = f"acados integrates states that are smooth, and the turns of {', '.join(names)} are counted [E0935]"
        raise ModelError(Problem(program.prefix, fault, "formulas without this angle, or a joint of one angle"))
    if program.sampled:
        fault = "states that are sampled change between the steps of acados, which integrates continuous rates [E0936]"
        hint = "a model without the controller, which stands in the loop around acados"
        raise ModelError(Problem(program.prefix, fault, hint))
    functions = exported_functions(program)
    equations = {"explicit": rates(program, functions), "implicit": implicit(program, functions)}
    made = [AcadosFunctions(name, known) for name, known in equations.items() if known is not None]
    step = chain_of(program, functions, method, ("u",))
    return made if step is None else [*made, AcadosFunctions("discrete", None, step)]


def _model_files(program: Program, prefix: str, names: Sequence[str]) -> dict[str, str]:
    """Return the C files of the functions `names` of a model under a prefix, text by name."""
    kept = tuple(function for function in program.functions if function.name in {*names, "base"})
    whole = generate_files(replace(program, prefix=prefix, functions=kept, uniform=True))
    return {name: text for name, text in whole.items() if name not in ("main.c", "README.md", MANIFEST)}


def _file(ending: str, shared: Mapping[str, Any], firsts: Iterable[str], seconds: Iterable[str]) -> str:
    """Return the text of one C file of acados.

    Parameters
    ----------
    ending : of the name, such as ``expl_ode_fun``
    shared : values for the template that all files of the family have
    firsts, seconds : names of files with the model's functions and first derivatives, and with second derivatives
    """
    family, sizes, texts = shared["family"], shared["sizes"], Texts()
    entry, second = family.entries[ending](sizes, texts), ending.endswith("_hess")
    included = seconds if second else firsts if ending == next(iter(family.entries)) else ()
    first = entry["kind"] not in ("value", "step_0", "implicit_hessian") or bool(family.step and family.step.nu)
    of_model = [
        {"name": function.name, "components": texts.component_derivatives(function, first, second)}
        for function in family.functions
    ]
    names = {**shared, "entry": entry, "symbol": f"{shared['prefix']}_{ending}", "second": second}
    names |= {"included": sorted(file for file in included if file.endswith(".c")), "functions": of_model}
    names |= {"sparsities": texts.patterns, "tables": texts.tables}
    return environment().get_template("optimisers/acados.c.jinja").render(**names)


def files_of(program: Program, method: str | None) -> dict[str, str]:
    """Return the folder of a Program for acados, text by name: C of acados' functions and of the model, a Python
    module, README.md and the manifest. Raises UsageError if the terms have no dynamics, and ModelError as
    ``families``."""
    made, prefix = families(program, method), program.prefix
    if not made:
        fault = "no dynamics for acados are among the terms [E0937]"
        hint = "inverse_dynamics, forward_dynamics; residual and constraint_acceleration with constraints"
        raise UsageError(Problem("terms", fault, hint))
    files, symbols = dict[str, str](), list[dict[str, Any]]()
    states = program.input_size("q") + program.sizes["v"] + program.sizes["z"]
    inputs, rows = program.sizes["u"], program.sizes["lam"]
    timed = any(family.takes_time for family in made)
    parameters = program.sizes["p"] + timed
    # Explicit rates and explicit steps are made of the same functions.
    names_of = {family.name: {function.name for function in family.functions} for family in made}
    shared = {"discrete": "explicit"} if names_of.get("explicit") == names_of.get("discrete") else {}
    for family in made:
        first_of = f"{prefix}_{shared.get(family.name, family.name)}"
        second_of, terms = f"{first_of}_hessian", [function.name for function in family.functions]
        firsts = _model_files(program, first_of, [x for term in terms for x in (term, f"{term}_derivatives")])
        seconds = _model_files(program, second_of, [f"{term}_hessian" for term in terms])
        files |= firsts | seconds
        length = family.name == "discrete"
        z = rows if family.name == "implicit" else 0
        sizes = _Sizes(family, states, inputs, z, parameters + length)
        shared_names = {"program": program, "prefix": prefix, "family": family, "sizes": sizes, "timed": timed}
        shared_names |= {"np": program.sizes["p"], "first_prefix": first_of, "second_prefix": second_of}
        for ending in family.entries:
            files[f"{prefix}_{ending}.c"] = _file(ending, shared_names, firsts, seconds)
            symbols.append({"symbol": f"{prefix}_{ending}", "family": family.name})
    shapes = {"x": states, "u": inputs, "z": rows, "p": parameters, "timed": timed}
    known = {"program": program, "prefix": prefix, "families": [family.name for family in made]}
    known["method"] = next((family.step.title for family in made if family.step is not None), "")
    integrators = {"explicit": ["ERK"], "implicit": ["IRK", "LIFTED_IRK"], "discrete": ["DISCRETE"]}
    known["names"] = [name for family in made for name in integrators[family.name]]
    known |= {"shapes": shapes, "symbols": symbols, "sources": sorted([*files])}
    for name, template in ((f"{prefix}_acados.py", "acados.py.jinja"), ("README.md", "acados.md.jinja")):
        files[name] = environment().get_template(f"optimisers/{template}").render(**known)
    mark = fingerprint(files)
    summary = {"sizes": shapes, "families": known["families"], "symbols": [item["symbol"] for item in symbols]}
    files[MANIFEST] = manifest(program, files, fingerprint=mark, acados=summary)
    return files


def needed_terms(terms: Sequence[str] | None) -> list[str]:
    """Return the terms of a model that the folder needs: each named function with first and second derivatives, and
    rates of internal states; all that there are by default.

    Raises
    ------
    UsageError
        A term that no function of acados is made of, or an empty list of terms.
    """
    check_named(terms)
    chosen = list(_TERMS) if terms is None else list(terms)
    for name in chosen:
        if name not in _TERMS:
            fault = f"the target acados writes dynamics with derivatives, and {shown(str(name))} is none [E0938]"
            raise UsageError(Problem("terms", fault, nearest(str(name), _TERMS)))
    if terms is not None and "internal_rate" not in chosen:
        chosen.append("internal_rate")
    return [term for name in chosen for term in (name, f"{name}_derivatives", f"{name}_hessian")]


ACADOS = Target("acados", "C for acados", NAMES, files_of, terms=needed_terms, takes_method=True)
