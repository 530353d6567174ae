//! Every reader on damaged files, and whole small scenes: no panic, no hang, little memory, errors with a remedy.
//!
//! Valid files are changed at random, see [`damage`]. Seed and number of cases are fixed; they are printed with the number
//! of files that could still be read, the greatest memory and the longest time of the processor:
//!
//! ```text
//! SPRINGFIT_FUZZ_CASES=1000000 cargo test --release --test fuzz -- --nocapture
//! ```
//!
//! runs more; a tenth of that number for whole scenes. A case that was found by fuzzing stays as a test of its own.

mod damage;
mod files;
mod memory;
mod meshes;
mod scenes;
mod whole;

use std::cell::Cell;

use proptest::collection::vec;
use proptest::prelude::any;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use springfit::error::Error;

use damage::damage;
use memory::measured;

const SEED: u64 = 20_241;

/// Cases of a reader.
const CASES: u32 = 3_000;

/// Seconds of the processor that one case may take.
const LONGEST: f64 = 1.0;

/// Whether something was read, or the reason why not.
type Verdict = Result<(), Error>;

/// How many cases to run.
fn cases() -> u32 {
    std::env::var("SPRINGFIT_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(CASES)
}

/// Seconds that the processor has worked for this thread; a busy machine does not falsify them.
#[cfg(unix)]
fn thread_seconds() -> f64 {
    use nix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).expect("every thread has a clock");
    time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64
}

/// Not known on this system.
#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    0.0
}

/// Memory in bytes and seconds that reading these files took; both within their bounds.
fn within_bounds<T>(files: &[Vec<u8>], read: impl FnOnce(&[Vec<u8>]) -> T) -> (T, usize, f64) {
    let start = thread_seconds();
    let (result, memory) = measured(|| read(files));
    let seconds = thread_seconds() - start;
    let bound = (64 << 20) + 10 * files.iter().map(Vec::len).sum::<usize>();
    assert!(memory <= bound, "{memory} bytes");
    assert!(seconds <= LONGEST, "{seconds} s");
    (result, memory, seconds)
}

/// Damages groups of files that belong together, and reads them.
fn fuzz<T>(
    what: &str,
    words: &[&str],
    corpus: &[Vec<Vec<u8>>],
    read: impl Fn(&[Vec<u8>]) -> T,
    verdict: impl Fn(&T) -> Verdict,
) {
    fuzz_cases(cases(), what, words, corpus, read, verdict);
}

/// The same with a number of cases.
fn fuzz_cases<T>(
    cases: u32,
    what: &str,
    words: &[&str],
    corpus: &[Vec<Vec<u8>>],
    read: impl Fn(&[Vec<u8>]) -> T,
    verdict: impl Fn(&T) -> Verdict,
) {
    let config = Config { cases, rng_seed: RngSeed::Fixed(SEED), failure_persistence: None, ..Config::default() };
    let change = (any::<u8>(), any::<u32>(), any::<u32>(), any::<u32>());
    let figures = Cell::new((0_u32, 0_usize, 0.0_f64));
    TestRunner::new(config)
        .run(&(0..corpus.len(), vec(change, 1..4)), |(which, changes)| {
            let mut files = corpus[which].clone();
            for change in changes {
                let parts = files.len() as u32;
                let file = &mut files[(change.1 % parts) as usize];
                damage(file, words, (change.0, change.1 / parts, change.2, change.3));
            }
            let (result, memory, seconds) = within_bounds(&files, &read);
            let (good, most, longest) = figures.get();
            let verdict = verdict(&result);
            figures.set((good + u32::from(verdict.is_ok()), most.max(memory), longest.max(seconds)));
            if let Err(error) = verdict {
                assert!(error.help().is_some() && error.exit_status() == 2, "{error}");
            }
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{what}: {failure}"));
    let (good, most, longest) = figures.get();
    println!("{what}: {cases} cases of seed {SEED}, {good} read, at most {most} bytes, at most {longest:.4} s");
    assert!(good > 0, "some damage is harmless");
}

/// Every beginning of a file, and the file with one bit flipped at every place: nothing panics, errors have a remedy.
fn cut_and_flipped(file: &[u8], read: impl Fn(&[u8]) -> Verdict) {
    let check = |bytes: &[u8]| {
        if let Err(error) = read(bytes) {
            assert!(error.help().is_some() && error.exit_status() == 2, "{error}");
        }
    };
    (0..file.len()).for_each(|end| check(&file[..end]));
    for at in 0..file.len() {
        let mut flipped = file.to_vec();
        flipped[at] ^= 1 << (at % 8);
        check(&flipped);
    }
}
