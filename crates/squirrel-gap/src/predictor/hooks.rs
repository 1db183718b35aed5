use squirrel_core::effects::{EffectParameter, Effects};
use squirrel_core::frames::{Body, In};
pub(crate) trait Hooks {
    fn heading_bias_rad(&self, _t: f64) -> f64 { 0.0 }
    fn specific_force_bias(&self, _t: f64) -> In<Body, f64> { In::zero() }
    fn gnss_latency_s(&self) -> f64 { 0.0 }
    fn command_clock_s(&self, t: f64) -> f64 { t }
    fn command_latency_s(&self) -> f64 { 0.0 }
    fn parameters(name: &str) -> Option<&'static [EffectParameter]>;
}
impl Hooks for Effects<f64> {
    fn parameters(name: &str) -> Option<&'static [EffectParameter]> {
        let mut e = Effects::<f64>::none();
        e.insert(name).map(|f| f.parameters)
    }
}
pub(crate) trait Std { fn in_standard_form(&self) -> bool; }
impl Std for EffectParameter { fn in_standard_form(&self) -> bool { true } }
