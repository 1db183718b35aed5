//! TOML errors as one line: where, what, and the text of that line.

/// Line number (from 1), message and source line of a parse error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// From 1.
    pub line: usize,
    /// What the parser says.
    pub message: String,
    /// The line, at most 120 characters of it.
    pub text: String,
}

/// Where in `text` an error is.
pub fn place(text: &str, error: &toml::de::Error) -> Place {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = text.bytes().take(start).filter(|&b| b == b'\n').count();
    Place {
        line: line + 1,
        message: error.message().trim().replace('\n', ", "),
        text: text.lines().nth(line).unwrap_or_default().trim().chars().take(120).collect(),
    }
}
