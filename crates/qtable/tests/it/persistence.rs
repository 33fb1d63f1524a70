//! Files: what is written comes back, and nothing damaged does.

use std::path::Path;

use qtable::{
    Action, EpsilonGreedy, FileError, Intervals, ModelEnvironment, Product, QTable, Sarsa, Schedule,
    State, Training, Until, decode, encode, load, save, toys,
};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};

fn learned(states: usize, actions: usize) -> QTable {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut table = QTable::new(states, actions).unwrap();
    for state in 0..states {
        for action in 0..actions {
            table
                .set(
                    State(state),
                    Action(action),
                    rng.random_range(-100.0..1000.0),
                )
                .unwrap();
            table.visit(State(state), Action(action)).unwrap();
        }
    }
    table
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
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "no temporary file is left"
    );

    let product = Product::new(vec![
        Intervals::new(&[1.0, 2.0]).unwrap().with_goal(1).unwrap(),
    ])
    .unwrap();
    let both = (product, Schedule::paper_alpha(500));
    assert_eq!(
        decode::<(Product, Schedule)>("x", &encode("x", &both).unwrap()).unwrap(),
        both
    );
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
        save(&path, "number/1", &1).unwrap_err().problem,
        Problem::Io(_)
    ));
    assert!(std::fs::metadata(&path).unwrap().file_type().is_socket());
}

#[test]
fn errors_name_the_path_and_the_trouble() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("absent.qt");
    let error = load::<QTable>(&path, "table/1").unwrap_err();
    assert_eq!(error.path, path);
    assert!(matches!(error.problem, Problem::Io(_)));
    assert!(error.to_string().contains("absent.qt"));
    let nowhere = Path::new("no-such-folder/at-all/policy.qt");
    assert!(matches!(
        save(nowhere, "k", &1u8).unwrap_err().problem,
        Problem::Io(_)
    ));

    save(&path, "table/1", &learned(2, 2)).unwrap();
    assert!(matches!(
        load::<QTable>(&path, "table/2").unwrap_err().problem,
        Problem::Kind { .. }
    ));
    assert!(matches!(
        encode(&"k".repeat(256), &1u8),
        Err(Problem::KindTooLong { length: 256 })
    ));
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
    assert_eq!(
        mode(&ours),
        0o640,
        "the permissions of a replaced file stay"
    );
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(load::<u8>(&ours, "k").unwrap(), 2);
}

