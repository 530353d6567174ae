//! Runs that end early lose nothing: killed at any moment, stopped by a signal, out of room.
//!
//! "The same" is: springs.json and the fields byte for byte, result.json up to seconds, memory and number of threads.
//! `SPRINGFIT_KILLS=200 cargo test --release --test interruption kills -- --nocapture` is the study with more kills; seed and
//! number of kills are printed.
#![cfg(unix)]

mod stripped;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use springfit::clock::Progress;
use springfit::rng::Stream;
use springfit::scene::{self, Scene};
use springfit::study::checkpoint::{Checkpoint, Finished, NAME, digest};
use springfit::study::{self, Study};
use stripped::strip;

const SEED: u64 = 20_242;
const KILLS: usize = 6;

/// A sweep over five groupings with two starts each.
const SWEEP: [&str; 2] = ["calibration.gamma={ start = 0.5, step = 0.1 }", "calibration.starts=2"];

/// One problem with a thousand starts on the torus: minutes, of which the first start takes less than a second.
const LONG: [&str; 2] = ["calibration.gamma=0.1", "calibration.starts=1000"];

fn path_of(scene: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(scene)
}

/// `springfit run` of a scene into a folder.
fn call(scene: &str, folder: &Path, sets: &[&str], more: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("springfit"));
    command.arg("run").arg(path_of(scene)).arg("--out").arg(folder).args(more);
    command.args(sets.iter().flat_map(|set| ["--set", set]));
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn succeeds(mut command: Command) {
    let output = command.output().expect("the binary is built");
    assert!(output.status.success(), "{}", message(&output));
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The files of a folder by their names, result.json without what may differ. Each is whole.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable")) {
        let name = entry.file_name().into_string().expect("UTF-8");
        if name.ends_with(".partial") {
            continue;
        }
        let mut bytes = fs::read(entry.path()).expect("readable");
        if name.ends_with(".json") {
            let mut value: Value = serde_json::from_slice(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
            if name == "result.json" {
                strip(&mut value);
                bytes = value.to_string().into_bytes();
            }
        } else {
            assert!(bytes.ends_with(b"</VTKFile>\n"), "{name} is whole");
        }
        files.insert(name, bytes);
    }
    files
}

fn assert_same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, bytes) in found {
        assert!(*bytes == expected[name], "{name} differs");
    }
}

/// What an unbroken run of the sweep writes, and how long it takes.
fn unbroken(scene: &str, sets: &[&str]) -> (BTreeMap<String, Vec<u8>>, Duration) {
    let folder = tempfile::tempdir().expect("a folder");
    let start = Instant::now();
    succeeds(call(scene, folder.path(), sets, &["--quiet"]));
    (results(folder.path()), start.elapsed())
}

/// Kills a process after some time; true when it was still running.
fn kill_after(mut child: Child, time: Duration) -> bool {
    std::thread::sleep(time);
    let running = child.try_wait().expect("our child").is_none();
    child.kill().expect("our child");
    child.wait().expect("our child");
    running
}

