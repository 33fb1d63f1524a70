//! A sweep of `compare_controllers` in parts.

use std::fs;
use std::path::Path;

use crate::command_line::{example, output};

/// Runs a small sweep with more arguments. Returns its error output, or `None` if the example is
/// missing.
fn sweep(out: &Path, arguments: &[&str]) -> Option<String> {
    let mut compare = example("compare_controllers")?;
    compare
        .args([
            "--draws",
            "3",
            "--starts",
            "2",
            "--levels",
            "moderate,heavy",
        ])
        .args(["--only", "gain-scheduled", "--out"])
        .arg(out)
        .args(arguments);
    Some(output(&mut compare).1)
}

fn merged(out: &Path, parts: &[&Path]) -> Option<String> {
    let mut compare = example("compare_controllers")?;
    compare.arg("--out").arg(out).arg("--merge").args(parts);
    Some(output(&mut compare).1)
}

#[test]
fn a_sweep_in_shards_merges_to_the_bytes_of_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let Some(errors) = sweep(&at("whole"), &[]) else {
        return;
    };
    assert_eq!(errors, "");
    let parts = [at("1"), at("2")];
    sweep(&parts[0], &["--shard", "1/2"]);
    sweep(&parts[1], &["--shard", "2/2"]);

    // A shard that was killed lacks cells; it is named, and made good.
    let cells = |part: &Path| {
        let files = fs::read_dir(part.join("cells")).expect("finished cells");
        let mut files: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
        files.sort();
        files
    };
    let lost = cells(&parts[1]).remove(0);
    fs::remove_file(&lost).expect("it was there");
    let parts = [parts[0].as_path(), &parts[1]];
    let errors = merged(&at("merged"), &parts).expect("built");
    assert!(errors.contains("1 of 6 cells are missing"), "{errors}");
    let kept = cells(parts[1]);
    let written = |file: &Path| fs::metadata(file).and_then(|file| file.modified()).ok();
    let before = written(&kept[0]);
    sweep(parts[1], &["--shard", "2/2", "--resume"]);
    assert!(lost.exists() && written(&kept[0]) == before);

    assert_eq!(merged(&at("merged"), &parts).as_deref(), Some(""));
    for name in [
        "runs.csv",
        "comparison.csv",
        "comparison.svg",
        "settings.json",
    ] {
        let read = |folder: &str| fs::read(at(folder).join(name)).expect("a result");
        assert_eq!(read("whole"), read("merged"), "{name}");
    }
}

#[test]
fn shards_of_other_settings_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    if sweep(&at("1"), &["--shard", "1/2"]).is_none() {
        return;
    }
    let errors = sweep(&at("1"), &["--resume", "--seed", "3"]).expect("built");
    assert!(errors.contains("`seed` differs"), "{errors}");
    sweep(&at("2"), &["--shard", "2/2", "--grip"]);
    let errors = merged(&at("out"), &[&at("1"), &at("2")]).expect("built");
    assert!(errors.contains("`grip` differs"), "{errors}");
    let errors = merged(&at("1"), &[&at("1")]).expect("built");
    assert!(errors.contains("cannot be the --out folder"), "{errors}");
    let errors = merged(&at("out"), &[folder.path()]).expect("built");
    assert!(errors.contains("settings.json"), "{errors}");
    fs::write(at("1").join("settings.json"), "{").expect("writable");
    let errors = merged(&at("out"), &[&at("1")]).expect("built");
    assert!(errors.contains("settings.json: damaged: EOF"), "{errors}");
    for wrong in ["0/2", "3/2", "2", "a/b", "1/0"] {
        let errors = sweep(&at("3"), &["--shard", wrong]).expect("built");
        assert!(errors.contains("I/N"), "{wrong}: {errors}");
    }
}

#[test]
fn cells_of_another_arm_are_compared() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(mut compare) = example("compare_controllers") else {
        return;
    };
    compare.args([
        "--arm", "so101", "--draws", "1", "--starts", "2", "--moves", "60",
    ]);
    compare.args(["--levels", "none", "--only", "i", "--out"]);
    let (output, errors) = output(compare.arg(folder.path()));
    assert_eq!(errors, "");
    let rows = String::from_utf8_lossy(&output.stdout);
    // The learned tables and the fuzzy rules are a PUMA's.
    assert!(
        rows.contains("hybrid ") && rows.contains("position-based"),
        "{rows}"
    );
    assert!(!rows.contains("Q 90") && !rows.contains("fuzzy"), "{rows}");
    let errors = sweep(folder.path(), &["--arm", "ur5", "--full-chain"]).expect("built");
    assert!(errors.contains("drives a PUMA"), "{errors}");
}
