//! One more effect, as `docs/adding-an-effect.md` adds it, in a copy of the repository: that page
//! is true, and an effect is a file and a line.

use crate::run::{root, target_directory};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

const PAGE: &str = "docs/adding-an-effect.md";
/// Below it lies the effect, whose file has its name.
const EFFECTS: &str = "crates/squirrel-core/src/effects/";
const LIST: &str = "docs/guide/effects.md";
/// Most lines that the page may add beside its new files: two of the compiler, two of the
/// catalogues.
const LINES_MAX: usize = 4;
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// What is asked of the copy, by module or the beginning of a name. The last two ask for one effect by `SQUIRREL_EFFECT`.
const TESTS: [&str; 4] = ["effects::", "vehicle::every_effect", "seen_by_find::", "twins::"];

/// Crates of the copy that are compiled with little optimisation or none: compiling them takes far
/// longer than what the tests ask of them.
const LEVELS: [(&str, u8); 6] = [
    ("hidden-effects", 1),
    ("squirrel-batch", 0),
    ("squirrel-gap", 1),
    ("squirrel-log", 1),
    ("squirrel-report", 0),
    ("squirrel-sim", 1),
];

/// `cargo xtask effect`: compiles the simulator again, so it is no step of `cargo xtask test`.
///
/// # Errors
/// The page is no patch, adds more than it says, or the effect misses something.
pub(crate) fn chore(_: &[String]) -> Result<(), String> {
    let (root, copy) = (root()?, target_directory()?.join("effect"));
    let page = read(&root.join(PAGE))?;
    let page = Page::of(&page);
    let name = page.effect().ok_or(format!("{PAGE}: no file below {EFFECTS}"))?;
    let lines = page.changed_lines();
    if lines.iter().any(|line| line.starts_with('-')) || lines.len() > LINES_MAX {
        return Err(format!("{PAGE}: an effect is a file and a line, and changes {lines:#?}"));
    }
    copied(&root, &copy)?;
    // A version of its own: cargo takes the crates of two folders that share a build folder for the
    // same, and what is built here would be what is run there.
    let (manifest, own) = (copy.join("Cargo.toml"), format!("version = \"{VERSION}\""));
    let text = read(&manifest)?.replace(&own, "version = \"0.0.0-effect\"");
    write(&manifest, text.as_bytes())?;
    for (path, text) in &page.files {
        write(&copy.join(path), text.as_bytes())?;
    }
    for (path, before, after) in page.hunks() {
        replace(&copy.join(path), &before, &after)?;
    }
    let since = modified(&root.join(PAGE))?;
    for path in page.paths() {
        keep_time(
            &copy.join(path),
            modified(&root.join(path)).map_or(since, |time| time.max(since)),
        )?;
    }
    tested(&copy, name)?;
    if !read(&copy.join(LIST))?.contains(&format!("| `{name}` |")) {
        return Err(format!("{LIST}: does not list {name}"));
    }
    eprintln!("{name} in {} lines and {} files", lines.len(), page.files.len());
    Ok(())
}

/// Runs the tests in the copy. The Python package has none of that name, but needs all the others,
/// so that the libraries beside them are built with the features that the whole workspace has, and
/// are there already.
fn tested(copy: &Path, name: &str) -> Result<(), String> {
    let mut command = Command::new("cargo");
    // Shared is what is built on the way; the programs, which have one name in both, stay here.
    command.current_dir(copy).env("CARGO_BUILD_BUILD_DIR", target_directory()?);
    command.env("CARGO_TARGET_DIR", copy.join("target"));
    command.env("SQUIRREL_EFFECT", name).env("SQUIRREL_EFFECTS_WRITE", "1");
    // What is not optimised leaves whole vehicles in lanes on the stack.
    command.env("RUST_MIN_STACK", "67108864");
    // The lock file has the version that the copy no longer has; everything is there already.
    command.args(["test", "--release", "--offline"]);
    for (name, level) in LEVELS {
        command.args(["--config", &format!("profile.release.package.{name}.opt-level={level}")]);
    }
    command.args(
        ["squirrel-py", "squirrel-sim", "squirrel-batch", "hidden-effects"]
            .iter()
            .flat_map(|name| ["-p", name]),
    );
    command.args(["--test", "it", "--"]).args(TESTS);
    let done =
        command.stderr(Stdio::inherit()).output().map_err(|error| format!("cargo: {error}"))?;
    let said = String::from_utf8_lossy(&done.stdout);
    eprint!("{said}");
    if !done.status.success() {
        return Err(format!("the tests in {}: {}", copy.display(), done.status));
    }
    // What is filtered by a name that is gone runs nothing, and fails nothing.
    let missing = TESTS.iter().find(|module| !said.contains(&format!("test {module}")));
    missing.map_or(Ok(()), |module| Err(format!("no test of {module} ran")))
}

/// What the blocks of a page say: new files, whose path stands behind the language, and one patch.
#[derive(Debug, Default)]
struct Page {
    files: Vec<(String, String)>,
    patch: String,
}

