//! The `keep` mask of an import map: which rows of a foreign log are worth importing.
//!
//! ```text
//! keep  = any   any = all ("or" all)*   all = term ("and" term)*   term = "(" any ")" | value compare number
//! value = column | "abs(" column ")" | "mean(" column ("," column)* ")"      compare = < <= > >= == !=
//! ```
//! A column is compared as the file has it, before scale and offset. Names with other characters
//! than letters, digits and `_ . [ ] : /` go in single quotes. A comparison with an empty cell is
//! false.

use super::table::Table;

/// A condition on the columns of one row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Condition {
    Compare { value: Value, compare: Compare, number: f64 },
    All(Vec<Condition>),
    Any(Vec<Condition>),
}

/// What is compared.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Column(String),
    Abs(String),
    Mean(Vec<String>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compare {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
}

impl Condition {
    /// Reads a mask.
    ///
    /// # Errors
    /// Says what was expected and what was found.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let tokens = tokens(text)?;
        let mut parser = Parser { tokens: &tokens, depth: 0 };
        let condition = parser.any()?;
        match parser.tokens.first() {
            None => Ok(condition),
            Some(_) => Err(parser.expected("`and`, `or` or the end")),
        }
    }

    /// The parts that must all hold: each may look at another file.
    pub(super) fn into_terms(self) -> Vec<Condition> {
        match self {
            Condition::All(terms) => terms.into_iter().flat_map(Condition::into_terms).collect(),
            other => vec![other],
        }
    }

    /// Columns that the condition looks at.
    pub(super) fn columns(&self) -> Vec<&str> {
        match self {
            Condition::Compare { value: Value::Column(column) | Value::Abs(column), .. } => {
                vec![column]
            }
            Condition::Compare { value: Value::Mean(columns), .. } => {
                columns.iter().map(String::as_str).collect()
            }
            Condition::All(parts) | Condition::Any(parts) => {
                parts.iter().flat_map(Condition::columns).collect()
            }
        }
    }

    /// Row by row: does the condition hold? The table must have all of [`Condition::columns`].
    pub(super) fn rows(&self, table: &Table) -> Vec<bool> {
        match self {
            Condition::Compare { value, compare, number } => {
                value.numbers(table).into_iter().map(|x| compare.holds(x, *number)).collect()
            }
            Condition::All(parts) => {
                fold(parts.iter().map(|part| part.rows(table)), table.len(), true, |a, b| a && b)
            }
            Condition::Any(parts) => {
                fold(parts.iter().map(|part| part.rows(table)), table.len(), false, |a, b| a || b)
            }
        }
    }
}

fn fold(
    parts: impl Iterator<Item = Vec<bool>>,
    len: usize,
    start: bool,
    join: impl Fn(bool, bool) -> bool,
) -> Vec<bool> {
    parts.fold(vec![start; len], |mut all, part| {
        for (a, b) in all.iter_mut().zip(part) {
            *a = join(*a, b);
        }
        all
    })
}

impl Value {
    fn numbers(&self, table: &Table) -> Vec<f64> {
        match self {
            Value::Column(column) => table.column(column).to_vec(),
            Value::Abs(column) => table.column(column).iter().map(|x| x.abs()).collect(),
            Value::Mean(columns) => {
                let columns: Vec<&[f64]> = columns.iter().map(|c| table.column(c)).collect();
                (0..table.len())
                    .map(|row| columns.iter().map(|c| c[row]).sum::<f64>() / columns.len() as f64)
                    .collect()
            }
        }
    }
}

