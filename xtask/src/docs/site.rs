//! The guide as a site: one folder of pages that need no network to be read.

use crate::python;
use crate::run::{call, root, target_directory};
use std::fs;
use std::path::Path;
use std::process::Command;

/// What makes the site. The last one sets formulas as MathML, which browsers draw by themselves.
const PACKAGES: &str = "mkdocs==1.6.1 mkdocs-material==9.8.2 mkdocstrings==1.0.8 mkdocstrings-python==2.0.11 griffelib==2.4.1 pymdown-extensions==13.1.2 latex2mathml==3.81.1";

/// Builds the site; its folder.
///
/// # Errors
/// Its packages cannot be had, mkdocs warns of anything, or a page loads something from outside.
pub(super) fn build() -> Result<String, String> {
    let folder = target_directory()?.join("docs");
    let venv = folder.join("venv");
    python::environment(&venv, PACKAGES).map_err(|error| {
        format!("packages of the guide are not there and PyPI gives none: {error}")
    })?;
    let site = folder.join("site");
    let mut mkdocs = Command::new(python::program(&venv, "python"));
    mkdocs
        .args(["-m", "mkdocs", "build", "--strict", "--quiet", "--clean", "--site-dir"])
        .arg(&site)
        .current_dir(root()?)
        // The theme's advertisement of its makers' other plans is no warning of ours.
        .env("NO_MKDOCS_2_WARNING", "1")
        .env("PYTHONDONTWRITEBYTECODE", "1");
    call(&mut mkdocs)?;
    let pages = inward(&site)?;
    Ok(format!("{pages} pages in {}", site.display()))
}

/// Counts the pages below a folder, none of which may load anything from the network.
fn inward(folder: &Path) -> Result<usize, String> {
    let at = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut count = 0;
    for entry in fs::read_dir(folder).map_err(at)? {
        let path = entry.map_err(at)?.path();
        if path.is_dir() {
            count += inward(&path)?;
        } else if path.extension().is_some_and(|extension| extension == "html") {
            let page = fs::read_to_string(&path).map_err(at)?;
            if let Some(tag) = loads_from_outside(&page) {
                return Err(format!("{} needs the network: {tag}", path.display()));
            }
            count += 1;
        }
    }
    Ok(count)
}

/// The first tag of a page that makes a browser load something from another place.
fn loads_from_outside(page: &str) -> Option<&str> {
    let tags = page.split('<').filter(|tag| {
        ["script", "img", "link", "iframe", "source"].iter().any(|name| tag.starts_with(name))
    });
    tags.filter_map(|tag| tag.split('>').next()).find(|tag| {
        let named = tag.contains("rel=\"canonical\"");
        !named && ["=\"http", "=\"//", "='http", "=http"].iter().any(|begin| tag.contains(begin))
    })
}

#[cfg(test)]
mod tests {
    use super::loads_from_outside;

    #[test]
    fn a_link_is_no_load() {
        let page = "<a href=\"https://a.b\">c</a><img src=\"d.png\"><link href=\"e.css\" rel=\"stylesheet\">";
        assert_eq!(loads_from_outside(page), None);
        let page = "<p><script src=\"https://a.b/c.js\"></script>";
        assert_eq!(loads_from_outside(page), Some("script src=\"https://a.b/c.js\""));
    }
}
