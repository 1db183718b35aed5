//! Files are written whole, under their name, through links, and into what is open.
#![cfg(unix)]

use squirrel_log::files::{FileId, writable, write_whole};
use std::fs::{self, File};
use std::io::Write;
use std::os::fd::AsRawFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("files").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn is_link(path: &Path) -> bool {
    fs::symlink_metadata(path).unwrap().is_symlink()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_link_stays_and_the_file_that_it_leads_to_is_written() {
    let folder = folder("links");
    fs::create_dir(folder.join("there")).unwrap();
    fs::write(folder.join("there/file"), "before").unwrap();
    symlink("there/file", folder.join("link")).unwrap();
    symlink("../link", folder.join("there/link to link")).unwrap();
    // Their target is yet to be made.
    symlink("there/new", folder.join("dangling")).unwrap();
    symlink(folder.join("dangling"), folder.join("there/dangling")).unwrap();
    for (link, file) in [
        ("link", "there/file"),
        ("there/link to link", "there/file"),
        ("dangling", "there/new"),
        ("there/dangling", "there/new"),
    ] {
        writable(&folder.join(link)).unwrap();
        write_whole(&folder.join(link), link.as_bytes()).unwrap();
        assert_eq!(fs::read_to_string(folder.join(file)).unwrap(), link);
        assert!(is_link(&folder.join(link)) && !is_link(&folder.join(file)), "{link}");
    }
    assert_eq!(names(&folder), ["dangling", "link", "there"]);
    assert_eq!(names(&folder.join("there")), ["dangling", "file", "link to link", "new"]);
}

#[test]
fn links_in_a_circle_and_into_missing_folders_are_errors_and_stay() {
    let folder = folder("circle");
    symlink("b", folder.join("a")).unwrap();
    symlink("a", folder.join("b")).unwrap();
    symlink("nowhere/file", folder.join("astray")).unwrap();
    for name in ["a", "astray"] {
        assert!(
            writable(&folder.join(name)).is_err() && write_whole(&folder.join(name), b"x").is_err()
        );
        assert!(is_link(&folder.join(name)));
    }
    assert_eq!(names(&folder), ["a", "astray", "b"]);
}

#[test]
fn a_pipe_is_written_to() {
    let folder = folder("pipe");
    let pipe = folder.join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    symlink("pipe", folder.join("link")).unwrap();
    for path in ["pipe", "link"].map(|name| folder.join(name)) {
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).unwrap()
        });
        writable(&path).unwrap();
        write_whole(&path, b"through the pipe").unwrap();
        assert_eq!(reader.join().unwrap(), "through the pipe");
    }
    assert_eq!(names(&folder), ["link", "pipe"]);
}

#[test]
fn what_is_open_is_written_behind_what_is_in_it() {
    let folder = folder("open");
    let mut file = File::create(folder.join("file")).unwrap();
    file.write_all(b"before, ").unwrap();
    let number = file.as_raw_fd();
    symlink(format!("/dev/fd/{number}"), folder.join("link")).unwrap();
    for path in [PathBuf::from(format!("/dev/fd/{number}")), folder.join("link")] {
        writable(&path).unwrap();
        write_whole(&path, b"written, ").unwrap();
    }
    assert_eq!(fs::read_to_string(folder.join("file")).unwrap(), "before, written, written, ");
    assert!(is_link(&folder.join("link")));
    assert_eq!(names(&folder), ["file", "link"]);
}

#[test]
fn paths_of_one_file_are_told_through_links_of_both_kinds() {
    let folder = folder("same");
    fs::write(folder.join("file"), "a").unwrap();
    fs::write(folder.join("other"), "a").unwrap();
    fs::hard_link(folder.join("file"), folder.join("hard")).unwrap();
    symlink("file", folder.join("link")).unwrap();
    symlink(".", folder.join("folder")).unwrap();
    symlink("new", folder.join("dangling")).unwrap();
    let id = |name: &str| FileId::read(&folder.join(name)).unwrap();
    let written = |name: &str| FileId::written(&folder.join(name));
    for name in ["file", "./file", "hard", "link", "folder/file", "folder/folder/link"] {
        assert!(id(name) == id("file") && written(name).contains(&id("file")), "{name}");
        assert!(id(name) != id("other") && !written(name).contains(&id("other")), "{name}");
    }
    for name in ["new", "dangling", "folder/new"] {
        assert!(written(name) == written("new") && written(name) != written("newer"), "{name}");
    }
    // The name under which a file is begun is its own, too.
    assert!(written("file").contains(&id("file.partial")));
}

#[test]
fn a_device_is_nobodys_own_file() {
    let folder = folder("device");
    symlink("/dev/null", folder.join("null")).unwrap();
    symlink("/proc/self/fd/1", folder.join("stdout")).unwrap();
    for path in [
        PathBuf::from("/dev/null"),
        folder.join("null"),
        PathBuf::from("/dev/fd/1"),
        folder.join("stdout"),
    ] {
        assert_eq!(FileId::written(&path), [], "{}", path.display());
    }
    assert_eq!(FileId::read(&folder.join("null")), None);
}