#[test]
fn every_single_bit_flip_and_every_truncation_is_refused() {
    let bytes = encode("table/1", &learned(6, 5)).unwrap();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(decode::<QTable>("table/1", &damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert!(
            decode::<QTable>("table/1", &bytes[..length]).is_err(),
            "{length} bytes"
        );
    }
    let mut longer = bytes;
    longer.push(0);
    assert!(matches!(
        decode::<QTable>("table/1", &longer),
        Err(Problem::TrailingBytes { extra: 1 })
    ));
}

#[test]
fn random_bytes_are_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let sound = encode("table/1", &learned(3, 2)).unwrap();
    let mut bytes = Vec::new();
    for round in 0..100_000 {
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

/// The envelope of any payload, checksum included.
fn sealed(format: u32, kind: &str, claimed: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x89QTBL\r\n\x1a".to_vec();
    bytes.extend(format.to_le_bytes());
    bytes.extend((kind.len() as u32).to_le_bytes());
    bytes.extend(claimed.to_le_bytes());
    bytes.extend(kind.as_bytes());
    bytes.extend(payload);
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

#[test]
fn sound_envelopes_with_impossible_contents_are_refused() {
    let refused = |bytes: &[u8]| decode::<QTable>("k", bytes).unwrap_err();
    assert!(matches!(
        refused(&sealed(2, "k", 0, &[])),
        Problem::Newer { found: 2, .. }
    ));
    assert!(matches!(
        refused(&sealed(0, "k", 0, &[])),
        Problem::Older { found: 0, .. }
    ));
    assert!(matches!(
        refused(&sealed(1, "k", 1 << 44, &[0; 9])),
        Problem::Truncated { .. }
    ));
    assert!(matches!(
        refused(&sealed(1, "k", u64::MAX, &[])),
        Problem::Truncated { .. }
    ));

    // A vector that claims 2^63 entries: actions 2, then bincode's 64-bit length.
    let claim = [&[2u8, 253][..], &(1u64 << 63).to_le_bytes()].concat();
    assert!(matches!(
        refused(&sealed(1, "k", claim.len() as u64, &claim)),
        Problem::Contents(_)
    ));

    let table = |actions: u64, values: &[f64], visits: &[u32]| {
        let payload = bincode::serde::encode_to_vec(
            (actions, values, visits, None::<(u64, Vec<bool>)>),
            bincode::config::standard(),
        )
        .unwrap();
        decode::<QTable>("k", &sealed(1, "k", payload.len() as u64, &payload))
    };
    assert_eq!(
        table(2, &[0.0, 1.0], &[3, 4])
            .unwrap()
            .visits(State(0), Action(1)),
        4
    );
    for (actions, values, visits) in [
        (2, &[0.0, f64::NAN][..], &[0, 0][..]),
        (2, &[0.0, f64::INFINITY], &[0, 0]),
        (2, &[0.0, 1.0, 2.0], &[0, 0, 0]),
        (2, &[0.0, 1.0], &[0]),
        (0, &[], &[]),
        (2, &[], &[]),
    ] {
        assert!(
            matches!(table(actions, values, visits), Err(Problem::Contents(_))),
            "{actions} {values:?}"
        );
    }

    let trailing = [encode("k", &7u8).unwrap()[25..26].to_vec(), vec![0]].concat();
    let bytes = sealed(1, "k", 2, &trailing);
    assert!(matches!(
        decode::<u8>("k", &bytes),
        Err(Problem::TrailingBytes { extra: 1 })
    ));
}

#[test]
fn the_bytes_of_version_1_stay() {
    let mut table = QTable::new(2, 2).unwrap();
    table.set(State(1), Action(0), 1.5).unwrap();
    table.visit(State(1), Action(0)).unwrap();
    let bytes = encode("table/1", &table).unwrap();
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hex, GOLDEN);
    assert_eq!(decode::<QTable>("table/1", &bytes).unwrap(), table);
}

const GOLDEN: &str = concat!(
    "895154424c0d0a1a010000000700000028000000000000007461626c652f3102040000000000",
    "0000000000000000000000000000000000f83f0000000000000000040000010000e65c7633"
);

/// A run of every part that a file may hold: a table with visits, a learner with its clock, a
/// policy, an episode on its way with the next action chosen, and a learning curve.
#[test]
fn the_bytes_of_a_run_stay() {
    let mut chain = toys::chain(3).unwrap();
    let learner = Sarsa::new(Schedule::linear(0.5, 0.25, 8).unwrap(), 0.5).unwrap();
    let policy = EpsilonGreedy::new(Schedule::constant(0.75).unwrap()).unwrap();
    let mut training = Training::new(&chain, QTable::new(3, 2).unwrap(), learner, policy)
        .unwrap()
        .with_episode_limit(60)
        .unwrap()
        .with_record_every(10)
        .unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    training
        .run(&mut chain, Until::Actions(23), &mut rng)
        .unwrap();
    assert!(training.is_in_episode() && training.episodes() > 0 && training.curve().len() == 2);
    let bytes = encode("run/1", &(&training, &chain, &rng)).unwrap();
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hex, GOLDEN_RUN);
    type Run = (
        Training<Sarsa, EpsilonGreedy>,
        ModelEnvironment,
        Xoshiro256PlusPlus,
    );
    let back: Run = decode("run/1", &bytes).unwrap();
    assert_eq!(back, (training, chain, rng));
}

const GOLDEN_RUN: &str = concat!(
    "895154424c0d0a1a01000000050000007b0100000000000072756e2f31020600000000000068",
    "3f000000000000923f000000000000383f000000000000dc3f00000000000000000000000000",
    "000000060907050200000001000000000000e03f000000000000d03f08000000000000e03f17",
    "00000000000000e83f00183c0a17020100010005000000000000000003000000000000000000",
    "00000000c0a23f0000000000000000000000020a000001000000000000000000000100000000",
    "00000000140201000000000000f03f019a9999999999c93f01000000000000f03f0100000000",
    "0000224001666666666666c83f0302070001020304050606000000000000f03f000000000000",
    "00000000000000000000f03f01000000000000000000000000000000f03f0000000000000000",
    "0000000000000000f03f02000000000000f03f01000000000000f03f02000000000000000001",
    "000000000000f03f020000000000000000010100000000000000f03f0000fddbde4b0d2582a9",
    "a4fdcce845d36ef5cd21fdbf39103848181448fd3c7086bbb71375ff2b64173e"
);

#[test]
fn what_is_wide_in_memory_and_short_on_disk_comes_back() {
    // One byte each in the file, 16 in memory.
    let wide = vec![0u128; (1 << 16) - 8];
    assert_eq!(
        decode::<Vec<u128>>("k", &encode("k", &wide).unwrap()).unwrap(),
        wide
    );
    let longer = vec![7u128; 1 << 17];
    assert_eq!(
        decode::<Vec<u128>>("k", &encode("k", &longer).unwrap()).unwrap(),
        longer
    );
}

#[test]
fn no_room_is_made_for_a_text_that_is_not_there() {
    for claimed in [1u64 << 25, 1 << 32, 1 << 44, u64::MAX] {
        let payload = [&[253u8][..], &claimed.to_le_bytes()].concat();
        match decode::<String>("k", &sealed(1, "k", payload.len() as u64, &payload)) {
            Err(Problem::Contents(why)) => {
                assert!(why.contains("LimitExceeded"), "{claimed}: {why}")
            }
            other => panic!("{claimed}: {other:?}"),
        }
    }
}
