"""What tests hold the families of linearly implicit, discontinuous and variational steps to, besides the orders."""

from __future__ import annotations

from typing import NamedTuple


class Check(NamedTuple):
    """What is held, with its bounds, and where: tests as ``file::function`` below ``tests``."""

    held: str
    tests: tuple[str, ...]


_ROSENBROCK = "integrators/test_rosenbrock.py"
_EXTREMES = "integrators/test_rosenbrock_extremes.py"
_GALERKIN = "integrators/test_discontinuous_galerkin.py"
_STABILITY = "integrators/test_stability_certificates.py"
_RATTLIE = "integrators/test_rattlie.py"
_WAVE = "examples/test_scalar_wave.py"
_FRAME = "examples/test_shear_frame.py"
_IN_TIME = "compiled/test_beams_in_time.py"
_BY_STEPPERS = "compiled/test_beams_by_steppers.py"
_NOODLES = "compiled/test_constrained_beams.py"

CHECKS = (
    Check(
        "`rosenbrock` is of order 2 (1.95 to 2.05) where a pendulum tumbles; of order 1 with forces of the start alone"
        " (0.9 to 1.1), and below 1.3 without the part of K by accelerations",
        (f"{_ROSENBROCK}::test_a_step_is_that_of_the_formula_and_its_order_hangs_on_each_part",),
    ),
    Check(
        "its balance of energy is exact for linear forces: to 1e-14, 1e-10, 1e-9, 1e-6 of the energy a step at h omega"
        " of 1e-3, 1, 1e3, 1e6, for 8 coordinates with stiffnesses of 8 decades, and for 50 at 1e3 over 2000 steps; it"
        " never grows",
        (f"{_EXTREMES}::test_the_balance_of_energy_of_a_linear_step_is_exact",),
    ),
    Check(
        "stiff driven motions, h omega = 1e5: positions to 1e-11 undamped and 1e-8 damped, velocities of order 2",
        (f"{_EXTREMES}::test_a_stiff_driven_motion_is_met_in_positions_and_to_order_2_in_velocities",),
    ),
    Check(
        "every step is the same operations, without iterations",
        (f"{_ROSENBROCK}::test_every_step_is_the_same_operations",),
    ),
    Check(
        "`lsrt2` keeps order 2 (0.05) with a matrix kept from the start, or one that lacks accelerations;"
        " `corrected_predictor` (at least 1.95) with a kept one",
        (
            f"{_ROSENBROCK}::test_two_stages_keep_their_order_with_any_matrix",
            "integrators/test_corrected_predictor.py::test_order_with_a_kept_matrix_where_the_pendulum_tumbles",
        ),
    ),
    Check(
        "parts of the stiffness that the matrix has to have, by exact polynomials: 1, (2 + sqrt 2)/4 and 2/3 for"
        " `rosenbrock`, `lsrt2` and `corrected_predictor`; without its linear update the last one bears only 1",
        (
            f"{_STABILITY}::test_one_stage_neither_damps_nor_grows_with_the_true_stiffness_or_more",
            f"{_STABILITY}::test_two_stages_are_stable_from_085_of_the_stiffness_on_and_damp_all_of_an_infinite_one",
            f"{_STABILITY}::test_a_corrected_prediction_is_stable_from_two_thirds_of_the_stiffness_on",
            f"{_STABILITY}::test_without_the_linear_update_of_its_force_it_is_not",
        ),
    ),
    Check(
        "orders of the passes on a strongly nonlinear oscillator: 3 (0.1), 5 (0.15), 7 (0.4); errors at T/160 of at"
        " most 1.2e-4, 4e-8, 6e-11; five passes leave `tdg3` at order 6",
        (
            f"{_GALERKIN}::test_a_strongly_nonlinear_oscillator",
            f"{_GALERKIN}::test_five_passes_would_leave_order_6",
        ),
    ),
    Check(
        "all passes are A- and L-stable, by exact polynomials without a negative coefficient",
        (
            "integrators/test_galerkin_stability.py::test_the_passes_are_l_stable",
            "integrators/test_galerkin_stability.py::test_a_third_pass_of_tdg2s_would_not_be_stable",
        ),
    ),
    Check(
        "damping that is stiff for the step takes orders from velocities: 2.8 in place of 5 by `tdg2`, 2 in place of 4"
        " by `tdg2s`, at x = sin t with a damper of 1e7/s and steps of 1/8 to 1/32 s; positions keep their orders"
        " there, and lose some where they follow from such velocities through other bodies",
        ("integrators/test_orders_under_stiff_damping.py::test_velocities_lose_orders_under_stiff_damping",),
    ),
    Check(
        "stiff forces of a known motion: positions to 1e-10, velocities to 5e-2, 2e-3, 2e-5, 1e-5 by `tdg1`,"
        " `tdg1_star`, `tdg2`, `tdg3`; the operator of the parent in the first pass would lose 1000 times as much",
        (
            f"{_GALERKIN}::test_stiff_forces_of_a_known_motion",
            f"{_GALERKIN}::test_the_parents_operator_in_the_first_pass_would_lose_stiff_forces",
        ),
    ),
    Check(
        "massless coordinates: the balance to 1e-13 from a start that misses it, and the orders",
        (
            "integrators/test_singular_mass.py::test_order_and_the_algebraic_equation_where_mass_is_nothing",
            "integrators/test_singular_mass.py::test_a_start_that_meets_no_equation_is_forgotten_by_a_damped_one_only",
        ),
    ),
    Check(
        "the pulse in a bar: errors at 4800 solves of 2e-3, 3.5e-4, 5e-6 by `trapezoidal`, `tdg1`, `tdg2`; `tdg3` has"
        " 8e-7 there, and 3e-7 at 5760, for it takes six passes",
        (f"{_WAVE}::test_small_steps_meet_their_thresholds",),
    ),
    Check(
        "a shock in it: overshoot, mean error and total variation of six methods, within 1 %",
        (f"{_WAVE}::test_a_shock_overshoots_as_by_methods_written_by_hand",),
    ),
    Check(
        "the stiff frame: `tdg3` to 5e-8 at h omega = 320 (asked at 400, where it has 1.9e-7);"
        " explicit steps fail from h omega = 3 on",
        (
            f"{_FRAME}::test_passes_step_over_what_is_stiff_at_high_order",
            f"{_FRAME}::test_explicit_steps_beyond_their_limit_fail",
        ),
    ),
    Check(
        "h omega from 1e-6 to 1e12 at damping ratios from 0 to 50: finite, and spectral radii within 1 up to rounding",
        ("integrators/test_spectral_radius.py::test_spectral_radius_is_at_most_one",),
    ),
    Check(
        "relative springs of 1 to 1e30 N/m between moving masses: solved to the last digits",
        ("integrators/test_relative_springs.py::test_matrices_are_solved_to_the_last_digits_at_any_stiffness",),
    ),
    Check(
        "growth beyond the pole of a step is reported",
        ("integrators/test_unfollowed_growth.py::test_a_run_ends_where_growth_is_lost_and_says_what_to_do",),
    ),
    Check(
        "the fast heavy top, steps 2^-10 to 2^-13 s: order 2 on all groups by `generalized_alpha` and `rattlie`;"
        " multipliers of one side of `rattlie` and their jumps are of order 1, their means of order 2",
        (
            "integrators/test_constrained.py::test_errors_and_orders_of_the_heavy_top",
            f"{_RATTLIE}::test_digits_and_orders_of_the_fast_top",
            f"{_RATTLIE}::test_jumps_of_multipliers_are_of_order_1",
        ),
    ),
    Check(
        "`rattlie` over 10 s of it: angular momentum to 1e-8, energy within -0.03 to 0.27 J without a trend,"
        " constraints and their rates to 1e-13",
        (f"{_RATTLIE}::test_invariants_of_the_top_over_10_s",),
    ),
    Check(
        "`rattlie` at random steps: positions and velocities of order 2 (0.15), mean multipliers above 1.8",
        (f"{_RATTLIE}::test_order_at_steps_that_vary",),
    ),
    Check(
        "geometrically exact beams: the end of the flying spaghetti to 1e-6 m of published digits for 4 to 32 elements,"
        " and every step of 4 elements that of Hante, Tumiotto and Arnold's scheme in NumPy",
        (
            f"{_NOODLES}::test_the_thrown_end_is_where_another_implementation_has_it",
            f"{_IN_TIME}::test_steps_of_the_flying_spaghetti_are_those_of_the_published_scheme",
        ),
    ),
    Check(
        "16 of its elements by `rattlie`: order 2 (0.1) of positions and velocities from 2^-8 to 2^-12 s, of what"
        " stretches along the axis, and of section forces, from 2^-10 s on (stretch oscillates at 320 rad/s); without"
        " stretch all are of order 2 from 2^-7 s on",
        (f"{_IN_TIME}::test_noodles_are_of_order_2_at_steps_that_resolve_them",),
    ),
    Check(
        "free flight by `rattlie`: energy within 2e-4 J of 875 at 2^-10 s, of order 2 without a trend; momenta to 1e-8;"
        " the centre of mass to 1e-11 m where nodes move on R^3 x SO(3), and on SE(3) to order 2, 5e-5 m, as by the"
        " published scheme",
        (
            f"{_NOODLES}::test_free_flight_keeps_what_mechanics_says",
            f"{_IN_TIME}::test_a_centre_of_mass_flies_straight_where_nodes_travel_and_turn_apart",
        ),
    ),
    Check(
        "a roll-up that a moment starts: order 2 towards a planar model by SciPy; its end is 2.6e-3 from the clamp"
        " after 30 s with a damping of 200 (Cd = 100), as damping has it, and not 1e-3",
        (
            f"{_IN_TIME}::test_a_strip_rolls_up_as_a_planar_model_does",
            f"{_IN_TIME}::test_how_close_a_strip_is_rolled_up_after_30_s_is_what_its_damping_leaves",
        ),
    ),
    Check(
        "the right-angle cantilever at steps of 0.2 s: 150 steps of at most 20 iterations, 8 in the mean, elbow and tip"
        " within 3 % of the peak up to 10 s",
        (f"{_IN_TIME}::test_the_right_angle_cantilever_takes_long_steps",),
    ),
    Check(
        "an elastic coupler in a closed loop: order 2 (0.15) of positions, velocities and multipliers at random"
        " steps by `generalized_alpha`, `rosenbrock` and `rattlie`, and (0.1) at steps by tolerances",
        (
            f"{_BY_STEPPERS}::test_order_2_through_a_loop_at_steps_that_vary",
            f"{_BY_STEPPERS}::test_order_2_through_a_loop_at_steps_by_tolerances",
        ),
    ),
    Check(
        "beams that shear and stretch by `tdg1`, `tdg2`, `tdg3`: orders 3, 5, 7; beams that do not are refused",
        (
            f"{_BY_STEPPERS}::test_beams_that_shear_and_stretch_fly_by_methods_of_higher_order",
            f"{_BY_STEPPERS}::test_methods_without_constraints_refuse_beams_without_shear",
        ),
    ),
)


def listed() -> str:
    """Return the checks as a list of Markdown."""
    lines = []
    for check in CHECKS:
        by_file: dict[str, list[str]] = {}
        for one in check.tests:
            file, _, function = one.partition("::")
            by_file.setdefault(file, []).append(f"`{function}`")
        where = "; ".join(f"`tests/{file}`: {', '.join(functions)}" for file, functions in by_file.items())
        lines.append(f"- {check.held[0].upper()}{check.held[1:]}. {where}\n")
    return "".join(lines)
