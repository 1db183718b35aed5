//! Everything that is drawn at random comes from here: one generator a purpose, each from its own
//! seed.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Draw(Pcg64Mcg);

impl Draw {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }
    /// Evenly between two bounds.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }
    /// Gaussian, mean 0.
    pub fn normal(&mut self, sd: f64) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.0);
        sd * unit
    }
    /// Three Gaussian numbers.
    pub fn normal3(&mut self, sd: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.normal(sd))
    }
    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.0.next_u64() >> 63 == 0 { 1.0 } else { -1.0 }
    }
    /// An angle, rad.
    pub fn angle(&mut self) -> f64 {
        self.uniform(0.0, TAU)
    }
    /// One of `0..count`.
    pub fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count - 1)
    }
    /// Another order.
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.index(i + 1));
        }
    }
}

/// A seed from two others (SplitMix64), so that neighbouring cases share nothing.
pub fn mix(seed: u64, salt: u64) -> u64 {
    let mut z = seed.wrapping_add(salt.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_as_asked() {
        let mut draw = Draw::new(1);
        let n = 100_000;
        let uniform: Vec<f64> = (0..n).map(|_| draw.uniform(-1.0, 3.0)).collect();
        assert!(uniform.iter().all(|x| (-1.0..3.0).contains(x)));
        assert!((uniform.iter().sum::<f64>() / f64::from(n) - 1.0).abs() < 0.02);
        let square: f64 = (0..n).map(|_| draw.normal(2.0).powi(2)).sum::<f64>() / f64::from(n);
        assert!((square.sqrt() - 2.0).abs() < 0.02);
        let mut seen = [0; 5];
        (0..n).for_each(|_| seen[draw.index(5)] += 1);
        assert!(seen.iter().all(|&count| (19_000..21_000).contains(&count)), "{seen:?}");
    }

    #[test]
    fn seeds_differ_by_either_part() {
        assert_ne!(mix(1, 2), mix(2, 1));
        assert_ne!(mix(1, 0), mix(1, 1));
        assert_eq!(mix(7, 7), mix(7, 7));
    }
}
