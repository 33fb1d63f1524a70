//! Files: what is written comes back, and nothing damaged does.

use std::path::Path;

use qtable::*;
use rand::{Rng, RngExt};

use crate::support::{q_learning, rng, sealed, zeros};

fn learned(states: usize, actions: usize) -> QTable {
    let mut rng = rng(5);
    let mut table = zeros(states, actions);
    for (state, action) in
        (0..states).flat_map(|s| (0..actions).map(move |a| (State(s), Action(a))))
    {
        let value = rng.random_range(-100.0..1000.0);
        table.set(state, action, value).unwrap();
        table.visit(state, action).unwrap();
    }
    table
}

/// The error of a file, without its path.
fn cause<T: std::fmt::Debug>(outcome: Result<T, FileError>) -> FileError {
    match outcome.unwrap_err() {
        FileError::At { error, .. } => *error,
        other => panic!("{other} has no path"),
    }
}

#[test]
fn what_is_saved_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.qt");
    let table = learned(90, 81);
    save(&path, "table/1", &table).unwrap();
    save(&path, "table/1", &table).unwrap();
    let back: QTable = load(&path, "table/1").unwrap();
    assert_eq!(back, table);
    assert_eq!(back.greedy(), table.greedy());
    let files = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 1, "no temporary file is left");

    let intervals = Intervals::new(&[1.0, 2.0]).unwrap();
    let product = Product::new(vec![intervals]).unwrap();
    let both = (product, Schedule::exponential(0.6, 0.02, 500).unwrap());
    let bytes = encode("x", &both).unwrap();
    assert_eq!(decode::<(Product, Schedule)>("x", &bytes).unwrap(), both);
    let custom = Schedule::custom((0.0, 1.0), |_| 0.5).unwrap();
    let refused = encode("x", &custom).unwrap_err().to_string();
    assert!(refused.contains("a function of yours cannot"), "{refused}");
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("socket");
    let _listening = std::os::unix::net::UnixListener::bind(&path).unwrap();
    // A socket is not to be written to like this; a device is.
    assert!(matches!(
        cause(save(&path, "number/1", &1)),
        FileError::Io(_)
    ));
    assert!(std::fs::metadata(&path).unwrap().file_type().is_socket());
    save("/dev/null", "number/1", &1).unwrap();
}

#[test]
fn errors_name_the_path_and_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("absent.qt");
    let error = load::<QTable>(&path, "table/1").unwrap_err();
    assert!(error.to_string().contains("absent.qt"));
    assert!(matches!(cause::<()>(Err(error)), FileError::Io(_)));
    let nowhere = Path::new("no-such-folder/at-all/policy.qt");
    assert!(matches!(cause(save(nowhere, "k", &1u8)), FileError::Io(_)));

    save(&path, "table/1", &learned(2, 2)).unwrap();
    let other = cause(load::<QTable>(&path, "table/2"));
    assert!(matches!(other, FileError::Kind(..)));
    let long = encode(&"k".repeat(256), &1u8);
    assert!(matches!(long, Err(FileError::KindTooLong(256))));
}

#[cfg(unix)]
#[test]
fn a_saved_file_has_ordinary_permissions() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let (ordinary, ours) = (folder.path().join("ordinary"), folder.path().join("ours"));
    std::fs::write(&ordinary, "x").unwrap();
    save(&ours, "k", &1u8).unwrap();
    assert_eq!(mode(&ours), mode(&ordinary));

    std::fs::set_permissions(&ours, std::fs::Permissions::from_mode(0o640)).unwrap();
    let link = folder.path().join("link");
    symlink(&ours, &link).unwrap();
    save(&link, "k", &2u8).unwrap();
    assert_eq!(mode(&ours), 0o640, "a replaced file keeps its permissions");
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(load::<u8>(&ours, "k").unwrap(), 2);
}

