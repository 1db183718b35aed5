//! The tests of the simulator. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod attack;
mod attack_board;
mod attack_replay;
mod beside_pc;
mod board_log;
mod effects;
mod excitation;
mod faults;
mod first_file_flies;
mod flights;
mod import_flights;
mod margins;
mod parnn_flights;
mod pilot;
mod policy_weights;
mod replays;
mod weights;
mod weights_support;
mod wind_estimate;
mod world_clearance;
mod world_contact;
mod world_errors;
mod world_fixture;
mod world_free_flight;
