//! The progress bar, shown only on a terminal.

use std::io::{self, IsTerminal as _};
use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use patchlock::Status;
use patchlock_bench::bench::runner::ProgressListener;
use patchlock_bench::bench::store::Run;

use crate::failure::say;
use crate::interrupt;
use crate::output::TargetResult;
use crate::output::draw::score_label;

/// A progress bar with speed and score; hidden in a pipe or with `--quiet`.
pub struct Progress {
    bar: ProgressBar,
    visible: bool,
    /// Frames of a live source that were left out.
    dropped: AtomicUsize,
}

impl Progress {
    /// A bar for this number of frames; `None` if the number is unknown.
    pub fn new(frames: Option<usize>, quiet: bool) -> Self {
        let visible = !quiet && io::stderr().is_terminal();
        let target =
            if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(frames.map(|count| count as u64), target);
        let template = if frames.is_some() {
            // What is too wide for the terminal is cut off at its end.
            "{bar:24.cyan/8} {pos}/{len}  {eta} left  {wide_msg}"
        } else {
            "{spinner:.cyan} {pos} frames  {wide_msg}"
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━━─"));
        }
        Self { bar, visible, dropped: AtomicUsize::default() }
    }

    /// Counts one more frame, with these targets.
    pub fn step(&self, fps: f64, targets: &[TargetResult]) {
        let mut message = format!("{fps:.1} fps  {}", state(targets));
        match self.dropped.load(Ordering::Relaxed) {
            0 => {}
            dropped => message += &format!("  {dropped} dropped"),
        }
        self.advance(message);
    }

    /// How many frames of a live source were left out so far.
    pub fn set_dropped(&self, dropped: usize) {
        self.dropped.store(dropped, Ordering::Relaxed);
    }

    /// Shows a line above the bar.
    pub fn note(&self, line: &str) {
        self.bar.suspend(|| say(line));
    }

    /// Counts one more item and shows a message.
    pub fn advance(&self, message: impl Into<std::borrow::Cow<'static, str>>) {
        self.bar.set_message(message);
        self.bar.inc(1);
    }

    /// Removes the bar; prints this text instead if the bar was visible.
    pub fn finish(&self, text: &str) {
        self.bar.finish_and_clear();
        if self.visible {
            text.lines().for_each(say);
        }
    }
}

/// The targets in a few words. The score of a lost one says nothing.
fn state(targets: &[TargetResult]) -> String {
    match targets {
        [] => "no target".to_string(),
        [target] if target.estimate.status == Status::Lost => "lost".to_string(),
        [target] => format!("score {}", score_label(&target.estimate)),
        all => {
            let lost = all.iter().filter(|target| target.estimate.status == Status::Lost).count();
            format!("{} targets, {lost} lost", all.len())
        }
    }
}

/// A progress bar over the frames of many runs.
pub struct RunsProgress {
    bar: Progress,
    runs: usize,
    ended: AtomicUsize,
    complete: AtomicUsize,
}

impl RunsProgress {
    /// A bar for these runs.
    pub fn new(tasks: &[Run<'_>], quiet: bool) -> Self {
        let frames = tasks.iter().map(|task| task.frames.len()).sum();
        let (ended, complete) = (AtomicUsize::new(0), AtomicUsize::new(0));
        Self { bar: Progress::new(Some(frames), quiet), runs: tasks.len(), ended, complete }
    }

    /// Removes the bar; returns the number of complete runs.
    pub fn finish(&self) -> usize {
        self.bar.bar.finish_and_clear();
        self.complete.load(Ordering::Relaxed)
    }
}

impl ProgressListener for RunsProgress {
    fn begins(&self, task: &Run<'_>) {
        let number = (self.ended.load(Ordering::Relaxed) + 1).min(self.runs);
        self.bar.bar.set_message(format!(
            "run {number} of {}: {} seed {}",
            self.runs, task.target, task.seed
        ));
    }

    fn frame(&self) {
        self.bar.bar.inc(1);
    }

    fn ends(&self, left: usize, complete: bool) {
        self.ended.fetch_add(1, Ordering::Relaxed);
        self.complete.fetch_add(usize::from(complete), Ordering::Relaxed);
        // Frames left over from a failed run will never be counted.
        self.bar.bar.dec_length(left as u64);
    }

    fn stopped(&self) -> bool {
        interrupt::requested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::example;

    #[test]
    fn a_low_score_is_shown_with_its_status() {
        let target = example::target;
        assert_eq!(state(&[target(Status::Tracked)]), "score 0.50");
        assert_eq!(state(&[target(Status::Uncertain)]), "score 0.50 uncertain");
        assert_eq!(state(&[target(Status::Lost)]), "lost");
        let two = [target(Status::Lost), target(Status::Tracked)];
        assert_eq!(state(&two), "2 targets, 1 lost");
    }
}