impl Compare {
    fn holds(self, x: f64, number: f64) -> bool {
        match self {
            Compare::Less => x < number,
            Compare::LessEqual => x <= number,
            Compare::Greater => x > number,
            Compare::GreaterEqual => x >= number,
            Compare::Equal => x == number,
            Compare::NotEqual => !x.is_nan() && x != number,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    /// A bare word: a column, `and`, `or`, `abs`, `mean`.
    Word(String),
    /// A column in single quotes.
    Quoted(String),
    Number(f64),
    Compare(Compare),
    Open,
    Close,
    Comma,
}

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let (token, len) = match first {
            '(' => (Token::Open, 1),
            ')' => (Token::Close, 1),
            ',' => (Token::Comma, 1),
            '<' if rest.starts_with("<=") => (Token::Compare(Compare::LessEqual), 2),
            '<' => (Token::Compare(Compare::Less), 1),
            '>' if rest.starts_with(">=") => (Token::Compare(Compare::GreaterEqual), 2),
            '>' => (Token::Compare(Compare::Greater), 1),
            '=' if rest.starts_with("==") => (Token::Compare(Compare::Equal), 2),
            '!' if rest.starts_with("!=") => (Token::Compare(Compare::NotEqual), 2),
            '\'' => {
                let end = rest[1..].find('\'').ok_or("a single quote without its partner")?;
                (Token::Quoted(rest[1..=end].to_owned()), end + 2)
            }
            '0'..='9' | '.' | '+' | '-' => {
                let len = rest
                    .char_indices()
                    .find(|&(i, c)| {
                        let sign_of_exponent =
                            matches!(c, '+' | '-') && (i == 0 || rest[..i].ends_with(['e', 'E']));
                        !(c.is_ascii_alphanumeric() || c == '.' || c == '_' || sign_of_exponent)
                    })
                    .map_or(rest.len(), |(i, _)| i);
                let number =
                    rest[..len].replace('_', "").parse::<f64>().ok().filter(|x| x.is_finite());
                (
                    Token::Number(
                        number.ok_or_else(|| format!("`{}` is no number", &rest[..len]))?,
                    ),
                    len,
                )
            }
            c if word_character(c) => {
                let len = rest.find(|c| !word_character(c)).unwrap_or(rest.len());
                (Token::Word(rest[..len].to_owned()), len)
            }
            other => return Err(format!("unexpected `{other}`")),
        };
        tokens.push(token);
        rest = rest[len..].trim_start();
    }
    Ok(tokens)
}

fn word_character(c: char) -> bool {
    c.is_alphanumeric() || "_.[]:/".contains(c)
}

/// Deeper nesting than anyone writes by hand; bounds the recursion.
const DEPTH_MAX: usize = 32;

struct Parser<'a> {
    tokens: &'a [Token],
    depth: usize,
}

impl Parser<'_> {
    fn any(&mut self) -> Result<Condition, String> {
        let mut parts = vec![self.all()?];
        while self.take(&Token::Word("or".into())) {
            parts.push(self.all()?);
        }
        Ok(single_or(parts, Condition::Any))
    }

    fn all(&mut self) -> Result<Condition, String> {
        let mut parts = vec![self.term()?];
        while self.take(&Token::Word("and".into())) {
            parts.push(self.term()?);
        }
        Ok(single_or(parts, Condition::All))
    }

    fn term(&mut self) -> Result<Condition, String> {
        if self.take(&Token::Open) {
            self.depth += 1;
            if self.depth > DEPTH_MAX {
                return Err(format!("more than {DEPTH_MAX} parentheses inside each other"));
            }
            let inner = self.any()?;
            self.need(&Token::Close, "`)`")?;
            self.depth -= 1;
            return Ok(inner);
        }
        let value = self.value()?;
        let Some((Token::Compare(compare), rest)) = self.tokens.split_first() else {
            return Err(self.expected("one of < <= > >= == !="));
        };
        self.tokens = rest;
        let Some((Token::Number(number), rest)) = self.tokens.split_first() else {
            return Err(self.expected("a number"));
        };
        self.tokens = rest;
        Ok(Condition::Compare { value, compare: *compare, number: *number })
    }

    fn value(&mut self) -> Result<Value, String> {
        match self.tokens {
            [Token::Word(word), Token::Open, rest @ ..] if word == "abs" => {
                self.tokens = rest;
                let column = self.column()?;
                self.need(&Token::Close, "`)`")?;
                Ok(Value::Abs(column))
            }
            [Token::Word(word), Token::Open, rest @ ..] if word == "mean" => {
                self.tokens = rest;
                let mut columns = vec![self.column()?];
                while self.take(&Token::Comma) {
                    columns.push(self.column()?);
                }
                self.need(&Token::Close, "`,` or `)`")?;
                Ok(Value::Mean(columns))
            }
            _ => Ok(Value::Column(self.column()?)),
        }
    }

    fn column(&mut self) -> Result<String, String> {
        match self.tokens {
            [Token::Word(name), rest @ ..] if !matches!(name.as_str(), "and" | "or") => {
                self.tokens = rest;
                Ok(name.clone())
            }
            [Token::Quoted(name), rest @ ..] => {
                self.tokens = rest;
                Ok(name.clone())
            }
            _ => Err(self.expected("a column")),
        }
    }

    fn take(&mut self, token: &Token) -> bool {
        let found = self.tokens.first() == Some(token);
        if found {
            self.tokens = &self.tokens[1..];
        }
        found
    }

    fn need(&mut self, token: &Token, name: &str) -> Result<(), String> {
        if self.take(token) { Ok(()) } else { Err(self.expected(name)) }
    }

    fn expected(&self, what: &str) -> String {
        match self.tokens.first() {
            None => format!("expected {what}, found the end"),
            Some(token) => format!("expected {what}, found {}", spelled(token)),
        }
    }
}

