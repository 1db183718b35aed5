//! Schemas of ROS 2 messages as rosbag2 writes them (`ros2msg`): the text of the message's
//! definition, then, after a line of `=` and `MSG: package/Name` each, of all that it uses.

use std::collections::BTreeMap;

use crate::import::number::Kind;

/// Most fields of a message, those of nested ones counted; types that double at each level would
/// eat the memory.
const FIELDS_MAX: usize = 20_000;
/// Deeper nesting than any message has; ends types that hold themselves.
const DEPTH_MAX: usize = 32;

/// The type of a field.
#[derive(Debug, PartialEq)]
pub(super) enum Type {
    Number(Kind),
    /// Text of at most so many bytes.
    Text(usize),
    Struct(Struct),
    /// So many of a type.
    Array(Box<Type>, usize),
    /// At most `bound` of a type, with their count before them; `id` is its number among the
    /// sequences of the message, from 0.
    Sequence {
        element: Box<Type>,
        bound: usize,
        id: usize,
    },
}

/// A message.
#[derive(Debug, PartialEq)]
pub(super) struct Struct {
    /// Whether this is `builtin_interfaces/Time` or `/Duration`: two numbers that are one time.
    pub(super) is_time: bool,
    pub(super) fields: Vec<(String, Type)>,
}

/// Lines `type name` by the name of the message that has them.
type Definitions<'t> = BTreeMap<String, Vec<(&'t str, &'t str)>>;

impl Struct {
    /// * `name` - of the message, as `sensor_msgs/msg/Imu`
    ///
    /// The message, and how many sequences are in it.
    ///
    /// # Errors
    /// Says which line or type cannot be read.
    pub(super) fn parse(name: &str, text: &str) -> Result<(Self, usize), String> {
        let mut definitions = Definitions::new();
        let mut current = short(name);
        let top = current.clone();
        definitions.insert(current.clone(), Vec::new());
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if let Some(next) = line.strip_prefix("MSG:") {
                current = short(next.trim());
                definitions.insert(current.clone(), Vec::new());
            } else if !line.is_empty() && !line.trim_matches('=').is_empty() {
                let (kind, name, is_constant) = field(line).ok_or_else(|| {
                    format!("the definition of `{current}` has the line `{line}`: not `type name`")
                })?;
                if let (false, Some(fields)) = (is_constant, definitions.get_mut(&current)) {
                    fields.push((kind, name));
                }
            }
        }
        let mut resolver = Resolver { definitions, fields: 0, sequences: 0 };
        let message = resolver.message(&top, 0)?;
        Ok((message, resolver.sequences))
    }
}

/// `package/Name` of `package/msg/Name`.
fn short(name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, name))) => format!("{package}/{name}"),
        _ => name.to_owned(),
    }
}

/// Type and name of a line, and whether it is a constant; `None` is no field.
fn field(line: &str) -> Option<(&str, &str, bool)> {
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, rest) = rest.split_at(end);
    if name.is_empty() || !(rest.is_empty() || rest.starts_with([' ', '\t', '='])) {
        return None;
    }
    Some((kind, name, rest.trim_start().starts_with('=')))
}

struct Resolver<'t> {
    definitions: Definitions<'t>,
    fields: usize,
    sequences: usize,
}

impl Resolver<'_> {
    fn message(&mut self, name: &str, depth: usize) -> Result<Struct, String> {
        if depth == DEPTH_MAX {
            return Err(format!("`{name}` is nested more than {DEPTH_MAX} deep"));
        }
        let is_time = ["builtin_interfaces/Time", "builtin_interfaces/Duration"].contains(&name);
        let lines = match self.definitions.get(name) {
            Some(lines) => lines.clone(),
            // Some writers leave out what every ROS 2 has.
            None if is_time => vec![("int32", "sec"), ("uint32", "nanosec")],
            None => return Err(format!("`{name}` is not defined")),
        };
        let mut fields = Vec::new();
        for (kind, field) in &lines {
            self.fields += 1;
            if self.fields > FIELDS_MAX {
                return Err(format!("more than {FIELDS_MAX} fields"));
            }
            let kind = self
                .field(kind, name, depth)
                .map_err(|problem| format!("field `{field}` of `{name}`: {problem}"))?;
            fields.push(((*field).to_owned(), kind));
        }
        if fields.is_empty() {
            // The middleware puts one byte in the place of nothing.
            fields.push(("structure_needs_at_least_one_member".to_owned(), Type::Number(Kind::U8)));
        }
        Ok(Struct { is_time, fields })
    }

    fn field(&mut self, written: &str, of: &str, depth: usize) -> Result<Type, String> {
        let Some((element, count)) =
            written.strip_suffix(']').and_then(|written| written.rsplit_once('['))
        else {
            return self.single(written, of, depth);
        };
        let element = Box::new(self.single(element, of, depth)?);
        let number = |text: &str| {
            text.parse::<u32>()
                .map(|count| count as usize)
                .map_err(|_| format!("`{written}` has no size"))
        };
        let bound = match count.strip_prefix("<=") {
            Some(bound) => number(bound)?,
            None if count.is_empty() => usize::MAX,
            None => {
                return match number(count)? {
                    0 => Err(format!("`{written}` has no elements")),
                    count => Ok(Type::Array(element, count)),
                };
            }
        };
        self.sequences += 1;
        Ok(Type::Sequence { element, bound, id: self.sequences - 1 })
    }

    fn single(&mut self, written: &str, of: &str, depth: usize) -> Result<Type, String> {
        let (name, bound) = match written.split_once("<=") {
            None => (written, usize::MAX),
            Some((name, bound)) => {
                (name, bound.parse().map_err(|_| format!("`{written}` has no size"))?)
            }
        };
        let kind = match name {
            "bool" | "byte" | "char" | "uint8" => Kind::U8,
            "int8" => Kind::I8,
            "int16" => Kind::I16,
            "uint16" => Kind::U16,
            "int32" => Kind::I32,
            "uint32" => Kind::U32,
            "int64" => Kind::I64,
            "uint64" => Kind::U64,
            "float32" => Kind::F32,
            "float64" => Kind::F64,
            "string" => return Ok(Type::Text(bound)),
            "wstring" => {
                return Err("wstring is written in two ways, and the file does not say which: \
                            record without this topic"
                    .to_owned());
            }
            name => {
                let full = match (name, of.split_once('/')) {
                    ("Header", _) => "std_msgs/Header".to_owned(),
                    (name, Some((package, _))) if !name.contains('/') => {
                        format!("{package}/{name}")
                    }
                    (name, _) => short(name),
                };
                return self.message(&full, depth + 1).map(Type::Struct);
            }
        };
        Ok(Type::Number(kind))
    }
}
