"""Names of attributes of the product linear in other programs, and the remedy, by class, for messages."""

from __future__ import annotations

_MODES = "modes(), which has eigenvalues, frequency and damping_ratio"

ATTRIBUTES: dict[str, dict[str, str]] = {
    "": {name: f"eomgen.control.{name}" for name in ("lqr", "place", "kalman")},
    "Model": {
        **dict.fromkeys(("eigenvalues", "modes", "poles", "frequencies"), "linearize().modes()"),
        **dict.fromkeys(("A", "B", "state_space", "ss"), "linearize().state_space()"),
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
}
