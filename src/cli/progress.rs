//! A progress bar on stderr, drawn from a watcher thread, and Ctrl-C.
//!
//! The workers only count (see [`springfit::clock::Progress`]); the watcher looks ten times a second and draws from the
//! first second on, so short runs show nothing. Ctrl-C asks the workers to stop; a second Ctrl-C ends the process.

use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use springfit::clock::Progress;

use super::terminal;

/// Runs shorter than this show no bar.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two looks at the counters.
const LOOK: Duration = Duration::from_millis(100);

/// Draws until it is dropped.
pub struct Watcher(Option<(Sender<()>, JoinHandle<()>)>);

impl Watcher {
    /// Watches the counters; draws nothing unless `visible`.
    pub fn start(progress: Arc<Progress>, visible: bool) -> Self {
        if !visible {
            return Self(None);
        }
        let (stop, stopped) = channel();
        let start = Instant::now();
        let thread = std::thread::spawn(move || {
            let mut bar = None;
            while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if start.elapsed() > PATIENCE {
                    draw(bar.get_or_insert_with(bar_of_work), &progress);
                }
            }
            if let Some(bar) = bar {
                bar.finish_and_clear();
            }
        });
        Self(Some((stop, thread)))
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        if let Some((stop, thread)) = self.0.take() {
            drop(stop);
            // A panic of the watcher has been shown already, and the run does not depend on it.
            let _ = thread.join();
        }
    }
}

fn bar_of_work() -> ProgressBar {
    let style = ProgressStyle::with_template("{elapsed:>4} {msg} {wide_bar} {pos}/{len}");
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn draw(bar: &ProgressBar, progress: &Progress) {
    let (stage, done, total) = progress.snapshot();
    bar.set_message(stage);
    bar.set_length(total);
    bar.set_position(done);
    bar.tick();
}

/// Lets Ctrl-C stop the run; the second one does not wait.
pub fn stop_on_interrupt(progress: &Arc<Progress>) {
    let progress = Arc::clone(progress);
    let handler = move || {
        if progress.check().is_err() {
            std::process::exit(130);
        }
        progress.cancel();
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        terminal::tell(&format!("warning: Ctrl-C will end the run at once: {error}"));
    }
}
