//! `[wind]`: moving air of a scenario.

use crate::plant::{GustModel, WindParameters};
use serde::{Deserialize, Serialize};

/// Moving air.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WindTable {
    /// Steady wind: where the air moves to.
    pub mean_ned_m_s: [f64; 3],
    /// Standard deviation of gusts per axis.
    pub gust_sigma_m_s: f64,
    /// Correlation time of Gauss-Markov gusts.
    pub gust_time_constant_s: f64,
    /// Scale length; where given, gusts have the Dryden spectra instead.
    pub gust_dryden_length_m: Option<f64>,
    /// Wind at 6 m (20 ft); where given, gusts are those of MIL-F-8785C at low altitude instead,
    /// with lengths and strengths by height, along the flight, and a rotation of the air.
    pub gust_mil_wind_6m_m_s: Option<f64>,
}

impl Default for WindTable {
    fn default() -> Self {
        Self {
            mean_ned_m_s: [0.0; 3],
            gust_sigma_m_s: 0.0,
            gust_time_constant_s: 1.5,
            gust_dryden_length_m: None,
            gust_mil_wind_6m_m_s: None,
        }
    }
}

impl WindTable {
    /// # Errors
    /// `field = value: reason`.
    pub(super) fn check(&self) -> Result<(), String> {
        if let Some(x) = self.mean_ned_m_s.iter().find(|x| x.is_nan() || x.abs() > 100.0) {
            return Err(format!("wind.mean_ned_m_s = {x}: must be within 100"));
        }
        for (field, x) in [
            ("wind.gust_sigma_m_s", self.gust_sigma_m_s),
            ("wind.gust_mil_wind_6m_m_s", self.gust_mil_wind_6m_m_s.unwrap_or(0.0)),
        ] {
            if !(0.0..=50.0).contains(&x) {
                return Err(format!("{field} = {x}: must be 0 to 50"));
            }
        }
        for (field, x) in [
            ("wind.gust_time_constant_s", self.gust_time_constant_s),
            ("wind.gust_dryden_length_m", self.gust_dryden_length_m.unwrap_or(1.0)),
        ] {
            if !(x.is_finite() && x > 0.0) {
                return Err(format!("{field} = {x}: must be finite and > 0"));
            }
        }
        let Some(wind) = self.gust_mil_wind_6m_m_s else { return Ok(()) };
        let alone = Self { gust_mil_wind_6m_m_s: None, mean_ned_m_s: [0.0; 3], ..self.clone() };
        if alone != Self::default() {
            return Err(format!(
                "wind.gust_mil_wind_6m_m_s = {wind}: says all about gusts; gust_sigma_m_s, \
                 gust_time_constant_s and gust_dryden_length_m do not go with it"
            ));
        }
        Ok(())
    }

    /// The air in numbers.
    pub(super) fn parameters(&self) -> WindParameters {
        let gust = match (self.gust_mil_wind_6m_m_s, self.gust_dryden_length_m) {
            (Some(wind_6m_m_s), _) => GustModel::Mil { wind_6m_m_s },
            (None, Some(scale_length_m)) => GustModel::Dryden { scale_length_m },
            (None, None) => GustModel::GaussMarkov { time_constant_s: self.gust_time_constant_s },
        };
        WindParameters {
            mean_ned_m_s: self.mean_ned_m_s,
            gust_sigma_m_s: self.gust_sigma_m_s,
            gust,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scenario;
    use crate::plant::GustModel;

    fn parsed(wind: &str) -> Result<Scenario, String> {
        let mut text = Scenario::find("hover").unwrap().to_toml();
        let at = text.find("[wind]").unwrap();
        text.replace_range(at.., &format!("[wind]\n{wind}\n"));
        Scenario::parse(&text, "s.toml")
    }

    #[test]
    fn gusts_after_the_specification_say_all() {
        let scenario =
            parsed("mean_ned_m_s = [2.0, 0.0, 0.0]\ngust_mil_wind_6m_m_s = 4.0").unwrap();
        assert_eq!(scenario.wind().gust, GustModel::Mil { wind_6m_m_s: 4.0 });
        assert_eq!(Scenario::parse(&scenario.to_toml(), "s.toml").unwrap(), scenario);
        for other in
            ["gust_sigma_m_s = 0.5", "gust_time_constant_s = 2.0", "gust_dryden_length_m = 6.0"]
        {
            assert_eq!(
                parsed(&format!("gust_mil_wind_6m_m_s = 4.0\n{other}")).unwrap_err(),
                "s.toml: wind.gust_mil_wind_6m_m_s = 4: says all about gusts; gust_sigma_m_s, \
                 gust_time_constant_s and gust_dryden_length_m do not go with it"
            );
        }
        for bad in ["-1.0", "nan", "60.0"] {
            let error = parsed(&format!("gust_mil_wind_6m_m_s = {bad}")).unwrap_err();
            assert!(error.ends_with("must be 0 to 50"), "{error}");
        }
    }
}
