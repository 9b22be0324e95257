"""Which tests only `make test-all` runs: large samples of something of which `make test` runs a witness.

One table. A key is a test function, or a file; its value is what of its parametrisation stays in the first tier (ids in full).
Tests marked `slow` where they are written are of the second tier as well.
"""

from __future__ import annotations

from collections.abc import Sequence

SLOW: dict[str, tuple[str, ...]] = {
    "analysis/test_equilibrium.py::test_a_chain_of_rods_hangs_by_its_polygon_of_forces_and_nears_the_catenary": (),
    "analysis/test_equilibrium.py::test_slender_bodies_and_a_bad_start_are_no_trouble": (),
    "analysis/test_equilibrium.py::test_the_command_line_finds_where_a_scene_rests": (),
    "analysis/test_equilibrium.py::test_what_nothing_holds_is_named": (),
    "analysis/test_nearest_equilibrium.py::test_rest_is_the_same_in_other_units": ("False-tree", "True-four_bar"),
    "analysis/test_nearest_equilibrium.py::test_springs_that_end_inside_out_are_named": (),
    "benchmarks/test_multibody_scripts.py": (),
    "benchmarks/test_scripts.py::test_generation_time_measures_every_stage": (),
    "benchmarks/test_scripts.py::test_robot_dynamics_finds_its_own_numbers_right": (),
    "benchmarks/test_scripts.py::test_time_derivatives_meet_the_closed_form": (),
    "browser/test_animation_page.py::test_bodies_are_where_the_projection_says_at_two_times": ("light",),
    "cli/test_linearize.py::test_about_a_steady_motion": (),
    "codegen/test_arithmetic.py::test_every_operation_agrees_with_the_tape": ("double-4e-15", "complex-4e-15"),
    "codegen/test_arithmetic.py::test_not_a_number_passes_through_comparisons_and_choices": (
        "quick-double", "fast-double", "fast-lanes",
    ),
    "codegen/test_arithmetic.py::test_not_a_number_passes_through_min_max_abs_and_sign": (
        "quick-double", "fast-double", "fast-lanes",
    ),
    "codegen/test_checkpoints_in_c.py::test_inputs_are_held_over_a_step": ("hermite",),
    "codegen/test_golden.py::test_hash_seeds_do_not_change_a_byte": ("1",),
    "codegen/test_loops.py::test_loop_equals_unrolled_and_the_tape": ("double", "float"),
    "codegen/test_recurrence.py::test_without_the_inertia_matrix_forward_dynamics_serves": (),
    "codegen/test_rerolling.py::test_the_text_of_a_chain_does_not_grow_with_its_links": (),
    "codegen/test_schedule.py::test_numbers_are_those_of_the_tape": ("1500-6-1000000000", "1-40-1000000000"),
    "codegen/test_stand_alone.py::test_program_runs_as_simulate_does": (
        "generalized_alpha-True", "rk4-True", "taylor-False", "hermite-False",
    ),
    "compiled/test_against_oracles.py::test_compiled_partials_against_complex_steps_through_the_compiled_residual": (
        "robot_arm", "active_vehicle", "random 1",
    ),
    "compiled/test_beams.py::test_a_beam_in_free_flight_keeps_its_momenta": (),
    "compiled/test_constraints.py::test_a_model_of_few_terms_runs_by_its_own_method_and_by_others": (),
    "compiled/test_constraints.py::test_other_forms_reach_the_same_end": ("generalized_alpha_index3_f2",),
    "compiled/test_examples.py::test_four_number_types_agree_on_every_function": (
        "quarter_car/scene.toml", "four_bar/scene.toml",
    ),
    "compiled/test_examples.py::test_the_folder_compiles_strictly_and_runs_under_sanitizers_as_python_does": (
        "four_bar/scene.toml", "quarter_car/scene.toml",
    ),
    "compiled/test_force_elements.py::test_four_number_types_agree_on_force_elements": (),
    "compiled/test_internal_states.py::test_long_trees_carry_states": (),
    "compiled/test_internal_states.py::test_orders_on_rigid_motions": ("rk4-steps1-4.0-0.2",),
    "compiled/test_internal_states.py::test_orders_with_constraints": ("generalized_alpha-steps0-2.0-0.1",),
    "compiled/test_joint_types.py::test_a_nut_falls_along_its_screw": ("0.3-loop",),
    "compiled/test_model.py::test_only_the_terms_a_method_needs_are_enough_for_it": (),
    "compiled/test_rates.py::test_free_motion_and_coriolis_matrices_in_compiled_code": (),
    "docs/test_docs.py::test_python_runs": ("python.md",),
    "examples/test_active_quarter_car.py::test_runs_are_sums_of_harmonic_responses": ("passive",),
    "examples/test_active_quarter_car.py::test_simulated_values_are_near_the_stationary_ones": (),
    "examples/test_active_vehicle.py::test_demonstration_says_what_to_do_about_a_folder_it_cannot_make": (),
    "examples/test_active_vehicle.py::test_demonstration_writes_code_solutions_table_and_figure": (),
    "examples/test_arms.py::test_fastest_move_keeps_to_its_limits_and_is_tracked": (),
    "examples/test_elastic_full_car.py": (),
    "examples/test_elastic_pendulum.py::test_it_swings_as_geometrically_exact_beams_do_and_keeps_its_energy": (),
    "examples/test_elastic_pendulum.py::test_what_order_and_stiffening_change": (),
    "examples/test_elastic_slider_crank.py::test_ladder_of_stiffness_ends_at_the_rigid_mechanism": (
        "generalized_alpha_index3",
    ),
    "examples/test_elastic_slider_crank.py::test_partitioned_coordinates_give_the_samples_of_both_variants": (),
    "examples/test_elastic_vehicle.py::test_runs_are_sums_of_harmonic_responses": ("passive",),
    "examples/test_elastic_vehicle.py::test_simulated_values_are_near_the_stationary_ones": (),
    "examples/test_elastic_vehicle.py::test_three_elastic_modes_have_the_published_frequencies": (),
    "examples/test_half_car.py::test_motion": ("rk4-0.0005-5e-08", "generalized_alpha-0.001-0.001"),
    "examples/test_heavy_top.py::test_reference_meets_the_published_digits": (),
    "examples/test_machines.py::test_absolute_coordinates_give_the_same_motion": ("slider_crank_planar",),
    "examples/test_machines.py::test_both_coordinates_place_the_last_body_as_the_closed_form_does": ("slider_crank_planar",),
    "examples/test_machines.py::test_loop_moves_as_its_energy_integral_says": ("slider_crank_planar", "four_bar"),
    "examples/test_pi_servo.py::test_with_limits_it_is_what_its_equations_say": ("0.3",),
    "examples/test_rotations.py::test_free_body_flips_after_the_time_of_the_elliptic_integral": ("joint",),
    "examples/test_rotations.py::test_hanging_chain_on_its_moving_base_is_the_same_in_both_coordinates": (),
    "examples/test_rotations.py::test_hanging_chain_reaches_the_tip_of_another_engine": (),
    "examples/test_rotations.py::test_symmetric_top_of_simo_and_wong": ("joint",),
    "examples/test_small_examples.py::test_a_robot_arm_with_axes_beside_z_moves_as_one_with_axes_along_z": (),
    "examples/test_small_examples.py::test_commands_of_the_readme_run": ("quarter_car", "heavy_top", "spin_up_beam"),
    "examples/test_small_examples.py::test_each_scene_runs_as_it_says": ("heavy_top/se3.toml", "spin_up_beam/scene.toml"),
    "examples/test_small_examples.py::test_robot_arm_agrees_with_pinocchio": (),
    "examples/test_small_examples.py::test_robot_arm_follows_the_torques_of_inverse_dynamics": (),
    "examples/test_small_examples.py::test_spherical_pendulum_sweeps_its_cone": (),
    "examples/test_spin_up_beam.py::test_any_number_of_modes_follows_the_linear_equation": ("1",),
    "examples/test_spin_up_beam.py::test_both_sets_follow_the_linear_equation": ("scene-beam0",),
    "examples/test_spin_up_beam.py::test_demonstration_writes_code_solutions_table_and_figure": (),
    "extremes/test_reproductions.py::test_1_an_axis_beside_a_coordinate_axis_turns_about_itself": (
        "beside0-revolute", "beside1-helical", "beside2-cylindrical",
    ),
    "failures/test_solution_files.py::test_no_flipped_byte_raises_anything_else": (),
    "integrators/test_c_stepper.py::test_c_gives_what_numpy_gives": ("heavy_top-alpha", "tied_body-alpha", "shaken-rkmk"),
    "integrators/test_c_stepper.py::test_quaternions_keep_their_length_and_are_not_flipped": ("alpha",),
    "integrators/test_constrained.py::test_c_gives_what_numpy_gives": ("links-stabilised-F0",),
    "integrators/test_constrained.py::test_every_solver_is_held_against_numpy": (),
    "integrators/test_constrained.py::test_named_cases_keep_order_two_and_the_constraints_in_the_stabilised_form": (),
    "integrators/test_constrained.py::test_other_groupings_of_the_increment_are_of_second_order_too": (
        "R3xSO3-stabilised-F1", "SE3-stabilised-F2",
    ),
    "integrators/test_constrained.py::test_rolling_keeps_rows_at_velocity_level": (),
    "integrators/test_constrained.py::test_the_spatial_variant_is_of_second_order_with_small_constants": ("R3xSO3-stabilised",),
    "integrators/test_hermite.py::test_order_across_a_known_jump": (),
    "integrators/test_hermite.py::test_order_on_every_group": ("pendulum",),
    "integrators/test_hermite.py::test_smaller_errors_than_runge_kutta_at_the_same_step": ("pendulum",),
    "integrators/test_named_cases.py::test_order_two_on_every_group": ("SE3-wbz-9/25", "R-hht-121/400"),
    "integrators/test_own_size.py::test_a_small_machine_moves_as_a_large_one": (
        "1e-12-hermite", "1e-09-taylor", "1e-09-hermite", "1e-06-taylor", "1e-06-hermite", "0.001-taylor",
    ),
    "integrators/test_own_size.py::test_forces_that_cancel_at_rest_stop_no_run": (
        "100.0-hermite", "100000.0-taylor", "100000.0-hermite",
    ),
    "integrators/test_own_size.py::test_spins_that_a_step_cannot_follow_stop_the_run": (
        "hermite-own0-100000000.0", "hermite-own0-10000000000.0", "taylor-own1-1000000.0", "taylor-own1-100000000.0",
        "taylor-own1-10000000000.0",
    ),
    "integrators/test_partitioned.py::test_a_double_rocker_switches_and_moves_as_by_multipliers": (),
    "integrators/test_partitioned.py::test_a_linkage_far_away_moves_as_at_the_origin": ("joint",),
    "integrators/test_partitioned.py::test_a_rolling_disc_keeps_its_order": (),
    "integrators/test_partitioned.py::test_a_start_that_no_correction_reaches_is_refused": (),
    "integrators/test_partitioned.py::test_both_coordinates_of_a_spatial_slider_crank_move_alike": (),
    "integrators/test_partitioned.py::test_every_kind_of_constraint_meets_what_generalized_alpha_tends_to": (),
    "integrators/test_partitioned.py::test_order_4_on_the_fast_heavy_top": ("R3xSO3",),
    "integrators/test_places.py::test_a_loop_moves_far_away_as_near_by": ("generalized_alpha", "rk4_partitioned"),
    "integrators/test_places.py::test_places_in_q_whose_spacing_iterations_come_down_to_stop_no_run": (),
    "integrators/test_sampled_inputs.py::test_a_loop_keeps_the_order_of_its_method_under_a_sampled_torque": (
        "generalized_alpha_f1",
    ),
    "integrators/test_sampled_inputs.py::test_an_arm_keeps_the_order_of_its_method_under_sampled_torques": (
        "generalized_alpha", "hermite",
    ),
    "integrators/test_sampled_inputs.py::test_inputs_may_jump_beside_forces_that_jump": (),
    "integrators/test_similarity.py::test_powers_of_ten_leave_all_but_rounding": (
        "generalized_alpha-four_bar", "index3-four_bar", "rk4_partitioned-four_bar", "rk4-tree", "taylor-tree",
    ),
    "integrators/test_similarity.py::test_powers_of_two_leave_the_bits": (
        "generalized_alpha-four_bar", "index3-four_bar", "rk4_partitioned-four_bar", "rk4-tree", "taylor-tree",
    ),
    "integrators/test_single_precision.py::test_a_machine_at_rest_has_no_impulses_to_be_rounded": (),
    "integrators/test_stepper.py::test_order_on_a_body_on_r3xso3": ("alpha-0.9",),
    "integrators/test_stepper.py::test_order_on_a_body_on_se3_with_a_slider": ("rkmk4",),
    "integrators/test_stepper.py::test_order_on_a_fast_free_body": ("alpha-0.9",),
    "integrators/test_stepper.py::test_order_on_the_fast_heavy_top": ("alpha-0.9",),
    "integrators/test_stepper.py::test_spatial_momentum_of_a_free_body_by_the_spatial_variant": (),
    "integrators/test_taylor.py::test_constraints_are_refused_with_a_reason": (),
    "integrators/test_taylor.py::test_corners_at_unknown_times_are_refused": ("the motion", "a curve of a coordinate"),
    "linear/test_absolute_bodies.py::test_any_tree_about_any_motion": ("5",),
    "linear/test_against_pinocchio.py::test_state_matrix": ("panda",),
    "linear/test_closed_forms.py::test_a_driven_pendulum_hanging_and_upright": (),
    "linear/test_closed_forms.py::test_double_pendulum": (),
    "linear/test_closed_forms.py::test_eigenvalues_along_a_motion_are_those_of_joint_coordinates": (),
    "linear/test_closed_forms.py::test_slider_crank_by_multipliers_is_the_one_in_a_single_coordinate": ("joint",),
    "linear/test_hinged_beam.py::test_a_beam_bent_too_far_is_named": (),
    "linear/test_linearize.py::test_internal_states_are_part_of_the_state_space": (),
    "linear/test_linearize.py::test_large_trees_are_linearised_on_request": (),
    "linear/test_linearize.py::test_motion_without_inertia_is_named": (),
    "linear/test_neighbouring_motions.py::test_neighbouring_motions": (),
    "linear/test_neighbouring_motions.py::test_outputs_of_neighbouring_states": ("drone",),
    "linear/test_neighbouring_motions.py::test_second_order_is_first_order_in_other_variables": (),
    "linear/test_rotating_beam.py::test_frequencies": (),
    "linear/test_steady_motion.py::test_governor_with_closed_loops": (),
    "linear/test_steady_rolling.py::test_a_cart_goes_straight_on_and_in_circles": ("free",),
    "linear/test_steady_rolling.py::test_a_disc_in_a_circle": ("20.0-0.2",),
    "linear/test_steady_rolling.py::test_a_disc_in_a_circle_in_other_coordinates": (),
    "linear/test_steady_rolling.py::test_circles_are_the_same_in_other_units": (),
    "linear/test_steady_rolling.py::test_symmetries_of_discs": (),
    "linear/test_steady_rolling.py::test_wheels_of_three_moments_roll_straight_on": (),
    "mechanics/test_absolute.py::test_angles_count_turns_wherever_they_are_numbers": ("0",),
    "mechanics/test_absolute.py::test_initial_state_and_its_accelerations": ("0-SE3", "1-R3xSO3", "2-R3xSO3", "3-mixed"),
    "mechanics/test_absolute.py::test_loops_mean_the_same_in_both": (
        "distance-False-SE3", "point_on_line-False-R3xSO3", "cylindrical-True-R3xSO3", "rolling-False-mixed",
    ),
    "mechanics/test_absolute.py::test_same_accelerations_of_points": ("3-SE3-resting", "3-R3xSO3-resting", "3-mixed-resting"),
    "mechanics/test_against_sympy.py::test_gimbal_with_a_massless_ring_a_skew_axis_and_a_rotor": (),
    "mechanics/test_beam_energy.py::test_energy_changes_by_the_powers_only": ("loaded_chain-1",),
    "mechanics/test_beam_energy.py::test_partials_are_those_of_the_residual": ("loaded_chain-1",),
    "mechanics/test_beam_equations.py::test_every_term_is_that_of_many_points": ("scene0-points_of_single",),
    "mechanics/test_beam_equations.py::test_order_1_is_the_whole_truncated_at_second_order": (),
    "mechanics/test_budgets.py::test_time_derivatives_of_chains_are_linear": ("planar--114-119",),
    "mechanics/test_bushings.py::test_energy_of_a_tumbling_body_is_kept_to_the_order_of_the_method": (),
    "mechanics/test_bushings.py::test_partials_against_complex_step": ("0", "7"),
    "mechanics/test_closed_form.py::test_closed_form_recursion_and_complex_step_on_random_trees": ("0",),
    "mechanics/test_closed_form.py::test_humanoids": ("g1",),
    "mechanics/test_closed_form.py::test_matrices_and_their_derivatives": ("random 200", "random 206", "states"),
    "mechanics/test_closed_form.py::test_system_matrices_are_what_they_are_called": (),
    "mechanics/test_constraints.py::test_derivatives_of_trees_with_loops": ("0", "5"),
    "mechanics/test_constraints.py::test_energy_changes_by_the_powers_only": ("1-translating-absolute", "1-translating-joint"),
    "mechanics/test_extended.py::test_eliminated_unknowns_leave_the_ordinary_partials": ("0-False", "5-True"),
    "mechanics/test_extended.py::test_everything_of_a_long_chain_is_linear_in_its_links": (),
    "mechanics/test_following.py::test_a_random_tree_against_its_projection": ("1", "11"),
    "mechanics/test_joint_forces.py::test_an_explicit_method_says_when_its_step_cannot_resolve_friction": (),
    "mechanics/test_linearization.py::test_random_trees": ("0", "7"),
    "mechanics/test_properties.py::test_grouping_changes_no_generalized_force": ("0", "7"),
    "mechanics/test_rates.py::test_every_derivative_is_that_of_the_one_before": ("elastic",),
    "mechanics/test_rates.py::test_forward_dynamics_along_its_own_motion": ("random 0", "loaded 11", "based 22", "long chain"),
    "mechanics/test_rates.py::test_recursion_against_jets_of_the_operations_of_tau": (
        "random 0", "random 1", "states, absolute",
    ),
    "mechanics/test_shape_families.py::test_a_tapered_blade": ("finite_elements-3-more0-3e-06",),
    "mechanics/test_shape_families.py::test_frequencies_of_uniform_beams": (
        "polynomial-bending_y-clamped_free", "finite_elements-bending_y-clamped_free",
    ),
    "mechanics/test_shape_families.py::test_normalisations": ("clamped_free-clamped_free", "finite_elements-pinned_pinned"),
    "mechanics/test_shape_integrals.py::test_rotating_cantilever": (
        "0.0-0.0-flap0-lag0-clamped_free-20-2e-05", "1.0-12.0-flap5-lag5-polynomial-12-1e-09",
    ),
    "mechanics/test_structure.py::test_nothing_changes_by_more_than_the_numbers_of_a_scene": ("2", "18", "37", "92"),
    "mechanics/test_urdf_robots.py::test_a_difference_would_be_seen": (),
    "mechanics/test_urdf_robots.py::test_every_robot_agrees_or_is_refused": (),
    "mechanics/test_urdf_robots.py::test_followers_of_followers_are_among_them": (),
    "mechanics/test_urdf_robots.py::test_the_page_says_what_is_found": (),
    "oracles/test_beam_data.py::test_clamped_free_shapes_are_the_published_ones": ("1", "5"),
    "oracles/test_beam_data.py::test_rotating_beam_has_the_published_frequencies": ("0", "12"),
    "oracles/test_beam_data.py::test_stiffening_integrals_are_the_published_ones": ("pair0", "pair5"),
    "oracles/test_beam_on_moving_frame.py": (),
    "oracles/test_elastic_crank.py": (),
    "oracles/test_exudyn_beams.py::test_spin_up_is_as_published_and_near_the_linear_equation": (),
    "oracles/test_spin_up_beam.py::test_set_a_moves_as_published": ("1",),
    "oracles/test_spin_up_beam.py::test_set_b_moves_as_published": ("1--0.537892",),
    "pipeline/test_calibration.py::test_a_mode_that_is_left_without_damping_is_named": (),
    "pipeline/test_calibration.py::test_a_model_from_the_cache_needs_no_solver": (),
    "pipeline/test_calibration.py::test_a_steady_motion_may_be_where_it_is_calibrated": (),
    "pipeline/test_calibration.py::test_constraints_are_projected_out": (),
    "pipeline/test_calibration.py::test_modal_control_of_a_scene": (),
    "pipeline/test_calibration.py::test_one_controller_is_calibrated_with_those_before_it_at_work": (),
    "pipeline/test_calibration.py::test_one_number_for_a_beam_of_several_coordinates_is_refused": (),
    "pipeline/test_calibration.py::test_placed_modes_and_placed_poles_of_a_scene": (),
    "pipeline/test_calibration.py::test_references_are_where_the_controller_rests": (),
    "pipeline/test_calibration.py::test_what_damping_makes_of_placed_modes_is_told": (),
    "pipeline/test_equilibrium_start.py::test_the_program_of_a_loop_starts_as_simulate_does": (),
    "pipeline/test_equilibrium_start.py::test_what_has_no_equilibrium_starts_as_the_joints_say_and_says_so": (),
    "pipeline/test_initial_assembly.py::test_a_loop_whose_axes_fit_to_seven_digits_is_the_planar_one": ("1e-09-joint",),
    "results/test_dense_output.py::test_constrained_runs_keep_order_two_and_almost_the_constraints": ("SE3",),
    "scene/test_include.py::test_hostile_parts_are_scenes_or_problems": (),
    "scene/test_motion_laws.py::test_a_run_looks_at_its_own_times_and_parameters": (),
    "scene/test_scene_files.py::test_hostile_sizes_end_soon": (),
    "scene/test_units.py::test_any_text_is_a_number_a_formula_or_a_problem": (),
    "simulation/test_angles_over_turns.py::test_a_spring_winds_up_over_several_turns": ("generalized_alpha_index3",),
    "simulation/test_angles_over_turns.py::test_any_angle_and_any_speed_give_the_angle_of_joint_coordinates": (),
    "simulation/test_chains.py": (),
    "simulation/test_checkpoints.py::test_a_long_tree_by_its_extended_system": (),
    "simulation/test_checkpoints.py::test_two_parts_are_one_run": ("pendulum-generalized_alpha", "absolute-rk4_partitioned"),
    "simulation/test_controllers.py::test_an_explicit_method_says_which_states_are_too_fast_for_it": (),
    "simulation/test_elastic_loops.py::test_partitioning_and_multipliers_agree_on_elastic_members": (),
    "simulation/test_growth.py::test_a_pendulum_that_falls_and_a_controller_that_diverges": (),
    "simulation/test_growth.py::test_a_run_that_explodes_fails_whatever_is_recorded": (
        "2.9-100-50", "2.9-100-10000", "3.0-30-1", "3.0-30-50", "3.0-30-10000", "3.16-100-1",
    ),
    "simulation/test_growth.py::test_internal_states_that_decay_too_fast_for_the_step": (),
    "simulation/test_growth.py::test_random_machines_fail_where_steps_alone_make_them_grow": (),
    "simulation/test_jumps.py::test_constraints_and_multipliers_across_a_jump": (),
    "simulation/test_jumps.py::test_many_jumps_in_every_step_and_none": (),
    "simulation/test_jumps.py::test_order_across_a_bend": (),
    "simulation/test_jumps.py::test_order_across_a_jump": ("points",),
    "simulation/test_jumps.py::test_order_across_jumps_on_a_group": (),
    "simulation/test_jumps.py::test_order_is_lost_where_the_time_is_not_told": (),
    "simulation/test_large_angles.py::test_an_argument_that_grows_with_the_motion_stops_the_run_and_is_named": (
        "sine-generalized_alpha",
    ),
    "simulation/test_large_models.py": (),
    "simulation/test_left_out_rows.py::test_a_shift_along_the_hinges_is_refused_by_scene_and_run": ("form0",),
    "simulation/test_left_out_rows.py::test_a_shift_that_is_no_contradiction_is_said_by_scene_and_run": (
        "form0-1e-09", "form2-1e-06",
    ),
    "simulation/test_long_run.py::test_a_crank_that_has_turned_eight_thousand_times_keeps_its_loop": (),
    "simulation/test_long_run.py::test_a_four_bar_keeps_its_loop_and_loses_energy_by_the_order_only": ("joint",),
    "simulation/test_long_run.py::test_the_slow_top_keeps_its_invariants": (),
    "simulation/test_long_trees.py::test_joints_of_several_coordinates_in_a_long_tree": (),
    "simulation/test_named_methods.py::test_undamped_and_damped_cases_bear_constraints": (),
    "simulation/test_time_grid.py::test_a_run_with_very_many_jumps_lists_none_of_them": (),
    "simulation/test_time_grid.py::test_ctrl_c_is_heard_among_many_jumps": (),
    "studies/test_check_of_examples.py::test_every_closed_form_of_an_example_agrees": (
        "quarter_car/scene.toml", "heavy_top/se3.toml", "four_bar/scene.toml",
    ),
    "studies/test_long_trees.py::test_an_error_in_the_extended_system_of_a_long_tree_is_found": (),
    "studies/test_long_trees.py::test_every_closed_form_of_a_long_tree_agrees": (),
    "studies/test_planted_errors.py::test_an_error_in_a_derivation_is_found_in_the_compiled_model": (),
    "studies/test_planted_errors.py::test_an_error_in_any_compiled_form_is_found_and_named": (
        "drone-mass-M-mass.M-0", "rod-elastic-K_geo-elastic.K_geo-1",
    ),
    "studies/test_planted_errors.py::test_every_term_has_a_form_or_is_behind_one": (),
    "symbolic/test_map.py::test_random_loops_in_value_derivative_adjoint_and_jet": (),
    "symbolic/test_reading.py::test_named_and_whole_are_the_same_numbers": (),
    "test_turned_loops.py::test_a_million_lengths_away": ("joint-four_bar", "absolute-slider_crank"),
    "test_turned_loops.py::test_a_start_in_other_units": ("four_bar-joint",),
    "test_turned_loops.py::test_any_plane": ("four_bar-joint", "slider_crank-absolute"),
    "test_turned_loops.py::test_named_planes": ("four_bar-as drawn", "parallelogram-a little", "slider_crank-in the plane"),
    "test_turned_loops.py::test_the_turned_example_moves_as_the_one_that_is_not": (
        "drawn-others0-generalized_alpha", "flying-others1-rk4_partitioned",
    ),
    "toolchain/test_cache_under_fire.py::test_a_full_disk_is_named_and_left_as_it_was": ("30000",),
    "toolchain/test_cache_under_fire.py::test_a_read_only_cache_still_serves_what_is_in_it": (),
    "toolchain/test_cache_under_fire.py::test_sixteen_processes_build_one_scene_and_one_of_them_compiles": (),
    "toolchain/test_cache_under_fire.py::test_who_waits_for_a_process_that_is_killed_builds_himself": (),
}


def stale_entries(collected: Sequence[str]) -> list[str]:
    """Return the entries of the table that name no test, or a witness that is none, of the files that were collected."""
    names = [_split(nodeid) for nodeid in collected]
    files = {path for path, _, _ in names}
    stale = []
    for key, witnesses in SLOW.items():
        if key.partition("::")[0] not in files:
            continue
        parameters = {parameter for path, name, parameter in names if key in (path, name)}
        stale += [f"{key}[{witness}]" for witness in witnesses if witness not in parameters]
        stale += [] if parameters else [key]
    return stale


def is_slow(nodeid: str) -> bool:
    """Return whether a test, named as pytest does, is of the second tier by the table."""
    path, name, parameters = _split(nodeid)
    for key in (name, path):
        if key in SLOW:
            return parameters not in SLOW[key]
    return False


def _split(nodeid: str) -> tuple[str, str, str]:
    """Return the file, the file and function, and the parameters of a test."""
    name, _, parameters = nodeid.removeprefix("tests/").partition("[")
    return name.partition("::")[0], name, parameters.removesuffix("]")
