//! The tests of logs and imports. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod files;
mod import_attack;
mod import_autopilot;
mod import_bag;
mod import_crazypad;
mod import_csv;
mod import_errors;
mod import_fields;
mod import_formats;
mod import_mat;
mod import_page;
mod import_ros;
mod import_support;
mod import_topics;
mod import_turned;
mod import_usd;
mod log_attack;
mod log_damage;
mod log_foxglove;
mod log_pieces;
mod log_round_trip;
