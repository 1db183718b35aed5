//! ULog's message formats: from `name:type field;type field;` to columns with a type and a place in
//! the message.
//!
//! Fields may be arrays and other formats, so a column's name is a path: `position[0]`,
//! `esc[1].esc_rpm`.

use std::collections::BTreeMap;

use super::number::{Column, Kind};

/// Longest message that the format can frame, bytes.
const MESSAGE_MAX_BYTES: usize = u16::MAX as usize;
/// Deeper nesting than any vehicle logs; bounds the recursion.
const DEPTH_MAX: usize = 16;

/// The numbers of a topic in one message.
pub(super) struct Layout {
    pub(super) columns: Vec<Column>,
    /// Bytes of a message.
    pub(super) size: usize,
    /// Bytes of a message without the padding at its end, which need not be logged.
    pub(super) size_logged: usize,
}

impl Layout {
    /// The layout of a topic.
    ///
    /// * `definitions` - the field lists by format name
    ///
    /// # Errors
    /// Says which definition is wrong, and how.
    pub(super) fn new(topic: &str, definitions: &BTreeMap<String, String>) -> Result<Self, String> {
        let mut layout = Self { columns: Vec::new(), size: 0, size_logged: 0 };
        layout.add(topic, "", definitions, 0)?;
        Ok(layout)
    }

    fn add(
        &mut self,
        format: &str,
        prefix: &str,
        definitions: &BTreeMap<String, String>,
        depth: usize,
    ) -> Result<(), String> {
        let fields =
            definitions.get(format).ok_or_else(|| format!("format `{format}` is not defined"))?;
        if depth == DEPTH_MAX {
            return Err(format!("format `{format}` is nested more than {DEPTH_MAX} deep"));
        }
        for field in fields.split(';').filter(|field| !field.is_empty()) {
            let bad = || format!("format `{format}` has the field `{field}`: not `type name`");
            let (written, name) = field.split_once(' ').ok_or_else(bad)?;
            let (kind, count) = match written.split_once('[') {
                None => (written, None),
                Some((kind, count)) => {
                    let count = count.strip_suffix(']').and_then(|count| count.parse::<u16>().ok());
                    (kind, Some(count.ok_or_else(bad)?))
                }
            };
            for i in 0..count.unwrap_or(1) {
                let index = if count.is_some() { format!("[{i}]") } else { String::new() };
                let start = self.size;
                if let Some(kind) = primitive(kind) {
                    self.size += kind.size();
                    if !name.starts_with("_padding") {
                        let name = format!("{prefix}{name}{index}");
                        self.columns.push(Column { name, offset: start, kind, scale: 1.0 });
                        self.size_logged = self.size;
                    }
                } else {
                    self.add(kind, &format!("{prefix}{name}{index}."), definitions, depth + 1)?;
                    if self.size == start {
                        // Arrays of nothing inside each other would never reach the largest size.
                        return Err(format!("format `{kind}` has no fields"));
                    }
                    self.size_logged = self.size;
                }
                if self.size > MESSAGE_MAX_BYTES {
                    return Err(format!(
                        "format `{format}` is longer than {MESSAGE_MAX_BYTES} bytes"
                    ));
                }
            }
        }
        Ok(())
    }
}

fn primitive(name: &str) -> Option<Kind> {
    Some(match name {
        "int8_t" => Kind::I8,
        "uint8_t" | "bool" | "char" => Kind::U8,
        "int16_t" => Kind::I16,
        "uint16_t" => Kind::U16,
        "int32_t" => Kind::I32,
        "uint32_t" => Kind::U32,
        "int64_t" => Kind::I64,
        "uint64_t" => Kind::U64,
        "float" => Kind::F32,
        "double" => Kind::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(definitions: &[(&str, &str)]) -> Result<Layout, String> {
        let definitions =
            definitions.iter().map(|(name, fields)| ((*name).to_owned(), (*fields).to_owned()));
        Layout::new("top", &definitions.collect())
    }

    #[test]
    fn columns_are_paths_and_padding_takes_room() {
        let layout = layout(&[
            ("top", "uint64_t timestamp;uint8_t[3] _padding0;inner[2] esc;bool armed;uint8_t[7] _padding1;"),
            ("inner", "float rpm;int16_t[2] x;"),
        ])
        .unwrap();
        let places: Vec<_> = layout.columns.iter().map(|c| (c.name.as_str(), c.offset)).collect();
        let expected = [
            ("timestamp", 0),
            ("esc[0].rpm", 11),
            ("esc[0].x[0]", 15),
            ("esc[0].x[1]", 17),
            ("esc[1].rpm", 19),
            ("esc[1].x[0]", 23),
            ("esc[1].x[1]", 25),
            ("armed", 27),
        ];
        assert_eq!(places, expected);
        assert_eq!((layout.size_logged, layout.size), (28, 35));
    }

    #[test]
    fn definitions_that_make_no_message_are_refused() {
        for (definitions, problem) in [
            (&[("other", "")][..], "format `top` is not defined"),
            (&[("top", "inner x;")], "format `inner` is not defined"),
            (&[("top", "float")], "format `top` has the field `float`: not `type name`"),
            (
                &[("top", "float[-1] x")],
                "format `top` has the field `float[-1] x`: not `type name`",
            ),
            (&[("top", "float[2 x")], "format `top` has the field `float[2 x`: not `type name`"),
            (&[("top", "top x")], "format `top` is nested more than 16 deep"),
            (&[("top", "double[65535] x")], "format `top` is longer than 65535 bytes"),
            (&[("top", "a[65535] x"), ("a", "b[65535] x"), ("b", "")], "format `b` has no fields"),
        ] {
            assert_eq!(layout(definitions).err().as_deref(), Some(problem));
        }
    }
}
