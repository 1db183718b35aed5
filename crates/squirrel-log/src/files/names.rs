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

/// Whether a character acts on who shows it: a control character, or one that turns the direction of
/// writing.
pub fn acts(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