impl Page {
    fn of(text: &str) -> Self {
        let mut page = Self::default();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let Some(head) = line.strip_prefix("```") else { continue };
            let block: String = lines
                .by_ref()
                .take_while(|line| *line != "```")
                .flat_map(|line| [line, "\n"])
                .collect();
            match head.split_once(' ') {
                Some((_, path)) => page.files.push((path.to_owned(), block)),
                None if head == "diff" => page.patch += &block,
                None => {}
            }
        }
        page
    }

    /// The name of the effect: its file's.
    fn effect(&self) -> Option<&str> {
        self.files.iter().find_map(|(path, _)| path.strip_prefix(EFFECTS)?.strip_suffix(".rs"))
    }

    /// Paths of all files that are new or changed.
    fn paths(&self) -> impl Iterator<Item = &str> {
        let changed = self.patch.lines().filter_map(|line| line.strip_prefix("+++ b/"));
        self.files.iter().map(|(path, _)| path.as_str()).chain(changed)
    }

    /// Of each hunk: the file, the lines that it finds there, and those that it leaves.
    fn hunks(&self) -> Vec<(String, String, String)> {
        let (mut path, mut hunks) = ("", Vec::<(String, String, String)>::new());
        for line in self.patch.lines().filter(|line| !line.starts_with("--- ")) {
            if let Some(name) = line.strip_prefix("+++ b/") {
                path = name;
            } else if line.starts_with("@@") {
                hunks.push((path.to_owned(), String::new(), String::new()));
            } else if let Some((_, before, after)) = hunks.last_mut() {
                let text = [line.get(1..).unwrap_or_default(), "\n"].concat();
                if !line.starts_with('+') {
                    *before += &text;
                }
                if !line.starts_with('-') {
                    *after += &text;
                }
            }
        }
        hunks
    }

    /// Lines that the patch adds or takes away.
    fn changed_lines(&self) -> Vec<&str> {
        let is_head = |line: &&str| line.starts_with("+++ ") || line.starts_with("--- ");
        self.patch.lines().filter(|line| line.starts_with(['+', '-']) && !is_head(line)).collect()
    }
}

/// Copies the sources as they lie there now, but not what was built or is hidden. Times are kept,
/// so that cargo builds again what the page changes and no more.
fn copied(root: &Path, copy: &Path) -> Result<(), String> {
    if copy.exists() {
        fs::remove_dir_all(copy).map_err(|error| format!("{}: {error}", copy.display()))?;
    }
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let at = root.join(&folder);
        let say = |error: std::io::Error| format!("{}: {error}", at.display());
        for entry in fs::read_dir(&at).map_err(say)? {
            let entry = entry.map_err(say)?;
            let name = entry.file_name();
            let is_built = ["target", "__pycache__", "squirrel-demo"].iter().any(|no| name == *no);
            let is_hidden = name.to_string_lossy().starts_with('.') && name != ".cargo";
            if is_built || is_hidden {
                continue;
            }
            let (from, path) = (entry.path(), folder.join(&name));
            if from.is_dir() {
                folders.push(path);
            } else if from.is_file() {
                let bytes =
                    fs::read(&from).map_err(|error| format!("{}: {error}", from.display()))?;
                write(&copy.join(&path), &bytes)?;
                keep_time(&copy.join(&path), modified(&from)?)?;
            }
        }
    }
    Ok(())
}

fn modified(path: &Path) -> Result<SystemTime, String> {
    path.metadata()
        .and_then(|is| is.modified())
        .map_err(|error| format!("{}: {error}", path.display()))
}

fn keep_time(path: &Path, time: SystemTime) -> Result<(), String> {
    let file = fs::File::options().write(true).open(path);
    file.and_then(|file| file.set_modified(time))
        .map_err(|error| format!("{}: {error}", path.display()))
}

/// Replaces what stands in a file once.
fn replace(path: &Path, before: &str, after: &str) -> Result<(), String> {
    let text = read(path)?;
    let places = text.matches(before).count();
    if places != 1 {
        return Err(format!(
            "{}: must have once, and has {places} times: {before}",
            path.display()
        ));
    }
    write(path, text.replace(before, after).as_bytes())
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let folder = path.parent().map(PathBuf::from).unwrap_or_default();
    fs::create_dir_all(&folder)
        .and_then(|()| fs::write(path, bytes))
        .map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_files_and_one_patch() {
        let page = Page::of(
            "# Page\n```rust crates/squirrel-core/src/effects/tail.rs\nmod a;\n\n```\ntext\n```diff\n--- a/x\n+++ b/x\n@@ -1 +1,2 @@\n y\n+z\n```\n```text\n$ ls\n```\n```diff\n--- a/v\n+++ b/v\n@@ -1 +1 @@\n-w\n+u\n```\n",
        );
        assert_eq!(page.effect(), Some("tail"));
        assert_eq!(page.files[0].1, "mod a;\n\n");
        assert_eq!(page.files.len(), 1);
        assert_eq!(page.changed_lines(), ["+z", "-w", "+u"]);
        assert_eq!(
            page.paths().collect::<Vec<_>>(),
            ["crates/squirrel-core/src/effects/tail.rs", "x", "v"]
        );
        let hunk = |path: &str, before: &str, after: &str| {
            (path.to_owned(), before.to_owned(), after.to_owned())
        };
        assert_eq!(page.hunks(), [hunk("x", "y\n", "y\nz\n"), hunk("v", "w\n", "u\n")]);
    }

    #[test]
    fn the_page_adds_a_file_and_a_line() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let page = read(&folder.join(PAGE)).unwrap();
        let page = Page::of(&page);
        let name = page.effect().unwrap();
        assert!(
            !folder.join(EFFECTS).join(format!("{name}.rs")).exists(),
            "{name} is there already"
        );
        assert_eq!(page.files.len(), 2, "an effect and its twin");
        assert_eq!(page.changed_lines().len(), LINES_MAX);
    }
}