fn spelled(token: &Token) -> String {
    match token {
        Token::Word(word) => format!("`{word}`"),
        Token::Quoted(name) => format!("`'{name}'`"),
        Token::Number(number) => format!("`{number}`"),
        Token::Compare(_) => "a comparison".to_owned(),
        Token::Open => "`(`".to_owned(),
        Token::Close => "`)`".to_owned(),
        Token::Comma => "`,`".to_owned(),
    }
}

fn single_or(mut parts: Vec<Condition>, join: fn(Vec<Condition>) -> Condition) -> Condition {
    if parts.len() == 1 { parts.remove(0) } else { join(parts) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table::from_columns(&[
            ("pz", &[0.1, 0.5, f64::NAN, 0.9, -0.7]),
            ("acc.x", &[-2.0, 2.0, 3.0, -4.0, 0.0]),
            ("m 1", &[0.0, 1.0, 2.0, 3.0, 4.0]),
        ])
    }

    fn kept(mask: &str) -> Vec<usize> {
        let rows = Condition::parse(mask).unwrap().rows(&table());
        rows.iter().enumerate().filter(|(_, keep)| **keep).map(|(row, _)| row).collect()
    }

    #[test]
    fn each_comparison_holds_where_it_should() {
        assert_eq!(kept("pz > 0.4"), [1, 3]);
        assert_eq!(kept("pz<=0.5"), [0, 1, 4]);
        assert_eq!(kept("pz >= 0.5"), [1, 3]);
        assert_eq!(kept("pz < -5e-1"), [4]);
        assert_eq!(kept("pz == 0.5"), [1]);
        assert_eq!(kept("pz != 0.5"), [0, 3, 4], "an empty cell is dropped");
        assert_eq!(kept("abs(acc.x) < 3"), [0, 1, 4]);
        assert_eq!(kept("mean('m 1', acc.x) > 1"), [1, 2, 4]);
    }

    #[test]
    fn and_binds_tighter_than_or() {
        assert_eq!(kept("acc.x == 2 or acc.x == 3 and pz > 5"), [1]);
        assert_eq!(kept("(acc.x == 2 or acc.x == 3) and pz > 5"), [] as [usize; 0]);
    }

    #[test]
    fn terms_split_at_the_outer_and_only() {
        let terms = Condition::parse("a > 1 and (b > 2 and c > 3) and (d > 4 or e > 5)")
            .unwrap()
            .into_terms();
        let columns: Vec<_> = terms.iter().map(Condition::columns).collect();
        assert_eq!(columns, [vec!["a"], vec!["b"], vec!["c"], vec!["d", "e"]]);
    }

    #[test]
    fn a_bad_mask_says_what_was_expected() {
        for (mask, message) in [
            ("", "expected a column, found the end"),
            ("pz", "expected one of < <= > >= == !=, found the end"),
            ("pz > high", "expected a number, found `high`"),
            ("pz = 3", "unexpected `=`"),
            ("0.4 < pz", "expected a column, found `0.4`"),
            ("pz > 1 pz < 2", "expected `and`, `or` or the end, found `pz`"),
            ("pz > 1 and", "expected a column, found the end"),
            ("(pz > 1", "expected `)`, found the end"),
            ("mean(a; b) > 1", "unexpected `;`"),
            ("pz > 1.2.3", "`1.2.3` is no number"),
            ("pz > 1e999", "`1e999` is no number"),
            ("'pz > 1", "a single quote without its partner"),
        ] {
            assert_eq!(Condition::parse(mask).unwrap_err(), message, "{mask}");
        }
        let deep = "(".repeat(100_000);
        assert_eq!(
            Condition::parse(&deep).unwrap_err(),
            "more than 32 parentheses inside each other"
        );
    }
}
