//! Names from files in what is said about them.

use std::borrow::Cow;

/// A text in which characters that act on who shows it are spelt out.
///
/// * `acts` - which do
pub fn spelt_out(text: &str, acts: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&acts) {
        return Cow::Borrowed(text);
    }
    let spelt = |c: char| if acts(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(spelt).collect())
}
