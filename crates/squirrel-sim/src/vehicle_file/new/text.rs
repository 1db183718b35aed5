//! A vehicle file as text: each number with its tolerance and source.

use std::fmt::Write;

/// Four digits: no guess knows more.
pub(super) fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// A number with its tolerance, one standard deviation, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) sd: f64,
    pub(super) source: String,
}

/// Lines of a vehicle file.
#[derive(Default)]
pub(super) struct Lines(String);

impl Lines {
    pub(super) fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }
    pub(super) fn table(&mut self, header: &str) {
        self.line(&format!("\n{header}"));
    }
    pub(super) fn number(&mut self, key: &str, number: &Number) {
        let (value, sd) = (rounded(number.value), rounded(number.sd));
        let source = quoted(&number.source);
        let _ = writeln!(self.0, "{key} = {{ value = {value:?}, sd = {sd:?}, source = {source} }}");
    }
    /// A number that the gap workflow takes as it stands.
    pub(super) fn plain(&mut self, key: &str, value: f64, source: &str) {
        let (value, source) = (rounded(value), quoted(source));
        let _ = writeln!(self.0, "{key} = {{ value = {value:?}, source = {source} }}");
    }
    pub(super) fn list(&mut self, key: &str, value: &[f64], sd: &[f64], source: &str) {
        let of = |list: &[f64]| list.iter().map(|x| rounded(*x)).collect::<Vec<f64>>();
        let (value, sd, source) = (of(value), of(sd), quoted(source));
        let _ = writeln!(self.0, "{key} = {{ value = {value:?}, sd = {sd:?}, source = {source} }}");
    }
    pub(super) fn append(&mut self, text: &str) {
        self.0.push('\n');
        self.0.push_str(text);
    }
    pub(super) fn text(self) -> String {
        self.0
    }
}

/// A string as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
