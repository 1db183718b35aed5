//! Files are written whole, under their name, through links, and into what is open.
#![cfg(unix)]

use squirrel_log::files::{FileId, Lock, read_text, writable, write_whole};
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
fn a_file_that_is_not_there_is_told_with_where_it_was_looked_for() {
    let folder = folder("missing");
    let said = |path: &Path| read_text(path).unwrap_err().to_string();
    let here = std::env::current_dir().unwrap();
    assert_eq!(said(Path::new("no.mcap")), format!("No such file in {}", here.display()));
    assert_eq!(said(&folder.join("no.mcap")), format!("No such file in {}", folder.display()));
    let deep = folder.join("flihgts/monday/no.mcap");
    let missing = folder.join("flihgts");
    assert_eq!(said(&deep), format!("No such file: there is no folder {}", missing.display()));
    symlink("nowhere", folder.join("dangling")).unwrap();
    assert!(said(&folder.join("dangling")).starts_with("No such file or directory"));
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
        assert!(id(name) == id("file") && written(name) == Some(id("file")), "{name}");
        assert!(id(name) != id("other") && written(name) != Some(id("other")), "{name}");
    }
    for name in ["new", "dangling", "folder/new"] {
        assert!(written(name) == written("new") && written(name) != written("newer"), "{name}");
    }
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
        assert_eq!(FileId::written(&path), None, "{}", path.display());
    }
    assert_eq!(FileId::read(&folder.join("null")), None);
}

/// A name that others can foresee is theirs: a file of it is not deleted, a link not followed.
#[test]
fn files_that_look_like_begun_ones_are_left_alone() {
    let folder = folder("begun");
    fs::write(folder.join("mine"), "mine").unwrap();
    fs::write(folder.join("log.partial"), "mine").unwrap();
    symlink("mine", folder.join("page.partial")).unwrap();
    for name in ["log", "page"] {
        writable(&folder.join(name)).unwrap();
        write_whole(&folder.join(name), b"new").unwrap();
    }
    assert_eq!(names(&folder), ["log", "log.partial", "mine", "page", "page.partial"]);
    for name in ["mine", "log.partial"] {
        assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), "mine");
    }
    assert!(is_link(&folder.join("page.partial")));
}

#[test]
fn a_file_keeps_its_mode_and_a_new_one_has_that_of_any() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder("mode");
    let mode = |name: &str| fs::metadata(folder.join(name)).unwrap().permissions().mode() & 0o777;
    for (name, wanted) in [("secret", 0o600), ("shared", 0o664), ("read only", 0o444)] {
        let path = folder.join(name);
        fs::write(&path, "before").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(wanted)).unwrap();
        write_whole(&path, b"after").unwrap();
        assert_eq!(mode(name), wanted, "{name}");
    }
    fs::write(folder.join("plain"), "").unwrap();
    write_whole(&folder.join("new"), b"").unwrap();
    assert_eq!(mode("new"), mode("plain"));
}

/// Of many who write one file, none fails, and what is there is always one of them whole.
#[test]
fn parallel_writers_leave_one_of_them_whole() {
    let folder = folder("parallel");
    let path = folder.join("file");
    std::thread::scope(|threads| {
        for writer in 0..8_u8 {
            let path = &path;
            threads.spawn(move || {
                for _ in 0..20 {
                    write_whole(path, &vec![b'a' + writer; 50_000]).unwrap();
                    let seen = fs::read(path).unwrap();
                    assert!(seen.len() == 50_000 && seen.iter().all(|byte| *byte == seen[0]));
                }
            });
        }
    });
    assert_eq!(names(&folder), ["file"]);
}

#[test]
fn a_folder_is_locked_by_one_at_a_time() {
    let folder = folder("lock");
    let first = Lock::folder(&folder).unwrap();
    let error = Lock::folder(&folder).unwrap_err().to_string();
    assert!(error.contains("another squirrel is writing into this folder"), "{error}");
    drop(first);
    assert_eq!(names(&folder), [""; 0]);
    drop(Lock::folder(&folder).unwrap());
    // What somebody who was killed left locks nothing; a planted link is not followed.
    fs::write(folder.join(".squirrel.lock"), "").unwrap();
    drop(Lock::folder(&folder).unwrap());
    symlink("elsewhere", folder.join(".squirrel.lock")).unwrap();
    assert!(Lock::folder(&folder).is_err());
    assert_eq!(names(&folder), [".squirrel.lock"]);
}

#[test]
fn a_text_that_nobody_wrote_is_refused_before_it_is_read() {
    let folder = folder("large");
    File::create(folder.join("large.toml")).unwrap().set_len(1 << 40).unwrap();
    for path in [folder.join("large.toml"), PathBuf::from("/dev/zero")] {
        let error = read_text(&path).unwrap_err().to_string();
        assert_eq!(error, "is larger than 8 MB, the most that is read");
    }
    assert!(read_text(&folder).is_err());
}
