//! The progress bar: on a terminal only.

use std::io::IsTerminal;

use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use patchlock_eval::bench::runner::Watch;
use patchlock_eval::bench::store::Task;

use crate::interrupt;

/// A bar with speed and score; silent in a pipe and when asked to be.
pub struct Progress {
    bar: ProgressBar,
    visible: bool,
}

impl Progress {
    /// A bar for so many frames, or one without an end.
    pub fn new(frames: Option<usize>, quiet: bool) -> Self {
        Self::with_visibility(frames, !quiet && std::io::stderr().is_terminal())
    }

    /// The same beside a table on standard output: where that is a terminal too, its rows show the progress, and a bar would get between them.
    pub fn beside_table(frames: Option<usize>, quiet: bool) -> Self {
        let (bar, table) = (std::io::stderr().is_terminal(), std::io::stdout().is_terminal());
        Self::with_visibility(frames, visible_beside_table(quiet, bar, table))
    }

    fn with_visibility(frames: Option<usize>, visible: bool) -> Self {
        let target =
            if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(frames.map(|count| count as u64), target);
        let template = if frames.is_some() {
            "{bar:32.cyan/8} {pos}/{len}  {msg}  {eta} left"
        } else {
            "{spinner:.cyan} {pos} frames  {msg}"
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━━─"));
        }
        Self { bar, visible }
    }

    /// One frame more.
    pub fn step(&self, fps: f64, score: f64) {
        self.advance(format!("{fps:.1} fps  score {score:.2}"));
    }

    /// One piece of work more, with a word about it.
    pub fn advance(&self, message: impl Into<std::borrow::Cow<'static, str>>) {
        self.bar.set_message(message);
        self.bar.inc(1);
    }

    /// Takes the bar away and leaves one line, where anybody looks.
    pub fn finish(&self, line: &str) {
        self.bar.finish_and_clear();
        if self.visible {
            eprintln!("{line}");
        }
    }
}

/// Whether a bar is shown; the others say what is a terminal.
fn visible_beside_table(quiet: bool, bar: bool, table: bool) -> bool {
    !quiet && bar && !table
}

/// A bar over the frames of many runs.
pub struct RunsProgress {
    bar: Progress,
    runs: usize,
    ended: AtomicUsize,
    whole: AtomicUsize,
}

impl RunsProgress {
    /// A bar for these runs.
    pub fn new(tasks: &[Task<'_>], quiet: bool) -> Self {
        let frames = tasks.iter().map(|task| task.frames.len()).sum();
        let (ended, whole) = (AtomicUsize::new(0), AtomicUsize::new(0));
        Self { bar: Progress::new(Some(frames), quiet), runs: tasks.len(), ended, whole }
    }

    /// Takes the bar away; gives the number of runs that are complete.
    pub fn finish(&self) -> usize {
        self.bar.bar.finish_and_clear();
        self.whole.load(Ordering::Relaxed)
    }
}

impl Watch for RunsProgress {
    fn begins(&self, task: &Task<'_>) {
        let number = (self.ended.load(Ordering::Relaxed) + 1).min(self.runs);
        self.bar.bar.set_message(format!(
            "frames  run {number} of {}: {} seed {}",
            self.runs, task.target, task.seed
        ));
    }

    fn frame(&self) {
        self.bar.bar.inc(1);
    }

    fn ends(&self, left: usize, complete: bool) {
        self.ended.fetch_add(1, Ordering::Relaxed);
        self.whole.fetch_add(usize::from(complete), Ordering::Relaxed);
        // Frames that will not come any more must not be waited for.
        self.bar.bar.dec_length(left as u64);
    }

    fn stopped(&self) -> bool {
        interrupt::requested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_bar_among_the_rows_of_a_table() {
        assert!(!visible_beside_table(false, true, true), "both on the terminal");
        assert!(visible_beside_table(false, true, false), "the table goes to a file");
        assert!(
            !visible_beside_table(false, false, false) && !visible_beside_table(true, true, false)
        );
    }
}
