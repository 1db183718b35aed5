//! TOML errors as one line: where, what, and the text of that line.

/// Line number (from 1), message and source line of a parse error.
pub(crate) struct Place {
    pub(crate) line: usize,
    pub(crate) message: String,
    pub(crate) text: String,
}

pub(crate) fn place(text: &str, error: &toml::de::Error) -> Place {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = text.bytes().take(start).filter(|&b| b == b'\n').count();
    Place {
        line: line + 1,
        message: error.message().trim().replace('\n', ", "),
        text: text.lines().nth(line).unwrap_or_default().trim().chars().take(120).collect(),
    }
}
