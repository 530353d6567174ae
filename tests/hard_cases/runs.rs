//! Whole runs: stopped, without a place to write to, on any number of threads.

use std::fs;

use assert_cmd::Command;
use springfit::clock::Progress;
use springfit::error::Error;
use springfit::export::write;
use springfit::study;

use super::common::{CUBE, parse};

#[test]
fn interruption() {
    // a run that is asked to stop stops at the next point where it can
    let scene = parse(CUBE).expect("a scene");
    let progress = Progress::default();
    progress.cancel();
    assert_eq!(study::run(&scene, &progress).err(), Some(Error::Interrupted));
    assert_eq!(Error::Interrupted.exit_status(), 130);
    // a file is replaced as a whole: what was there stays when the new one cannot be written
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("result.json");
    write::whole(&file, b"old").expect("a file");
    assert!(write::whole(&file.join("below"), b"new").is_err());
    assert_eq!(fs::read(&file).expect("still there"), b"old");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing is left beside it");
    // an output folder that is a file: named, exit status 2, and it stays as it was
    let path = folder.path().join("hard.toml");
    fs::write(&path, CUBE).expect("a file");
    let output = Command::cargo_bin("springfit").expect("built").arg("run").arg(&path).arg("--out").arg(&file).output();
    let output = output.expect("it ends");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("result.json") && message.contains("choose a folder that can be written to"), "{message}");
    assert_eq!(fs::read(&file).expect("still there"), b"old");
}

#[test]
fn threads() {
    let scene = parse(CUBE).expect("a scene");
    let numbers = |threads: usize| -> Vec<u64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let study = pool.install(|| study::run(&scene, &Progress::default())).expect("it runs");
        let found = &study.calibration;
        let all = found.phi.iter().chain(&found.stiffness).chain(found.displacements.iter().flatten());
        let reference = study.reference.cases.iter().flat_map(|case| &case.displacement);
        all.chain(reference)
            .chain([&found.fitted.e_rms, &found.accuracy.unwrap().forward_error])
            .map(|x| x.to_bits())
            .collect()
    };
    let alone = numbers(1);
    for threads in [1, 2, 3, 4, 8, 16] {
        assert_eq!(numbers(threads), alone, "{threads} threads");
    }
}
