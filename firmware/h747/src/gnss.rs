//! Satellite fixes: UBX `NAV-PVT` from bytes, and from degrees to metres about an origin.

use squirrel_core::frames::{In, Ned};
use squirrel_core::nalgebra::Vector3;
use ublox::nav_pvt::common::NavPvtFlags;
use ublox::proto23::{PacketRef, Proto23};
use ublox::{FixedBuffer, GnssFixType, Parser, UbxPacket};

/// WGS 84: equatorial radius, m, and the square of its eccentricity.
const RADIUS_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// A place on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Height above mean sea level, m.
    pub height_m: f64,
}

/// A fix in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Where.
    pub place: Place,
    /// Velocity over ground, m/s.
    pub velocity: In<Ned, f32>,
}

impl Place {
    /// Metres from `origin`; good for some kilometres.
    #[must_use]
    pub fn from(&self, origin: &Self) -> In<Ned, f32> {
        let sine = libm::sin(origin.latitude_rad);
        let w = 1.0 - ECCENTRICITY_SQUARED * sine * sine;
        let east_radius_m = RADIUS_M / libm::sqrt(w) + origin.height_m;
        let north_radius_m =
            RADIUS_M * (1.0 - ECCENTRICITY_SQUARED) / (w * libm::sqrt(w)) + origin.height_m;
        let mut east_rad = self.longitude_rad - origin.longitude_rad;
        // Across the date line.
        if east_rad.abs() > core::f64::consts::PI {
            east_rad -= libm::copysign(core::f64::consts::TAU, east_rad);
        }
        In::new(Vector3::new(
            ((self.latitude_rad - origin.latitude_rad) * north_radius_m) as f32,
            (east_rad * east_radius_m * libm::cos(origin.latitude_rad)) as f32,
            (origin.height_m - self.height_m) as f32,
        ))
    }
}

/// Finds fixes in the receiver's bytes.
pub struct Receiver {
    parser: Parser<FixedBuffer<256>, Proto23>,
}

impl Default for Receiver {
    fn default() -> Self {
        Self { parser: Parser::with_fixed_buffer() }
    }
}

impl Receiver {
    /// The last good fix in these bytes; `None` where there is none. What is broken is passed over.
    pub fn read(&mut self, bytes: &[u8]) -> Option<Fix> {
        let mut packets = self.parser.consume_ubx(bytes);
        let mut fix = None;
        while let Some(packet) = packets.next() {
            let Ok(UbxPacket::Proto23(PacketRef::NavPvt(pvt))) = packet else { continue };
            let in_space =
                matches!(pvt.fix_type(), GnssFixType::Fix3D | GnssFixType::GPSPlusDeadReckoning);
            if in_space && pvt.flags().contains(NavPvtFlags::GPS_FIX_OK) {
                let place = Place {
                    latitude_rad: pvt.latitude().to_radians(),
                    longitude_rad: pvt.longitude().to_radians(),
                    height_m: pvt.height_msl(),
                };
                let velocity = [pvt.vel_north(), pvt.vel_east(), pvt.vel_down()].map(|v| v as f32);
                fix = Some(Fix { place, velocity: In::new(Vector3::from(velocity)) });
            }
        }
        fix
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A `NAV-PVT` message: degrees times 1e7, millimetres, millimetres per second.
    pub(crate) fn message(
        lat: i32,
        lon: i32,
        height_mm: i32,
        velocity_mm_s: [i32; 3],
        fix: u8,
        ok: u8,
    ) -> Vec<u8> {
        let mut payload = [0u8; 92];
        payload[20] = fix;
        payload[21] = ok;
        let mut put =
            |at: usize, value: i32| payload[at..at + 4].copy_from_slice(&value.to_le_bytes());
        put(24, lon);
        put(28, lat);
        put(36, height_mm);
        for (k, v) in velocity_mm_s.into_iter().enumerate() {
            put(48 + 4 * k, v);
        }
        let body = [&[0x01, 0x07, 92, 0][..], &payload].concat();
        let (mut a, mut b) = (0u8, 0u8);
        for byte in &body {
            a = a.wrapping_add(*byte);
            b = b.wrapping_add(a);
        }
        [&[0xB5, 0x62][..], &body, &[a, b]].concat()
    }

    #[test]
    fn a_fix_is_read_whole_in_pieces_and_behind_rubbish() {
        let bytes = message(473_977_418, 85_455_938, 488_000, [1500, -250, 100], 3, 1);
        let whole = Receiver::default().read(&bytes).unwrap();
        assert!((whole.place.latitude_rad - 47.397_741_8_f64.to_radians()).abs() < 1e-12);
        assert!((whole.place.height_m - 488.0).abs() < 1e-9);
        assert_eq!(whole.velocity.vector, Vector3::new(1.5, -0.25, 0.1));
        let mut receiver = Receiver::default();
        let pieces: Vec<Fix> = bytes.chunks(7).filter_map(|piece| receiver.read(piece)).collect();
        assert_eq!(pieces, [whole]);
        let rubbish: Vec<u8> = (0..200u8).map(|k| k.wrapping_mul(31)).collect();
        assert_eq!(Receiver::default().read(&[&rubbish[..], &bytes].concat()), Some(whole));
    }

    #[test]
    fn no_fix_and_broken_bytes_are_none() {
        for (fix, ok) in [(0, 1), (2, 1), (5, 1), (3, 0)] {
            assert_eq!(
                Receiver::default().read(&message(1, 1, 1, [0; 3], fix, ok)),
                None,
                "{fix} {ok}"
            );
        }
        let mut bytes = message(1, 1, 1, [0; 3], 3, 1);
        bytes[40] ^= 1;
        let mut receiver = Receiver::default();
        assert_eq!(receiver.read(&bytes), None);
        // The next one is heard, however long the broken one kept the parser busy.
        let good = message(1, 1, 1, [0; 3], 3, 1);
        assert!((0..3).any(|_| receiver.read(&good).is_some()));
    }

    #[test]
    fn degrees_become_metres() {
        let at = |lat: f64, lon: f64, height_m| Place {
            latitude_rad: lat.to_radians(),
            longitude_rad: lon.to_radians(),
            height_m,
        };
        // One minute of latitude at 45 degrees is 1852.2 m, of longitude 1314.1 m (WGS 84 tables).
        let north = at(45.0 + 1.0 / 60.0, 7.0, 0.0).from(&at(45.0, 7.0, 0.0)).vector;
        assert!((north.x - 1852.2).abs() < 0.3 && north.y == 0.0, "{north}");
        let east = at(45.0, 7.0 + 1.0 / 60.0, 3.0).from(&at(45.0, 7.0, 0.0)).vector;
        assert!((east.y - 1314.1).abs() < 0.3 && (east.z + 3.0).abs() < 1e-6, "{east}");
        let date_line = at(0.0, -179.9999, 0.0).from(&at(0.0, 179.9999, 0.0)).vector;
        assert!((date_line.y - 22.26).abs() < 0.02, "{date_line}");
    }
}
