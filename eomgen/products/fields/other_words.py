"""Names of attributes of the product fields in other programs, and the remedy, by class, for messages."""

from __future__ import annotations

_RUN = "simulate(t_end, step=...)"

ATTRIBUTES: dict[str, dict[str, str]] = {
    "HamiltonianModel": {
        **dict.fromkeys(("run", "solve", "sim", "integrate", "propagate"), _RUN),
        **dict.fromkeys(("H", "hamiltonian"), "energy(q, p)"),
        **dict.fromkeys(("grad", "dH", "rates", "rhs", "forces"), "gradient(q, p), which gives dH/dq and dH/dp"),
        **dict.fromkeys(("hessian", "hess", "hvp"), "hessian_product(q, p, dq, dp)"),
        **dict.fromkeys(("sample", "hmc"), "eomgen.sampling.sample(...), of a file with a [mesh]"),
    },
    "HamiltonianSolution": {
        **dict.fromkeys(("time", "times"), "t"),
        **dict.fromkeys(("x", "y", "state", "data"), "q and p, or columns(), by name"),
        **dict.fromkeys(("H", "E", "hamiltonian"), 'energy["total"]'),
        **dict.fromkeys(("plot", "draw"), "columns() with matplotlib; eomgen simulate FILE --out DIR draws them"),
        **dict.fromkeys(("to_csv", "to_file", "write"), 'save("run.csv")'),
        **dict.fromkeys(("errors", "error"), "error_estimate, of the motion, or energy_error"),
        **dict.fromkeys(("nfev", "steps"), 'stats["gradients"] or stats["steps"]'),
    },
}
