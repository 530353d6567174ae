//! Whole small scenes: a run ends with results that are numbers, or with an error of the right kind.
//!
//! Scenes of data/scenes are damaged at random, more gently than files: keys get other values, lines change their places
//! and their scenes. What would be a large body or a long search is left out or shortened.

use std::cell::Cell;
use std::path::{Path, PathBuf};

use springfit::clock::Progress;
use springfit::error::Error;
use springfit::rng::Stream;
use springfit::scene::{self, Gamma, Scene};
use springfit::study::{self, Study};

use super::memory::measured;
use super::{SEED, cases, scenes, thread_seconds};

/// Control points of the largest body, and steps of the longest motion.
const MOST_NODES: usize = 200;
const MOST_STEPS: f64 = 200.0;

/// Seconds of the processor for one small scene.
const LONGEST: f64 = 10.0;

/// Numbers for any key.
const NUMBERS: &[&str] = &[
    "0",
    "1",
    "2",
    "3",
    "4",
    "-1",
    "0.5",
    "-0.0",
    "0.3",
    "0.4999999",
    "-0.99",
    "1e-9",
    "1e-300",
    "1e-160",
    "1e300",
    "1e160",
    "1e9",
    "5e-324",
    "1e15",
];

/// The lines of all scenes, for a change of places.
fn lines(corpus: &[(PathBuf, Vec<u8>)]) -> Vec<String> {
    let texts = corpus.iter().map(|(_, bytes)| String::from_utf8_lossy(bytes));
    texts.flat_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>()).filter(|line| !line.is_empty()).collect()
}

/// Another scene, near a given one.
fn changed(text: &str, all: &[String], stream: &mut Stream) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..1 + stream.below(4) {
        if lines.is_empty() {
            break;
        }
        let at = stream.below(lines.len());
        match stream.below(6) {
            // the same key with the value of another scene
            0 | 1 => {
                let key = lines[at].split('=').next().unwrap_or_default().trim().to_owned();
                let same =
                    |line: &&String| line.split('=').next().unwrap_or_default().trim() == key && line.contains('=');
                let others: Vec<&String> = all.iter().filter(same).collect();
                if !others.is_empty() {
                    lines[at] = others[stream.below(others.len())].clone();
                }
            }
            2 | 3 => replace_number(&mut lines[at], NUMBERS[stream.below(NUMBERS.len())], stream),
            4 => drop(lines.remove(at)),
            _ => lines.insert(at, all[stream.below(all.len())].clone()),
        }
    }
    lines.join("\n") + "\n"
}

/// Puts another number in the place of one in the value of a line.
fn replace_number(line: &mut String, number: &str, stream: &mut Stream) {
    let Some(start) = line.find('=') else { return };
    let is_part = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let mut places = Vec::new();
    let mut begin = None;
    for (at, c) in line.char_indices().skip_while(|(at, _)| *at <= start).chain([(line.len(), ' ')]) {
        match begin {
            None if c.is_ascii_digit() || c == '-' => begin = Some(at),
            Some(first) if !is_part(c) => {
                places.push(first..at);
                begin = None;
            }
            _ => {}
        }
    }
    if !places.is_empty() {
        let place = places[stream.below(places.len())].clone();
        line.replace_range(place, number);
    }
}

/// Makes a scene short, or says that it cannot be.
fn shortened(mut scene: Scene, folder: &Path) -> Option<Scene> {
    // a budget runs a scene many times
    scene.budget = None;
    let calibration = &mut scene.calibration;
    calibration.starts = Some(calibration.starts.unwrap_or(2).min(2));
    calibration.annealing.evaluations = calibration.annealing.evaluations.min(20);
    calibration.annealing.chains = calibration.annealing.chains.min(2);
    calibration.gauss_newton.refactorisations = calibration.gauss_newton.refactorisations.min(4);
    calibration.gauss_newton.polish = calibration.gauss_newton.polish.min(2);
    if let Ok(values) = calibration.gamma.values() {
        calibration.gamma = Gamma::Fixed(*values.last()?);
    }
    let nodes = scene.geometry.control_points.iter().flatten().fold(1_usize, |product, &n| product.saturating_mul(n));
    if nodes > MOST_NODES {
        let dimension = scene.geometry.control_points.as_ref().map_or(0, Vec::len);
        scene.geometry.control_points = Some(if dimension == 3 { vec![4; 3] } else { vec![5; dimension] });
    }
    if let Some(dynamics) = &mut scene.dynamics {
        // a motion whose number of steps is not known before stays at rest
        dynamics.duration = None;
        dynamics.load_until = None;
        dynamics.steps = dynamics.steps.map(|steps| steps.min(MOST_STEPS as u64));
        dynamics.frames = dynamics.frames.min(10);
    }
    let files = scene.load.iter_mut().filter_map(|load| load.file.as_mut());
    scene.geometry.file.iter_mut().chain(files).for_each(|file| *file = folder.join(&file));
    Some(scene)
}

