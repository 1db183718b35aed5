//! Moving air: turbulence that is always there, and gusts where they are the hidden effect.

use super::extras::Gust;
use crate::draw::Draw;
use nalgebra::Vector3;

/// Turbulence of every flight, m/s an axis.
const TURBULENCE_M_S: f64 = 0.12;
const TURBULENCE_S: f64 = 1.0;
const GUST_S: f64 = 1.5;
/// Scale length of the Dryden gusts, m; met at the airspeed, not below 2 m/s.
const DRYDEN_M: f64 = 5.0;
const DRYDEN_LEAST_M_S: f64 = 2.0;
/// Vertical gusts over horizontal ones.
const VERTICAL: f64 = 0.5;

/// A first-order process with unit variance.
#[derive(Debug, Clone)]
pub(super) struct Process(Vector3<f64>);

impl Process {
    pub(super) fn new(draw: &mut Draw) -> Self {
        Self(Vector3::from(draw.normal3(1.0)))
    }
    pub(super) fn step(
        &mut self,
        dt_s: f64,
        time_constant_s: f64,
        draw: &mut Draw,
    ) -> Vector3<f64> {
        let keep = (-dt_s / time_constant_s).exp();
        self.0 = self.0 * keep + Vector3::from(draw.normal3((1.0 - keep * keep).sqrt()));
        self.0
    }
}

#[derive(Debug, Clone)]
pub(super) struct Air {
    gust: Gust,
    turbulence: Process,
    first: Process,
    second: Vector3<f64>,
    draw: Draw,
}

impl Air {
    pub(super) fn new(gust: Gust, mut draw: Draw) -> Self {
        let (turbulence, first) = (Process::new(&mut draw), Process::new(&mut draw));
        let mut air = Self { gust, turbulence, first, second: Vector3::zeros(), draw };
        for _ in 0..200 {
            air.step(0.05, 0.0);
        }
        air
    }

    /// Velocity after a step, NED, m/s.
    pub(super) fn step(&mut self, dt_s: f64, airspeed_m_s: f64) -> Vector3<f64> {
        let calm = TURBULENCE_M_S * self.turbulence.step(dt_s, TURBULENCE_S, &mut self.draw);
        if self.gust.sigma_m_s == 0.0 {
            return calm;
        }
        let shape = if self.gust.dryden {
            let scale_s = DRYDEN_M / airspeed_m_s.max(DRYDEN_LEAST_M_S);
            let first = self.first.step(dt_s, scale_s, &mut self.draw);
            self.second += (first - self.second) * (1.0 - (-dt_s / scale_s).exp());
            // (1 + sqrt(3) T s) / (1 + T s)^2 across and upwards, unit variance; first order along
            // north.
            let root3 = 3.0_f64.sqrt();
            let across =
                (self.second * (1.0 - root3) + first * root3) * std::f64::consts::FRAC_1_SQRT_2;
            Vector3::new(first.x, across.y, across.z)
        } else {
            self.first.step(dt_s, GUST_S, &mut self.draw)
        };
        calm + self.gust.sigma_m_s * shape.component_mul(&Vector3::new(1.0, 1.0, VERTICAL))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_moves_as_much_as_stated() {
        for (gust, expected) in [
            (Gust::default(), [0.12; 3]),
            (Gust { sigma_m_s: 1.5, dryden: false }, [1.505, 1.505, 0.76]),
            (Gust { sigma_m_s: 1.5, dryden: true }, [1.505, 1.505, 0.76]),
        ] {
            let mut air = Air::new(gust, Draw::new(2));
            let n = 200_000;
            let mut square = Vector3::zeros();
            for _ in 0..n {
                let v = air.step(0.05, 4.0);
                square += v.component_mul(&v);
            }
            for axis in 0..3 {
                let sd = (square[axis] / f64::from(n)).sqrt();
                assert!((sd / expected[axis] - 1.0).abs() < 0.07, "{gust:?} {axis}: {sd}");
            }
        }
    }
}
