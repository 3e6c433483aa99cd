//! The progress bar: on a terminal only.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar with speed and score; silent in a pipe and when asked to be.
pub struct Progress {
    bar: ProgressBar,
    visible: bool,
}

impl Progress {
    /// A bar for so many frames, or one without an end.
    pub fn new(frames: Option<usize>, quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
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
        self.bar.set_message(format!("{fps:.1} fps  score {score:.2}"));
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
