//! What squirrel brings along, as text and bytes: vehicle files, import maps of public data sets,
//! and the weights of the squirrel's learned wing force.
//!
//! The files lie beside this one, where people look for them, and are in the package of this
//! crate; every other crate takes them from here.
//!
//! ```
//! let (name, text) = squirrel_vehicles::VEHICLES[0];
//! assert_eq!(name, "squirrel");
//! assert!(text.contains("mass_kg"));
//! ```
#![no_std]

/// Vehicle files by name, the squirrel of the paper first.
pub const VEHICLES: [(&str, &str); 6] = [
    ("squirrel", SQUIRREL),
    ("squirrel_air", SQUIRREL_AIR),
    ("crazyflie21_brushed", CRAZYFLIE21_BRUSHED),
    ("crazyflie21_brushed_curve", include_str!("crazyflie21_brushed_curve.toml")),
    ("crazyflie21_datasheet", CRAZYFLIE21_DATASHEET),
    ("crazyflie2_arpl", CRAZYFLIE2_ARPL),
];

/// The squirrel of the paper.
pub const SQUIRREL: &str = include_str!("squirrel.toml");

/// The same with rotors as small propellers are measured.
pub const SQUIRREL_AIR: &str = include_str!("squirrel_air.toml");

/// The Crazyflie 2.1 of the NanoBench flights.
pub const CRAZYFLIE21_BRUSHED: &str = include_str!("crazyflie21_brushed.toml");

/// The same machine by its datasheet alone.
pub const CRAZYFLIE21_DATASHEET: &str = include_str!("crazyflie21_datasheet.toml");

/// The Crazyflie of the flights of the ARPL.
pub const CRAZYFLIE2_ARPL: &str = include_str!("crazyflie2_arpl.toml");

/// The weights that `squirrel.toml` names, under the name that it gives them.
pub const SQUIRREL_PARNN: (&str, &[u8]) =
    ("squirrel-parnn.safetensors", include_bytes!("squirrel-parnn.safetensors"));

/// Import maps of public data sets, by name.
pub const MAPS: [(&str, &str); 3] = [
    ("nanobench", include_str!("maps/nanobench.toml")),
    ("crazypad", include_str!("maps/crazypad.toml")),
    ("arpl", include_str!("maps/arpl.toml")),
];
