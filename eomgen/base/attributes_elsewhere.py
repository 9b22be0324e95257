"""Attributes of models, solutions, simulators and linear models in other tools, and their equivalents here.

Keys are names of public classes; ``""`` is the package itself.
"""

from __future__ import annotations

from collections.abc import Mapping

_OF_MOTIONS = "simulate(...).{0}, of a motion; a model has initial_{0}"
_RUN = "simulate(t_end, step=...)"
_STEPS = "step(n=...) or advance(t)"
_MODES = "modes(), which has eigenvalues, frequency and damping_ratio"
_CSV = 'save("run.csv")'
_STATES = 'q, v and z; solution["q.joint"] is one column'
_PARAMETERS = "simulate(..., parameters={...}); between steps start(...).set_parameter(name, value)"

ATTRIBUTES: Mapping[str, Mapping[str, str]] = {
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
        **dict.fromkeys(("to_csv", "to_file", "write"), _CSV),
        **dict.fromkeys(("errors", "error"), "error_estimate, of the motion, or energy_error"),
        **dict.fromkeys(("nfev", "steps"), 'stats["gradients"] or stats["steps"]'),
    },
    "Model": {
        **dict.fromkeys(("step", "advance"), "start(step=...), whose step(u) takes one step"),
        **dict.fromkeys(("run", "solve", "sim", "integrate_motion", "propagate"), _RUN),
        **dict.fromkeys(("reset", "simulator", "env", "make_data"), "start(step=...), which makes a Simulator"),
        **{name: _OF_MOTIONS.format(name) for name in ("q", "v", "z")},
        **dict.fromkeys(("a", "t", "x", "y", "u", "state", "data"), "simulate(...), whose solution has t, q, v, a, z"),
        **dict.fromkeys(("q0", "x0", "qpos0"), "initial_q"),
        **dict.fromkeys(("v0", "dq0", "qd0", "qdot0"), "initial_v"),
        **dict.fromkeys(("set_parameter", "set_parameters", "set_param"), _PARAMETERS),
        **dict.fromkeys(("set_input", "set_inputs"), "simulate(..., inputs={...}), or start(...).step(u)"),
        **dict.fromkeys(("set_state", "set_initial", "set_q"), "simulate(..., initial={...})"),
        **dict.fromkeys(("joints", "joint_names", "dofs", "coordinates"), "q_names, which names each coordinate"),
        **dict.fromkeys(("links", "link_names", "body_names"), "bodies"),
        "frame_names": "frames",
        **dict.fromkeys(
            ("nle", "nonlinear_effects", "qfrc_bias"), "coupling(q, v) - force(q, v), since forces hold gravity"
        ),
        **dict.fromkeys(("gravity", "g", "generalized_gravity"), "force(q, v), which holds gravity; at rest v = 0"),
        **dict.fromkeys(("eigenvalues", "modes", "poles", "frequencies"), "linearize().modes()"),
        **dict.fromkeys(("A", "B", "state_space", "ss"), "linearize().state_space()"),
        **dict.fromkeys(("plot", "animate"), "simulate(...).plot() or .animate(path)"),
        **dict.fromkeys(("save", "export"), "simulate(...).save(path), or eomgen.generate(scene, folder) for C"),
        **dict.fromkeys(("generate", "to_c", "codegen"), "eomgen.generate(scene, folder)"),
    },
    "Solution": {
        **dict.fromkeys(("y", "x", "X", "Y", "states", "state"), _STATES),
        **dict.fromkeys(("time", "times", "ts", "tout", "T"), "t"),
        **dict.fromkeys(("qdd", "qddot", "vdot", "ddq"), "a"),
        **dict.fromkeys(("u", "input", "controls"), "inputs"),
        **dict.fromkeys(("parameters", "params", "parameter_values"), 'metadata["parameters"]'),
        **dict.fromkeys(("lam", "lambda_", "reactions", "forces"), "multipliers, or outputs that name a reaction"),
        **dict.fromkeys(
            ("section_forces", "internal_forces", "stress_resultants", "strains", "internal_loads"),
            "section_loads, by the names of geometrically exact beams",
        ),
        **dict.fromkeys(("to_csv", "csv", "write", "export"), _CSV),
        **dict.fromkeys(("df", "dataframe", "to_df", "to_dataframe"), "to_pandas()"),
        **dict.fromkeys(("keys", "names"), "columns(), which has all columns by name"),
        **dict.fromkeys(("status", "ok", "converged"), "success and message"),
        **dict.fromkeys(("sol", "interpolate"), "at(t)"),
        **dict.fromkeys(("animation", "show"), "animate(path)"),
    },
    "Simulator": {
        **dict.fromkeys(("simulate", "run", "integrate", "step_to", "solve"), _STEPS),
        "reset": "set_state(initial), restore(state), or another model.start(...)",
        **dict.fromkeys(("set_input", "set_inputs", "apply"), "step(u), which takes the inputs of its steps"),
        **dict.fromkeys(("set_q", "set_qpos", "set_positions"), 'set_state({"q": q, "v": v})'),
        **dict.fromkeys(("time", "now"), "t"),
        **dict.fromkeys(("x", "y"), "q, v and z"),
        **dict.fromkeys(("u", "input", "controls", "ctrl"), "inputs"),
        **dict.fromkeys(("qdd", "qddot", "vdot", "qacc"), "a"),
        **dict.fromkeys(("result", "results", "history", "trajectory"), "record() at each row, then solution()"),
    },
    "Linearization": {
        **{name: f"state_space().{name}" for name in ("A", "B", "C", "D")},
        **dict.fromkeys(("eigenvalues", "poles", "eigs", "eigenvectors", "frequencies", "damping"), _MODES),
        **dict.fromkeys(("bode", "bode_plot"), "plot_response(...), or frequency_response(omega, input, output)"),
        **dict.fromkeys(("ss", "to_ss", "statespace"), "state_space()"),
        **{name: f"{name}0" for name in ("M", "K")},
    },
    "Modes": {
        **dict.fromkeys(("frequencies", "freq", "f", "hz"), "frequency, Hz, or angular_frequency, rad/s"),
        **dict.fromkeys(("omega", "wn", "natural_frequencies", "angular_frequencies"), "angular_frequency, rad/s"),
        **dict.fromkeys(("damping", "zeta", "damping_ratios"), "damping_ratio"),
        **dict.fromkeys(("vectors", "eigenvectors", "mode_shapes", "phi"), "shapes, with rows by coordinates"),
        **dict.fromkeys(("values", "poles", "eigs", "roots"), "eigenvalues"),
    },
    "StateSpace": {
        **dict.fromkeys(("poles", "eigs", "modes"), "eigenvalues; a linearization has modes()"),
        **dict.fromkeys(("a", "b", "c", "d"), "A, B, C and D"),
        **dict.fromkeys(("bode", "freqresp", "response"), "frequency_response(omega, input, output)"),
        **dict.fromkeys(("dt", "Ts"), "sample"),
        **dict.fromkeys(("c2d", "discretize", "sampled"), "eomgen.control.lqr and place, which take a sample"),
    },
    "Regulator": {
        **dict.fromkeys(("K", "G", "gain_matrix", "L"), "gains"),
        **dict.fromkeys(("P", "S", "X", "cost", "solution"), "cost_left"),
        **dict.fromkeys(("poles", "E", "eigs"), "eigenvalues, of the closed loop"),
    },
    "SceneBuilder": {
        **dict.fromkeys(("to_scene", "finish", "make", "compile", "create"), "build(), which returns the Scene"),
    },
    "": {
        **dict.fromkeys(("Simulator", "start"), "eomgen.build(scene).start(...)"),
        **dict.fromkeys(("load_urdf", "load_scene", "read", "load_toml", "from_urdf", "open"), "load"),
        **dict.fromkeys(("buildModelFromUrdf", "buildModelFromMJCF", "parse_urdf", "urdf"), 'load("robot.urdf")'),
        **dict.fromkeys(("run", "solve"), "eomgen.build(scene).simulate(...)"),
        **dict.fromkeys(("compile", "make"), "build"),
        **{name: f"eomgen.control.{name}" for name in ("lqr", "place", "kalman")},
    },
}