#[test]
fn every_bit_flip_and_every_truncation_is_refused() {
    let bytes = encode("table/1", &learned(3, 2)).unwrap();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(decode::<QTable>("table/1", &damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        let cut = decode::<QTable>("table/1", &bytes[..length]);
        assert!(cut.is_err(), "{length} bytes");
    }
    let longer = [&bytes[..], &[0]].concat();
    let refused = decode::<QTable>("table/1", &longer);
    assert!(matches!(refused, Err(FileError::Checksum(..))));
}

#[test]
fn random_bytes_are_refused() {
    let mut rng = rng(11);
    let sound = encode("table/1", &learned(3, 2)).unwrap();
    let mut bytes = Vec::new();
    for round in 0..20_000 {
        bytes.resize(rng.random_range(0..200), 0);
        rng.fill_bytes(&mut bytes);
        if round % 2 == 0 {
            // A sound beginning, so that more than the signature is tried.
            let kept = rng.random_range(0..sound.len()).min(bytes.len());
            bytes[..kept].copy_from_slice(&sound[..kept]);
        }
        assert!(decode::<QTable>("table/1", &bytes).is_err());
    }
}

#[test]
fn sound_envelopes_with_impossible_contents_are_refused() {
    let refused = |bytes: &[u8]| decode::<QTable>("k", bytes).unwrap_err();
    let newer = refused(&sealed(4, "k", "QTable", &[]));
    assert!(matches!(newer, FileError::Newer(4)));
    for format in [1, 2] {
        let older = refused(&sealed(format, "k", "QTable", &[]));
        assert!(older.to_string().starts_with("made by an earlier version"));
    }

    // A vector that claims 2^63 entries: actions 2, initial value 0, then bincode's 64-bit length.
    let claim = [
        &[2u8, 0, 0, 0, 0, 0, 0, 0, 0, 253][..],
        &(1u64 << 63).to_le_bytes(),
    ]
    .concat();
    let claimed = refused(&sealed(3, "k", "QTable", &claim));
    assert!(matches!(claimed, FileError::Contents(_)));

    let table = |actions: u64, values: &[f64], visits: &[u32]| {
        let config = bincode::config::standard();
        let parts = (actions, 0.0, values, visits, None::<Vec<bool>>);
        let payload = bincode::serde::encode_to_vec(parts, config).unwrap();
        decode::<QTable>("k", &sealed(3, "k", "QTable", &payload))
    };
    let sound = table(2, &[0.0, 1.0], &[3, 4]).unwrap();
    assert_eq!(sound.visits(State(0), Action(1)), 4);
    for (actions, values, visits) in [
        (2, &[0.0, f64::NAN][..], &[0, 0][..]),
        (2, &[0.0, f64::INFINITY], &[0, 0]),
        (2, &[0.0, 1.0, 2.0], &[0, 0, 0]),
        (2, &[0.0, 1.0], &[0]),
        (0, &[], &[]),
        (2, &[], &[]),
    ] {
        let refused = table(actions, values, visits);
        assert!(
            matches!(refused, Err(FileError::Contents(_))),
            "{actions} {values:?}"
        );
    }
    let left_over = decode::<u8>("k", &sealed(3, "k", "", &[7, 0]));
    assert!(matches!(left_over, Err(FileError::Contents(_))));
}

/// Stays as long as no stored type changes; then the format version goes up.
#[test]
fn the_bytes_of_this_format_stay() {
    let mut table = zeros(2, 2);
    table.set(State(1), Action(0), 1.5).unwrap();
    table.visit(State(1), Action(0)).unwrap();
    let print = |bytes: Vec<u8>| (bytes.len(), crc32fast::hash(&bytes[..bytes.len() - 4]));
    assert_eq!(print(encode("table/1", &table).unwrap()), (85, 0x628a_d796));
}

#[test]
fn types_of_the_same_layout_are_told_apart() {
    let bytes = encode("l", &(q_learning(0.5, 0.9), Ties::Random)).unwrap();
    let text = decode::<(QLearning, Target)>("l", &bytes)
        .unwrap_err()
        .to_string();
    assert_eq!(
        text,
        "it holds \"QLearning Ties\", not \"QLearning Target\""
    );
}

#[test]
fn what_is_wide_in_memory_and_short_on_disk_comes_back() {
    // One byte each in the file, 16 in memory.
    for wide in [vec![0u128; (1 << 16) - 8], vec![7u128; 1 << 17]] {
        let bytes = encode("k", &wide).unwrap();
        assert_eq!(decode::<Vec<u128>>("k", &bytes).unwrap(), wide);
    }
}

#[test]
fn a_claimed_text_that_is_not_there_is_refused() {
    for claimed in [1u64 << 25, 1 << 32, 1 << 44, u64::MAX] {
        let payload = [&[253u8][..], &claimed.to_le_bytes()].concat();
        match decode::<String>("k", &sealed(3, "k", "", &payload)) {
            Err(FileError::Contents(why)) => {
                assert!(why.contains("LimitExceeded"), "{claimed}: {why}");
            }
            other => panic!("{claimed}: {other:?}"),
        }
    }
}
