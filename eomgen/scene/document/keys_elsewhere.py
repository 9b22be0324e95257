"""Keys as they are called elsewhere, and which key of a table is meant."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from eomgen.scene.document.examples import is_file, quoted

#: Names of keys in other tools; the first of the keys that a table has is meant.
_KEYS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("dt", "time_step", "timestep", "step_size", "h"), ("step", "sample")),
    **dict.fromkeys(("t_end", "tend", "end", "end_time", "stop_time", "t_final"), ("duration",)),
    **dict.fromkeys(("integrator", "solver"), ("method",)),
    **dict.fromkeys(("com", "cog", "cg", "centre_of_mass", "center"), ("center_of_mass",)),
    **dict.fromkeys(("I", "J", "inertia_tensor", "moments"), ("inertia",)),
    **dict.fromkeys(("m",), ("mass",)),
    **dict.fromkeys(("k", "spring_constant"), ("stiffness",)),
    **dict.fromkeys(("c", "d", "damper"), ("damping",)),
    **dict.fromkeys(("l0", "length0", "rest_length", "free_length", "natural_length"), ("length",)),
    **dict.fromkeys(("body1", "from", "point1", "a", "start"), ("first", "parent")),
    **dict.fromkeys(("body2", "to", "point2", "b", "end"), ("second", "child")),
    **dict.fromkeys(("pos", "origin", "xyz", "location"), ("position",)),
    **dict.fromkeys(("angle", "q", "q0", "x", "value0"), ("position",)),
    **dict.fromkeys(("rate", "v", "v0", "speed", "omega"), ("velocity",)),
    **dict.fromkeys(("rpy", "orientation", "euler"), ("rotation", "orientation")),
    **dict.fromkeys(("torque", "force", "value"), ("effort", "formula")),
    **dict.fromkeys(("expression", "function", "law"), ("formula",)),
    **dict.fromkeys(("period", "ts", "sample_time"), ("sample",)),
    **dict.fromkeys(("condition", "trigger", "guard"), ("when",)),
    **dict.fromkeys(("units",), ("unit",)),
    **dict.fromkeys(("error", "e", "measurement", "input_signal"), ("signal",)),
    **dict.fromkeys(("kp", "p", "p_gain", "gain_p"), ("proportional",)),
    **dict.fromkeys(("ki", "i_gain", "gain_i"), ("integral",)),
    **dict.fromkeys(("kd", "d_gain", "gain_d"), ("derivative",)),
    **dict.fromkeys(("tau", "tf", "filter", "filter_time", "time_const"), ("time_constant",)),
    **dict.fromkeys(("umax", "u_max", "max"), ("maximum", "upper")),
    **dict.fromkeys(("umin", "u_min", "min"), ("minimum", "lower")),
    **dict.fromkeys(("mu_s", "stiction"), ("static",)),
    **dict.fromkeys(("derivative", "ode", "equation", "dot"), ("rate", "formula")),
    # beams
    **dict.fromkeys(("E", "young", "youngs_modulus", "young_modulus", "modulus"), ("elastic_modulus",)),
    **dict.fromkeys(("rho",), ("density",)),
    **dict.fromkeys(("nu", "poisson"), ("poisson_ratio",)),
    **dict.fromkeys(("G",), ("shear_modulus",)),
    **dict.fromkeys(("EI", "EA", "GJ", "GA"), ("stiffness", "section")),
    # waves and hulls
    **dict.fromkeys(("hs", "h_s", "hm0", "significant_height"), ("height",)),
    **dict.fromkeys(("tp", "t_p", "peak_period"), ("period",)),
    **dict.fromkeys(("gamma",), ("peakedness",)),
    **dict.fromkeys(("wind_speed", "u19", "u10"), ("wind",)),
    **dict.fromkeys(("direction", "mean_direction"), ("heading",)),
    **dict.fromkeys(("water_depth",), ("depth",)),
    **dict.fromkeys(("cd", "c_d"), ("drag",)),
    **dict.fromkeys(("ca", "c_a"), ("added_mass",)),
    **dict.fromkeys(("draft", "draught"), ("wet",)),
    # sections
    **dict.fromkeys(("loops", "loop", "closures", "equality"), ("constraints",)),
    **dict.fromkeys(("links", "link", "masses"), ("bodies",)),
    **dict.fromkeys(("motors", "actuators", "torques"), ("efforts",)),
    **dict.fromkeys(("sensors", "measurements"), ("outputs",)),
    **dict.fromkeys(("constants", "params", "variables"), ("parameters",)),
    **dict.fromkeys(("dampers", "spring_dampers"), ("springs",)),
    **dict.fromkeys(("markers", "sites"), ("points",)),
    **dict.fromkeys(("tires", "wheels"), ("tyres",)),
}

#: Keys of the body that carries a place: the base has none.
_CARRIED = frozenset({"body", "parent"})


def key_meant(name: str, keys: Collection[str], given: object) -> str:
    """Return the key, or keys, for a name from another tool; empty without one."""
    if "table" in keys and (name in ("file", "csv", "path", "data", "filename") or is_file(given)):
        return f"table = {{ file = {quoted(given)} }}"
    if name in ("frequency", "freq", "f") and "period" in keys and isinstance(given, int | float) and given > 0:
        return f"period = {1.0 / given:.6g}, s"
    if name in ("mu", "mu_k", "coefficient") and "coulomb" in keys:
        return "coulomb, a force in N or a torque in N m: no normal force is multiplied by a coefficient"
    if name in ("x", "y", "z") and "position" in keys and isinstance(given, str | int | float):
        entries = ", ".join(quoted(given) if axis == name else "0" for axis in "xyz")
        return f"position = [{entries}]"
    if name == "height" and "amplitude" in keys and isinstance(given, int | float):
        return f"amplitude = {0.5 * given:.6g}, half of the height"
    of_base = {"position", "rotation"} <= set(keys) and _CARRIED.isdisjoint(keys)
    if name in ("acceleration", "velocity", "angular_velocity") and of_base:
        integral = "its second integral" if name == "acceleration" else "its integral"
        place = "rotation" if name.startswith("angular") else "position"
        return f"{place} alone, from which rates follow: a formula of t, or a curve through {integral}"
    if "stiffness_damping" in keys and name in ("mass_damping", "alpha", "rayleigh"):
        return "stiffness_damping in s, D = this times K; none goes with the mass: a load -c * velocity.here does it"
    if "stiffness_damping" in keys and name in ("damping_ratio", "modal_damping", "zeta"):
        return "stiffness_damping, 2 ratio / w in s for the ratio at the angular frequency w"
    if name == "initial" and {"shape", "curvature", "section"} <= set(keys):
        return 'shape or curvature, of the beam at rest; runs start bent by start = "equilibrium" or initial={"q": ...}'
    if name.lower() in ("cm", "c_m") and "added_mass" in keys:
        return "added_mass, which is c_m - 1"
    meant = _KEYS.get(name, _KEYS.get(name.lower(), ()))
    return next((key for key in meant if key in keys), "")
