//! The page on import maps has every key that the parser knows, and what it shows parses.

use squirrel_log::import::{ImportError, ImportMap};

const PAGE: &str = include_str!("../../../../docs/guide/import.md");

/// What the parser would take where it is given something else: it says so itself.
fn taken(map: &str) -> Vec<String> {
    let Err(ImportError::MapSyntax { message, .. }) = ImportMap::parse(map, "map") else {
        panic!("taken: {map}");
    };
    let (_, list) = message.split_once("expected ").unwrap_or_else(|| panic!("{message}"));
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn map(top: &str, source: &str, time: &str, channel: &str) -> String {
    format!(
        "{top}\n[[source]]\n{source}\ntime = {{ column = \"t\", {time} }}\n\
         [source.channels]\n\"truth.a\" = {{ columns = [\"x\"], {channel} }}\n"
    )
}

#[test]
fn every_key_and_every_word_is_on_the_page() {
    let unit = "unit = \"s\"";
    let mut words = Vec::new();
    for (keys, wrong) in [
        (3, map("zzz = 1", "", unit, "")),
        (5, map("", "zzz = 1", unit, "")),
        (3, map("", "", "unit = \"s\", zzz = 1", "")),
        (12, map("", "", unit, "zzz = 1")),
        (2, map("times = \"zzz\"", "", unit, "")),
        (4, map("", "", "unit = \"zzz\"", "")),
        (3, map("", "", unit, "world = \"zzz\"")),
        (2, map("", "", unit, "body = \"zzz\"")),
        (2, map("", "", unit, "order = \"zzz\"")),
        (2, map("", "", unit, "direction = \"zzz\"")),
        (1, map("", "", unit, "repeats = \"zzz\"")),
    ] {
        let taken = taken(&wrong);
        assert!(taken.len() >= keys, "{taken:?}");
        words.extend(taken);
    }
    let missing: Vec<&String> =
        words.iter().filter(|word| !PAGE.contains(&format!("`{word}`"))).collect();
    assert!(missing.is_empty(), "not in docs/guide/import.md: {missing:?}");
    // And in an example, keys at least.
    let examples: String = examples().concat();
    for key in [
        "keep",
        "times",
        "file",
        "topic",
        "instance",
        "offset_s",
        "scale",
        "offset",
        "rotors",
        "repeats",
        "optional",
        "turned_by",
        "gravity_m_s2",
        "direction",
    ] {
        assert!(words.iter().any(|word| word == key), "{key} is no key any more");
        assert!(examples.contains(&format!("{key} = ")), "no example of {key}");
    }
}

fn examples() -> Vec<&'static str> {
    PAGE.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn every_example_parses() {
    assert!(examples().len() >= 5);
    for example in examples() {
        ImportMap::parse(example, "docs/guide/import.md")
            .unwrap_or_else(|e| panic!("{e}\n{example}"));
    }
}
