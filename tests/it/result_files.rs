//! Result files are written whole or not at all.

use std::fs;

use example_support::files::{lock_folder, write_whole};
use example_support::program::on_threads;

#[test]
fn a_file_is_replaced_as_a_whole_and_a_link_stays_a_link() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("table.csv");
    write_whole(&path, b"longer than what follows").expect("a new file");
    #[cfg(unix)]
    let path = {
        let link = folder.path().join("link.csv");
        std::os::unix::fs::symlink(&path, &link).expect("a link");
        link
    };
    write_whole(&path, b"short").expect("a file that is there");
    assert_eq!(
        fs::read(folder.path().join("table.csv")).expect("written"),
        b"short"
    );
    #[cfg(unix)]
    assert!(path.is_symlink());
    let left: Vec<_> = fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1 + usize::from(cfg!(unix)), "{left:?}");
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_replaced() {
    use std::os::unix::fs::FileTypeExt as _;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("socket");
    let _listening = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
    let refused = write_whole(&path, b"text").expect_err("a socket is not written to like this");
    assert!(refused.to_string().contains("socket"), "{refused}");
    let there = fs::metadata(&path).expect("still there");
    assert!(there.file_type().is_socket());
}

#[test]
fn a_folder_is_written_to_by_one_program_at_a_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let held = lock_folder(folder.path()).expect("nobody holds it");
    let refused = lock_folder(folder.path()).expect_err("held").to_string();
    let holder = format!("process {} is writing", std::process::id());
    assert!(refused.contains(&holder), "{refused}");
    drop(held);
    lock_folder(folder.path()).expect("free again");
}

#[test]
fn work_on_threads_keeps_its_order_and_its_first_error() {
    let mut squares = Vec::new();
    on_threads(None, 9, &mut squares, |i| Ok(i * i)).expect("no error");
    assert_eq!(squares, [0, 1, 4, 9, 16, 25, 36, 49, 64]);
    let failing = |i| if i == 3 { Err("three".into()) } else { Ok(i) };
    let mut done = Vec::new();
    let error = on_threads(None, 1_000, &mut done, failing).expect_err("of the fourth");
    assert_eq!(error.to_string(), "three");
    assert!(done.starts_with(&[0, 1, 2]) && done.len() < 1_000);
}