#[test]
fn kills_at_any_moment_lose_nothing() {
    let kills = std::env::var("SPRINGFIT_KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(KILLS);
    let (expected, mut whole) = unbroken("spheroid.toml", &SWEEP);
    let mut stream = Stream::new(SEED, 0, 0);
    let (mut killed, mut resumed_with, mut runs) = (0, 0, 0);
    while killed < kills {
        runs += 1;
        let folder = tempfile::tempdir().expect("a folder");
        let mut more = vec!["--quiet"];
        loop {
            let child = call("spheroid.toml", folder.path(), &SWEEP, &more).spawn().expect("the binary is built");
            more = vec!["--quiet", "--resume"];
            let moment = whole.mul_f64(stream.uniform());
            let running = kill_after(child, moment);
            killed += usize::from(running);
            // the first run had to share the machine, or was slow for another reason
            whole = if running { whole } else { moment };
            // every file that can be seen is whole, and one that is of the results is the right one
            let files = results(folder.path());
            resumed_with += usize::from(files.contains_key(NAME));
            for (name, bytes) in files.iter().filter(|(name, _)| *name != NAME) {
                assert!(*bytes == expected[name], "{name} after a kill");
            }
            if !running || stream.uniform() < 0.5 {
                break;
            }
        }
        succeeds(call("spheroid.toml", folder.path(), &SWEEP, &more));
        assert_same(&results(folder.path()), &expected);
        let names = fs::read_dir(folder.path()).expect("readable").count();
        assert_eq!(names, expected.len(), "nothing is left behind");
    }
    println!("{killed} kills of seed {SEED} in {runs} runs, {resumed_with} of them with a checkpoint: all the same");
}

/// A scene with few and small problems, and its sets.
fn small() -> Scene {
    scene::read(&path_of("circle.toml"), &[SWEEP[1].to_owned()]).expect("a good scene").scene
}

fn document(study: &Study) -> Value {
    let text = springfit::report::result::Document::of(study).to_json();
    let mut value = serde_json::from_str(&text).expect("JSON");
    strip(&mut value);
    value
}

/// Changes the content of a checkpoint and puts the digest right.
fn rewrite(folder: &Path, change: impl FnOnce(&mut Value)) {
    let path = folder.join(NAME);
    let mut file: Value = serde_json::from_slice(&fs::read(&path).expect("a checkpoint")).expect("JSON");
    change(&mut file["content"]);
    file["digest"] = format!("{:016x}", digest(file["content"].to_string().bytes())).into();
    fs::write(&path, file.to_string()).expect("writable");
}

/// Runs a scene with the checkpoint that is in a folder.
fn run_from(folder: &Path, scene: &Scene) -> (Finished, Study) {
    let checkpoint = Checkpoint::resume(folder, scene).expect("a checkpoint of this scene");
    let before = checkpoint.finished();
    let study = study::run_keeping(scene, &Progress::default(), &checkpoint).expect("a study");
    checkpoint.flush().expect("room");
    (before, study)
}

#[test]
fn a_checkpoint_gives_back_every_bit_and_is_what_the_run_goes_on_from() {
    let (folder, scene) = (tempfile::tempdir().expect("a folder"), small());
    let (before, first) = run_from(folder.path(), &scene);
    assert_eq!((before.answers, before.problems), (0, 0));
    let expected = document(&first);
    let (before, again) = run_from(folder.path(), &scene);
    let distinct = (0..first.calibration.sweep.len()).filter(|&i| first.calibration.sweep[i].solved_by == i).count();
    assert_eq!((before.answers, before.problems, before.others), (distinct, distinct, 0));
    assert_eq!(document(&again), expected);

    rewrite(folder.path(), |content| content["sweeps"][0]["pieces"].as_array_mut().expect("pieces").truncate(2));
    let (before, again) = run_from(folder.path(), &scene);
    assert_eq!((before.answers, before.problems), (2, distinct));
    assert_eq!(document(&again), expected);

    // an answer that nobody would find shows that it was not searched again
    rewrite(folder.path(), |content| content["sweeps"][0]["pieces"][1][1]["counts"]["evaluations"] = 123_456.into());
    let (_, again) = run_from(folder.path(), &scene);
    assert!(again.calibration.sweep.iter().any(|row| row.outcome.counts.evaluations == 123_456));
}

#[test]
fn a_ladder_goes_on_from_its_last_rung() {
    let sets = ["springs.grouping=\"adaptive\"", "springs.groups=9"];
    let scene = scene::read(&path_of("circle.toml"), &sets.map(String::from)).expect("a good scene").scene;
    let folder = tempfile::tempdir().expect("a folder");
    let (before, first) = run_from(folder.path(), &scene);
    assert_eq!(before.rungs, 0);
    let (before, again) = run_from(folder.path(), &scene);
    assert_eq!((before.rungs, document(&again)), (first.calibration.ladder.len(), document(&first)));
    // work that nobody did shows that the first rung was not climbed again
    let evaluations = |study: &Study| study.calibration.ladder[0].counts.evaluations;
    rewrite(folder.path(), |content| {
        content["ladder"]["standing"]["rungs"][0]["counts"]["evaluations"] = 123_456.into();
    });
    assert_eq!(evaluations(&run_from(folder.path(), &scene).1), 123_456);
    // groups that are not those of the springs are no rung of this ladder
    rewrite(folder.path(), |content| content["ladder"]["standing"]["last"]["parts"][0]["springs"][0] = 77_777.into());
    assert_eq!(document(&run_from(folder.path(), &scene).1), document(&first));
}

/// The walk of a budget over three resolutions.
#[test]
fn the_walk_of_a_budget_goes_on_from_the_last_resolution_and_decides_as_before() {
    let sets = ["budget.finest=[5, 5, 5]", "budget.max_error=0.5", "budget.step_time=60.0", "springs.groups=6"];
    let scene = scene::read(&path_of("budget.toml"), &sets.map(String::from)).expect("a good scene").scene;
    let folder = tempfile::tempdir().expect("a folder");
    let networks = |study: &Study| {
        let points = &study.budget.as_ref().expect("a budget").front.points;
        points
            .iter()
            .map(|point| (point.control_points.clone(), point.groups, point.error.to_bits()))
            .collect::<Vec<_>>()
    };
    let (before, first) = run_from(folder.path(), &scene);
    assert_eq!(before.resolutions, 0);
    let resolutions = 3;
    let (before, again) = run_from(folder.path(), &scene);
    assert_eq!((before.resolutions, networks(&again)), (resolutions, networks(&first)));
    assert_eq!(again.calibration.phi, first.calibration.phi);

    // a step time that nobody would measure shows that the resolution was not run again
    rewrite(folder.path(), |content| {
        let walked = content["walked"].as_array_mut().expect("resolutions");
        walked.truncate(1);
        walked[0][0]["step_seconds"] = 59.0.into();
        content["ladder"] = Value::Null;
        content["sweeps"] = serde_json::json!([]);
    });
    let (before, again) = run_from(folder.path(), &scene);
    assert_eq!((before.resolutions, networks(&again)), (1, networks(&first)));
    assert_eq!(again.budget.expect("a budget").front.points[0].step_seconds, 59.0);
    assert_eq!(again.calibration.phi, first.calibration.phi);
}

#[test]
fn a_checkpoint_of_another_run_is_refused_by_name() {
    let (folder, scene) = (tempfile::tempdir().expect("a folder"), small());
    let expected = document(&run_from(folder.path(), &scene).1);
    let path = folder.path().join(NAME);
    let good = fs::read(&path).expect("a checkpoint");
    let refusal = |scene: &Scene| {
        let resumed = Checkpoint::resume(folder.path(), scene);
        let outcome =
            resumed.and_then(|checkpoint| study::run_keeping(scene, &Progress::default(), &checkpoint).map(drop));
        let error = outcome.expect_err("it is another run's");
        assert!(error.exit_status() == 2 && error.help().is_some_and(|help| help.contains("without --resume")));
        error.to_string()
    };
    let expect = |found: String, expected: &str| assert!(found.contains(expected), "{found}");

    let mut other = scene.clone();
    other.calibration.seed = 7;
    expect(refusal(&other), "checkpoint.json: cannot be resumed: was made with the seed 1, this run has 7");
    let mut other = scene.clone();
    other.calibration.starts = Some(3);
    expect(refusal(&other), "was made with calibration.starts = 2, this run has 3");
    let mut other = scene.clone();
    other.load[0].fit = !other.load[0].fit;
    expect(refusal(&other), "was made with load[0].fit = true, this run has false");
    let mut other = scene.clone();
    other.solver.tolerance = 1e-11;
    expect(refusal(&other), "was made with solver.tolerance = 1e-10, this run has 1e-11");

    /// Words of the refusal, and what is done to the file.
    type Change = (&'static str, fn(&mut Value));
    let changes: [Change; 4] = [
        ("was made by version 0.0.1, this is", |content| content["version"] = "0.0.1".into()),
        ("comes from other numbers", |content| content["sweeps"][0]["inputs"] = "00".into()),
        ("has pieces of problems", |content| content["sweeps"][0]["pieces"][0][0]["problem"] = 77.into()),
        ("is damaged: unknown field `more`", |content| content["more"] = 1.into()),
    ];
    for (expected, change) in changes {
        rewrite(folder.path(), change);
        expect(refusal(&scene), expected);
        fs::write(&path, &good).expect("writable");
    }
    // a file that is made anew; some systems wait for the disk when one is overwritten
    let write = |bytes: &[u8]| {
        fs::remove_file(&path).expect("a file");
        fs::write(&path, bytes).expect("writable");
    };
    for at in (0..good.len()).step_by(3) {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        write(&bad);
        match Checkpoint::resume(folder.path(), &scene) {
            Err(error) => expect(error.to_string(), "cannot be resumed"),
            // another digit far behind the point can be the same number
            Ok(_) => assert_eq!(document(&run_from(folder.path(), &scene).1), expected, "byte {at}"),
        }
    }
    for end in (0..good.len() - 1).step_by(3) {
        write(&good[..end]);
        expect(refusal(&scene), "cannot be resumed");
    }
}

#[test]
fn a_checkpoint_of_a_scene_whose_files_have_changed_is_refused() {
    let (folder, mut scene) = (tempfile::tempdir().expect("a folder"), small());
    let edges = folder.path().join("edges.txt");
    fs::write(&edges, "0 14\n").expect("writable");
    scene.springs.edge_file = Some(edges.clone());
    run_from(folder.path(), &scene);
    run_from(folder.path(), &scene);
    fs::write(&edges, "0 15\n").expect("writable");
    let Err(error) = Checkpoint::resume(folder.path(), &scene) else { panic!("another spring is another run") };
    assert!(error.to_string().contains("edges.txt has changed"), "{error}");
}

/// Waits until a run has kept something, and sends it a signal.
fn signalled(mut child: Child, folder: &Path, signal: &str) -> Output {
    wait_for_checkpoint(&mut child, folder);
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill is there");
    assert!(sent.success());
    child.wait_with_output().expect("it ends")
}

/// Waits until a run has kept something.
fn wait_for_checkpoint(child: &mut Child, folder: &Path) {
    let begin = Instant::now();
    while !folder.join(NAME).exists() {
        assert!(begin.elapsed() < Duration::from_secs(120), "nothing was kept");
        assert!(child.try_wait().expect("our child").is_none(), "it ended before");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_signal_ends_a_run_in_order_with_what_is_finished() {
    for signal in ["-INT", "-TERM"] {
        let folder = tempfile::tempdir().expect("a folder");
        let child = call("torus.toml", folder.path(), &LONG, &[]).spawn().expect("the binary is built");
        let output = signalled(child, folder.path(), signal);
        assert_eq!(output.status.code(), Some(130), "{}", message(&output));
        let message = message(&output);
        assert!(message.contains("finished: 0 of 1 problems; "), "{message}");
        assert!(message.contains("--resume goes on from") && message.ends_with("interrupted\n"), "{message}");
        assert_eq!(results(folder.path()).keys().collect::<Vec<_>>(), [NAME]);
        let scene = scene::read(&path_of("torus.toml"), &LONG.map(String::from)).expect("a good scene").scene;
        let checkpoint = Checkpoint::resume(folder.path(), &scene).expect("whole");
        assert!(checkpoint.finished().others > 0);
    }
}

/// Runs where files may not grow beyond so many blocks of 512 bytes, as on a disk that is full.
fn without_room(command: &Command, blocks: usize) -> Output {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"]);
    shell.arg(command.get_program()).args(command.get_args());
    shell.stdout(Stdio::null()).stderr(Stdio::piped()).output().expect("a shell")
}

#[test]
fn a_full_disk_is_named_and_loses_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let (expected, _) = unbroken("circle.toml", &SWEEP);
    // results of an earlier run with another seed, and a checkpoint that does not fit
    succeeds(call("circle.toml", folder.path(), &SWEEP, &["--quiet", "--seed", "9"]));
    let earlier = results(folder.path());
    let output = without_room(&call("circle.toml", folder.path(), &SWEEP, &[]), 0);
    assert_eq!(output.status.code(), Some(2));
    let text = message(&output);
    assert!(text.contains("checkpoint.json: cannot be written") && text.contains("with --resume"), "{text}");
    assert_same(&results(folder.path()), &earlier);

    // a checkpoint that fits, and results that do not
    let largest = expected.values().map(Vec::len).max().expect("files") / 512;
    let output = without_room(&call("circle.toml", folder.path(), &SWEEP, &[]), largest - 1);
    assert_eq!(output.status.code(), Some(2));
    let text = message(&output);
    assert!(text.contains("cannot be written") && text.contains("--resume goes on from"), "{text}");
    assert!(!text.contains(".partial"), "{text}");
    let mut kept = results(folder.path());
    assert!(kept.remove(NAME).is_some(), "what was finished is kept");
    assert_same(&kept, &earlier);
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), earlier.len() + 1);

    succeeds(call("circle.toml", folder.path(), &SWEEP, &["--quiet", "--resume"]));
    assert_same(&results(folder.path()), &expected);
}

/// A disk that fills up under a run and is then made larger, in a name space of its own; nothing is tested where a system
/// does not allow one.
#[test]
fn a_small_disk_fills_up_and_the_run_goes_on_when_there_is_room() {
    const SCRIPT: &str = "disk=$1 full=$2 roomy=$3; shift 3
        mount -t tmpfs -o size=32k none \"$disk\" || exit 77
        \"$@\"; status=$?
        cp -r \"$disk\"/. \"$full\"
        mount -o remount,size=64m \"$disk\"
        \"$@\" --resume || exit 70
        cp -r \"$disk\"/. \"$roomy\"
        exit $status";
    let (expected, _) = unbroken("circle.toml", &SWEEP);
    let [disk, full, roomy] = [(); 3].map(|()| tempfile::tempdir().expect("a folder"));
    let run = call("circle.toml", disk.path(), &SWEEP, &[]);
    let mut shell = Command::new("unshare");
    shell.args(["--map-root-user", "--mount", "sh", "-c", SCRIPT, "sh"]);
    shell.args([disk.path(), full.path(), roomy.path()]).arg(run.get_program()).args(run.get_args());
    let Ok(output) = shell.stdout(Stdio::null()).output() else { return };
    let text = message(&output);
    if output.status.code() == Some(77) || text.starts_with("unshare:") {
        return;
    }
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("No space left on device") && text.contains("--resume goes on from"), "{text}");
    assert_eq!(results(full.path()).keys().collect::<Vec<_>>(), [NAME]);
    assert_same(&results(roomy.path()), &expected);
}

