//! The options of the example `render_dataset`, and the files that examples write.

#[path = "../examples/files/mod.rs"]
#[allow(dead_code, reason = "shared with the examples")]
mod files;
#[path = "../examples/render_dataset/kinds.rs"]
mod kinds;

use files::write_whole;
use kinds::{Kind, Kinds, repeated, share, size};
use rand::Rng as _;

fn kinds_of(list: &str) -> Vec<Kind> {
    let kinds = list
        .split(',')
        .map(|name| name.parse::<Kinds>().expect("known"));
    kinds.flat_map(|k| k.0).collect()
}

#[test]
fn shares_sizes_and_kinds_that_make_no_sense_are_refused() {
    for text in ["-0.1", "1.01", "nan", "inf", "much"] {
        let refused = share(text).expect_err("no share");
        assert!(refused.contains(text), "{refused}");
    }
    assert_eq!(share("0"), Ok(0.0));
    assert_eq!(share("1"), Ok(1.0));
    for text in ["768", "768x", "15x100", "100x8193", "-1x100"] {
        let refused = size(text).expect_err("no size");
        assert!(refused.contains(text), "{refused}");
    }
    assert_eq!(size("768x576"), Ok((768, 576)));
    assert_eq!(repeated(&kinds_of("cell,benchmark")), None);
    assert_eq!(repeated(&kinds_of("cell,plain")).as_deref(), Some("plain"));
    assert_eq!(
        repeated(&kinds_of("clean,many,clean")).as_deref(),
        Some("clean")
    );
}

#[test]
fn no_two_kinds_and_no_two_seeds_share_their_draws() {
    let mut first: Vec<u64> = kinds_of("cell,benchmark")
        .iter()
        .flat_map(|kind| [1, 2].map(|seed| kind.generator(seed).next_u64()))
        .collect();
    let count = first.len();
    first.sort_unstable();
    first.dedup();
    assert_eq!(first.len(), count);
}

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
        std::fs::read(folder.path().join("table.csv")).expect("written"),
        b"short"
    );
    #[cfg(unix)]
    assert!(path.is_symlink());
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .collect();
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
    let there = std::fs::metadata(&path).expect("still there");
    assert!(there.file_type().is_socket());
}
