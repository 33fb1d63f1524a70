//! Result files are written whole or not at all.

use std::fs;

use example_support::files::write_whole;

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
