//! The blocks of a page of Markdown, and what is to be done with each.

/// What a block is there for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Use {
    /// Commands of a shell.
    Run,
    /// Commands after `$ `, each with what it prints.
    Compare,
    /// Lines of Python; those of a page are one program.
    Python,
    /// A file that the commands find.
    Write(String),
    /// To look at.
    Show,
}

/// A block in its fence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Block {
    /// Line of the opening fence, from 1.
    pub(super) line: usize,
    pub(super) text: String,
    pub(super) purpose: Use,
}

/// The comment before a block that cannot run, and why.
const NOT_RUN: &str = "<!-- not run: ";

/// All blocks of a page, in order.
///
/// # Errors
/// `line N: ...` where a block does not say what it is, or is code that nothing runs.
pub(super) fn of(page: &str) -> Result<Vec<Block>, String> {
    let mut blocks = Vec::new();
    let mut lines = page.lines().enumerate();
    let mut before = "";
    while let Some((i, line)) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        let Some(info) = line.trim_start().strip_prefix("```") else {
            if !line.trim().is_empty() {
                before = line.trim();
            }
            continue;
        };
        let at = |problem: &str| format!("line {}: {problem}", i + 1);
        let mut text = String::new();
        loop {
            let (_, inner) = lines.next().ok_or_else(|| at("the block has no end"))?;
            if inner.trim() == "```" {
                break;
            }
            text += inner.get(indent..).unwrap_or(inner.trim_start());
            text.push('\n');
        }
        let purpose = purpose(info, before).map_err(|problem| at(&problem))?;
        blocks.push(Block { line: i + 1, text, purpose });
        before = "";
    }
    Ok(blocks)
}

/// What a block with these words after its fence is for; `before` is the line above it.
fn purpose(info: &str, before: &str) -> Result<Use, String> {
    if let Some(reason) = before.strip_prefix(NOT_RUN) {
        let reason = reason.strip_suffix("-->").unwrap_or("").trim();
        return if reason.len() < 8 {
            Err("the comment does not say why the block is not run".to_owned())
        } else {
            Ok(Use::Show)
        };
    }
    let (language, rest) = info.split_once(' ').unwrap_or((info, ""));
    if let Some(title) = rest.trim().strip_prefix("title=\"") {
        let name = title.trim_end_matches('"');
        let inside = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        return if name.chars().all(inside) && !name.starts_with('.') {
            Ok(Use::Write(name.to_owned()))
        } else {
            Err(format!("`{name}` is no file of the page's folder"))
        };
    }
    match language {
        "sh" => Ok(Use::Run),
        "console" => Ok(Use::Compare),
        "python" => Ok(Use::Python),
        "text" | "toml" | "csv" | "json" | "diff" => Ok(Use::Show),
        "" => Err("the block does not say what it is".to_owned()),
        _ => Err(format!("nothing runs `{language}`: say `{NOT_RUN}why -->` above it")),
    }
}

/// A command with the output that is shown below it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Shown {
    pub(super) command: String,
    pub(super) output: Vec<String>,
}

/// The commands of a block that is compared.
///
/// # Errors
/// Output above the first command.
pub(super) fn shown(text: &str) -> Result<Vec<Shown>, String> {
    let mut all: Vec<Shown> = Vec::new();
    let mut goes_on = false;
    for line in text.lines() {
        if let Some(command) = line.strip_prefix("$ ") {
            all.push(Shown { command: command.to_owned(), output: Vec::new() });
            goes_on = command.ends_with('\\');
            continue;
        }
        let last = all.last_mut().ok_or("output without a command (`$ `) above it")?;
        if goes_on {
            last.command += "\n";
            last.command += line;
            goes_on = line.ends_with('\\');
        } else {
            last.output.push(line.to_owned());
        }
    }
    Ok(all)
}

/// Whether lines are those that a page shows, where `...` stands for any number of them.
pub(super) fn alike(shown: &[String], said: &[&str]) -> bool {
    match shown.split_first() {
        None => said.iter().all(|line| line.trim().is_empty()),
        Some((dots, rest)) if dots.trim() == "..." => {
            (0..=said.len()).any(|skipped| alike(rest, &said[skipped..]))
        }
        Some((line, rest)) => said.split_first().is_some_and(|(first, after)| {
            first.trim_end() == line.trim_end() && alike(rest, after)
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_say_what_they_are_for() {
        let page = "a\n```sh\nsquirrel fly\n```\n<!-- not run: needs a flight of yours -->\n\n```sh\nx\n```\n\
                    - b\n  ```toml title=\"map.toml\"\n  a = 1\n  ```\n```console\n$ x\n```\n```python\np\n```\n";
        let blocks = of(page).unwrap();
        let uses: Vec<Use> = blocks.iter().map(|block| block.purpose.clone()).collect();
        let file = Use::Write("map.toml".to_owned());
        assert_eq!(uses, [Use::Run, Use::Show, file, Use::Compare, Use::Python]);
        assert_eq!((blocks[1].line, blocks[2].text.as_str()), (7, "a = 1\n"));
    }

    #[test]
    fn code_that_nothing_runs_needs_a_reason() {
        for (page, problem) in [
            ("```rust\n```\n", "line 1: nothing runs `rust`"),
            ("```\n```\n", "line 1: the block does not say what it is"),
            ("```sh\n", "line 1: the block has no end"),
            ("<!-- not run: -->\n```sh\n```\n", "line 2: the comment does not say why"),
            ("<!-- not run: no -->\n```sh\n```\n", "line 2: the comment does not say why"),
            ("```toml title=\"../a\"\n```\n", "line 1: `../a` is no file"),
        ] {
            let said = of(page).unwrap_err();
            assert!(said.starts_with(problem), "{said}");
        }
    }

    #[test]
    fn output_stands_below_its_command() {
        let all = shown("$ a \\\n  b\nc\n$ d\n").unwrap();
        assert_eq!(all[0], Shown { command: "a \\\n  b".to_owned(), output: vec!["c".to_owned()] });
        assert_eq!(all[1].output, Vec::<String>::new());
        assert!(shown("c\n$ d\n").is_err());
    }

    #[test]
    fn dots_stand_for_any_lines() {
        let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
        for (shown, said, same) in [
            ("a\nb", "a  \nb\n\n", true),
            ("a\n...\nd", "a\nb\nc\nd", true),
            ("...", "", true),
            ("a\n...", "b", false),
            ("a", "a\nb", false),
            ("a\nb", "a", false),
        ] {
            let said: Vec<&str> = said.lines().collect();
            assert_eq!(alike(&lines(shown), &said), same, "{shown} {said:?}");
        }
    }
}