#[test]
fn standard_output_without_room_is_named() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else { return };
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("springfit"));
    command.arg("run").arg(path_of("circle.toml")).args(["--json", "--quiet"]).stdout(full);
    let output = command.stderr(Stdio::piped()).output().expect("the binary is built");
    assert_eq!(output.status.code(), Some(2));
    assert!(message(&output).contains("standard output: cannot be written"), "{}", message(&output));
}

#[test]
fn one_run_at_a_time_writes_into_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut first = call("torus.toml", folder.path(), &LONG, &["--quiet"]).spawn().expect("the binary is built");
    wait_for_checkpoint(&mut first, folder.path());
    let second = call("circle.toml", folder.path(), &SWEEP, &["--quiet"]).output().expect("the binary is built");
    assert!(kill_after(first, Duration::ZERO));
    assert_eq!(second.status.code(), Some(2));
    assert!(message(&second).contains("another run writes into this folder"), "{}", message(&second));
    // the lock went with its owner
    succeeds(call("circle.toml", folder.path(), &SWEEP, &["--quiet"]));
}

#[test]
fn resume_needs_a_folder() {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("springfit"));
    let output = command.arg("run").arg(path_of("circle.toml")).arg("--resume").output().expect("the binary is built");
    assert_eq!(output.status.code(), Some(2));
    assert!(message(&output).contains("--out"), "{}", message(&output));
}
