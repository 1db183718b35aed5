//! Tests that fly, train or diagnose for many seconds; `cargo xtask test --quick` leaves them to
//! the whole test.

/// Parts of their names, module and function; whole modules where all of one is slow.
pub(crate) const SLOW: &[&str] = &[
    // The command line.
    "gap::held_out_flights_are_flown_again_in_closed_loop",
    "gap::the_same_flights_give_the_same_bytes",
    "gap::what_cannot_be_read_is_one_line_and_leaves_nothing",
    "gap::what_is_added_leaves_the_file_as_it_was",
    "plan::a_planner_is_an_arm",
    "train::a_training_that_was_killed_goes_on_to_the_same_bytes",
    "train::table_two_writes_the_same_bytes_twice_and_holds_every_model",
    "view::each_arm_has_a_scene_with_the_numbers_of_its_log",
    // The blind bench.
    "bench::programs_that_answer_without_looking_are_seen_through",
    "flights::the_same_seed_makes_the_same_bytes_in_every_new_set",
    "identify_then_fly::",
    "seen_by_find::",
    "squirrel_made::every_effect_can_be_flown",
    "twins::",
    // The gap workflow: what fits whole sets of flights.
    "baseline::a_good_flight_is_no_flight_to_judge",
    "baseline::bad_good_flights_are_said",
    "baseline::what_the_file_has_wrong_has_not_changed",
    "check::sizes_fall_with_the_root_of_the_number_of_flights",
    "check::twice_the_smallest_size_is_named_and_a_quarter_is_not",
    "clean_flights::no",
    "data_problems::",
    "datasheet::",
    "far_off::",
    "first_file::",
    "fit::a_fitted_file_",
    "fit::moments_that_",
    "fit::numbers_",
    "foreign::",
    "held_out::",
    "long_flights::",
    "nanobench::",
    "no_imu::",
    "real_flights::",
    "real_models::",
    "report_case::",
    "rotor_speeds::",
    "scale::a_load_scales_with_the_vehicle",
    "scale::forces_scale_with_the_vehicle",
    "scale::moments_scale_with_the_vehicle",
    "sensors::a_",
    "simulated::",
    // The simulator.
    "beside_pc::",
    "faults::ten_thousand_faults_are_survived_and_named",
    "world_contact::contact_adds_no_energy",
    "world_errors::huge_numbers_give_an_error_or_a_finite_state",
    // Plans.
    "reach::volume::tests::the_two_volumes_of_a_flat_wing_agree",
    // Studies.
    "claims::",
    "dispersion::nobody_is_better_where_nothing_is_as_it_was_told",
    "faults::survivable_faults_are_survived_and_what_is_lost_is_flagged",
    "faults::two_faults_at_once_are_survived_nineteen_times_of_twenty",
    "filters::one_thread_and_two_give_the_same_numbers",
    "filters::the_default_needs_no_calibration_and_the_papers_filter_does",
    "pages::steering_has_its_wheels_and_the_tracks_of_one_cell",
    "pages::the_forest_has_a_map_an_arm",
    "parts::a_study_that_stops_itself_is_one_of_that_many_trials",
    "parts::stopped_threaded_and_merged_studies_leave_the_same_bytes",
    "planning::",
    "real_filters::",
    "table2::",
    "thrust::one_thread_and_two_give_the_same_numbers",
    "thrust::the_better_controller_gains_more_than_the_paper_at_scarce_thrust",
    "thrust::wings_help_",
    // Lessons that fly studies.
    "no_flight_is_lost_in_silence",
    "scarce_thrust_is_where_wings_pay_and_pairs_show_it",
    "the_best_law_comes_further_than_the_papers_rival",
    "the_learned_model_is_worth_little_more_than_the_plate",
    "the_papers_filter_needs_a_calibrated_gyro_and_the_default_does_not",
    "the_papers_gain_and_its_sinking_drone_are_those_of_scarce_thrust",
    "the_sink_is_found_named_added_and_gone",
    "who_corrects_the_plate_learns_faster_than_who_starts_from_nothing",
    "wings_are_worth_most_where_thrust_is_scarce",
    "wings_buy_a_few_percent_where_both_plan",
];

#[cfg(test)]
mod tests {
    use super::SLOW;
    use std::fs;
    use std::path::Path;

    fn sources(folder: &Path, text: &mut String) {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let path = entry.path();
            if path.is_dir() && entry.file_name() != "target" {
                sources(&path, text);
            } else if path.extension().is_some_and(|end| end == "rs") {
                *text += &fs::read_to_string(&path).unwrap();
            }
        }
    }

    #[test]
    fn what_is_left_out_is_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let mut text = String::new();
        for folder in ["crates", "examples", "tests"] {
            sources(&root.join(folder), &mut text);
        }
        for name in SLOW {
            let (modules, function) = name.rsplit_once("::").unwrap_or(("", name));
            let module = modules.split("::").next().unwrap();
            assert!(module.is_empty() || text.contains(&format!("mod {module};")), "{name}");
            assert!(function.is_empty() || text.contains(&format!("fn {function}")), "{name}");
        }
    }
}