/// Every number of a result is one.
fn assert_numbers(study: &Study, text: &str) {
    let found = &study.calibration;
    assert!(found.stiffness.iter().chain(&found.phi).all(|k| k.is_finite() && *k >= 0.0), "{:?}\n{text}", found.phi);
    assert!(found.displacements.iter().flatten().all(|u| u.is_finite()));
    assert!(found.fitted.e_rms.is_finite() && found.fitted.e_max.is_finite(), "{:?}\n{text}", found.fitted);
}

#[test]
fn whole_scenes_changed_at_random() {
    let mut corpus = scenes::corpus();
    corpus.retain(|(path, _)| !path.parent().is_some_and(|folder| folder.ends_with("bad")));
    let all = lines(&corpus);
    let cases = cases() / 10;
    let mut stream = Stream::new(SEED, 0, 0);
    let figures = Cell::new((0_u32, 0_u32, 0_usize, 0.0_f64));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    // what every thread keeps for its products of matrices is none of a scene
    let first = scenes::read(&corpus.iter().find(|(path, _)| path.ends_with("square.toml")).expect("a scene").1);
    pool.install(|| study::run(&first.expect("a good scene"), &Progress::default())).expect("a study");
    for case in 0..cases {
        let (path, bytes) = &corpus[stream.below(corpus.len())];
        let text = changed(&String::from_utf8_lossy(bytes), &all, &mut stream);
        let Some(scene) = scenes::read(text.as_bytes()).ok() else { continue };
        let folder = path.parent().expect("a folder").to_owned();
        let Some(scene) = shortened(scene, &folder) else { continue };
        let once = || {
            let start = thread_seconds();
            let (result, memory) = measured(|| study::run(&scene, &Progress::default()));
            (result, memory, thread_seconds() - start)
        };
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| pool.install(once)));
        let Ok((result, memory, seconds)) = outcome else { panic!("case {case} of seed {SEED}:\n{text}") };
        assert!(seconds < LONGEST && memory < 256 << 20, "{seconds} s, {memory} bytes, case {case}:\n{text}");
        let (runs, good, most, longest) = figures.get();
        figures.set((runs + 1, good + u32::from(result.is_ok()), most.max(memory), longest.max(seconds)));
        match result {
            Ok(study) => assert_numbers(&study, &text),
            Err(error) => {
                assert!(
                    [2, 3].contains(&error.exit_status()) && error.help().is_some(),
                    "{error}, case {case}:\n{text}"
                );
                assert!(!matches!(error, Error::Interrupted));
            }
        }
    }
    let (runs, good, most, longest) = figures.get();
    println!(
        "whole scenes: {cases} cases of seed {SEED}, {runs} could be read, {good} ended with a result, at most {most} bytes, at most {longest:.3} s"
    );
    assert!(good > 0, "some changes are harmless");
}

/// Found with 10,000 cases: forces so small that the continuum does not move as far as numbers can tell.
#[test]
fn a_load_too_small_to_move_anything_is_refused_or_answered_with_numbers() {
    let corpus = scenes::corpus();
    for name in ["twisted_bar.toml", "cantilever.toml", "cube.toml"] {
        let (path, bytes) = corpus.iter().find(|(path, _)| path.ends_with(name)).expect("a scene");
        let scene = scenes::read(bytes).expect("a good scene");
        let mut scene = shortened(scene, path.parent().expect("a folder")).expect("a small scene");
        scene.dynamics = None;
        for tiny in [1e-160, 1e-310] {
            let mut load = scene::Load::force_per_node(vec![tiny, -tiny, tiny]);
            load.fit = true;
            scene.load = vec![load];
            match study::run(&scene, &Progress::default()) {
                Ok(study) => assert_numbers(&study, name),
                Err(error) => {
                    assert!([2, 3].contains(&error.exit_status()) && error.help().is_some(), "{name}: {error}")
                }
            }
        }
    }
}
