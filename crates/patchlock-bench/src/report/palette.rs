//! Colours and dash patterns of the trackers; each tracker has the same ones in every plot.
//!
//! The hues are those of Okabe and Ito (2008), which can be told apart with any colour vision. When
//! they are used up, they are repeated with dashes.

use std::fmt::Write;

use patchlock::Status;

/// Hues for the light and the dark theme, for the classes `c0`, `c1` ..; the first is that of the
/// tracker that the report is about.
const HUES: [[&str; 2]; 7] = [
    ["#d1480a", "#ff8a4c"],
    ["#0072b2", "#57b1ee"],
    ["#008a65", "#2fc99b"],
    ["#c9609b", "#ee9ccb"],
    ["#c98a00", "#f2bb3a"],
    ["#2aa0dd", "#9bdcff"],
    ["#3c4653", "#c3ccd6"],
];
pub const LEVEL_COUNT: usize = 5;
pub const STATUS_COUNT: usize = Status::NAMES.len();
/// Colours of the levels of overlap for the light and the dark theme, from lost to good, for the
/// classes `h0` .. `h4`.
const LEVELS: [[&str; 2]; LEVEL_COUNT] = [
    ["#b63a06", "#ff7a3d"],
    ["#f0a97f", "#a3542c"],
    ["#dfe3e8", "#4a535f"],
    ["#8fbfdf", "#3b7ca8"],
    ["#1f7ab0", "#6cc0f5"],
];
/// Colours of the statuses tracked, uncertain and lost for the light and the dark theme, for the
/// classes `s0` .. `s2`.
const STATUSES: [[&str; 2]; STATUS_COUNT] =
    [["#b9dbb0", "#3d6b3a"], ["#e8b93c", "#c4941c"], ["#8c1d40", "#e0557f"]];
/// Dash patterns; each repetition of the hues uses the next one.
const DASHES: [&str; 6] = ["", "7 3", "2 3", "9 3 2 3", "4 2", "12 4"];

/// The background of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Theme {
    Light,
    Dark,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineStyle {
    hue: usize,
    round: usize,
    /// Whether the line is thicker, for the trackers that are always named.
    pub strong: bool,
}

impl LineStyle {
    /// The look of the tracker that the report is about.
    pub const FIRST: Self = Self { hue: 0, round: 0, strong: true };

    /// The look of the `k`-th other tracker, counted from 0.
    pub fn other(k: usize, strong: bool) -> Self {
        let hues = HUES.len() - 1;
        Self { hue: 1 + k % hues, round: (k / hues) % DASHES.len(), strong }
    }

    /// The class that fills a shape with the hue.
    pub fn fill(self) -> String {
        format!("f{}", self.hue)
    }

    pub fn line(self) -> String {
        self.line_with_width(if self.strong { 3.0 } else { 1.7 })
    }

    /// The SVG attributes of a line of this width.
    pub fn line_with_width(self, width: f64) -> String {
        let dashes = match DASHES[self.round] {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        format!(
            "class=\"c{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}",
            self.hue
        )
    }
}

/// The level of an overlap, from 0.
pub fn level(overlap: f64) -> usize {
    ((overlap * LEVEL_COUNT as f64) as usize).min(LEVEL_COUNT - 1)
}

/// The CSS rules of all classes of this module.
pub fn style(theme: Theme) -> String {
    let index = theme as usize;
    let mut rules = String::new();
    for (k, hue) in HUES.iter().enumerate() {
        let _ = write!(rules, ".c{k}{{stroke:{0}}}.f{k}{{fill:{0}}}", hue[index]);
    }
    for (k, level) in LEVELS.iter().enumerate() {
        let _ = write!(rules, ".h{k}{{stroke:{0}}}", level[index]);
    }
    for (k, status) in STATUSES.iter().enumerate() {
        let _ = write!(rules, ".s{k}{{stroke:{0}}}", status[index]);
    }
    rules
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn many_trackers_look_different() {
        let styles: HashSet<String> = (0..36).map(|k| LineStyle::other(k, false).line()).collect();
        assert_eq!(styles.len(), 36);
        assert!(!styles.iter().any(|style| style.contains("\"c0\"")));
    }

    #[test]
    fn levels_are_fifths() {
        assert_eq!([0.0, 0.19, 0.2, 0.5, 0.99, 1.0].map(level), [0, 0, 1, 2, 4, 4]);
    }
}
