//! The tests of the gap workflow. One binary: what they share is compiled and linked once.

mod datasheet;
mod support;

mod baseline;
mod check;
mod clean_flights;
mod data_problems;
mod errors;
mod far_off;
mod feedback;
mod file_with_effects;
mod first_file;
mod first_screen;
mod fit;
mod foreign;
mod held_out;
mod long_flights;
mod nanobench;
mod no_imu;
mod no_velocity;
mod real_flights;
mod real_models;
mod report;
mod report_case;
mod rotor_speeds;
mod scale;
mod sensors;
mod simulated;
mod spoilt_maps;
mod wrong_names;
