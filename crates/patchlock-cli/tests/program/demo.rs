//! Tests of `patchlock demo`: it shows a turn, a loss and the return.

use std::fs;

use crate::support::{Bench, column, patchlock};
use predicates::prelude::*;
use predicates::str::contains;

#[test]
fn the_demo_shows_a_turn_a_loss_and_the_return() {
    let bench = Bench::new();
    let mut demo = patchlock();
    demo.current_dir(bench.folder.path()).args(["demo", "--quiet", "--out", "d"]);
    let shown = demo.assert().success();
    let text = String::from_utf8(shown.get_output().stdout.clone()).unwrap();
    shown.stdout(contains("Lost in frame ").and(contains(", found in frame ")));
    // The program is named by its path, since it is not in the PATH.
    let text = text.replace(&patchlock().get_program().to_string_lossy()[..], "patchlock");
    assert_eq!(text.lines().find(|line| line.chars().count() > 80), None);
    // The lowest overlap is where the target is nearly hidden.
    assert!(
        text.lines().any(|line| line.contains("lowest") && line.ends_with(" % hidden),")),
        "{text}"
    );
    suggestion_works(&bench, &text);

    let (boxes, truth) = (bench.lines("d/demo.csv"), bench.lines("d/truth.csv"));
    let hidden = column(&truth, "hidden");
    let is_lost = |k: usize| boxes[k + 1].contains(",lost,");
    let middle = hidden.iter().position(|&hidden| hidden == 1.0).unwrap() + 15;
    assert_eq!(hidden[middle], 1.0);
    assert!(is_lost(middle) && !is_lost(middle - 40) && !is_lost(hidden.len() - 1));

    // The rise of the upper side: the largest turn, and the one after the return.
    let rises = |lines: &[String]| -> Vec<f64> {
        let (y1, y2) = (column(lines, "y1"), column(lines, "y2"));
        y2.iter().zip(y1).map(|(y2, y1)| y2 - y1).collect()
    };
    let (found, true_rises) = (rises(&boxes), rises(&truth));
    for k in [38, 178] {
        let (found, expected) = (found[k], true_rises[k]);
        assert!(expected.abs() > 35.0 && (found - expected).abs() < 10.0, "frame {k}: {found}");
    }
    let png = fs::read(bench.path("d/strip.png")).unwrap();
    let strip = image::load_from_memory(&png).unwrap();
    // Five frames: the first, a turn, the loss, the return and the darkest.
    assert_eq!(strip.width(), 5 * (320 + 14) + 14);
}

/// Runs the command that the demo suggests, in its first frames.
fn suggestion_works(bench: &Bench, text: &str) {
    let lines = text.lines().skip_while(|line| !line.starts_with("To do the same")).skip(1);
    let suggested: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
    let command = suggested.join(" ").replace(" \\ ", " ");
    let mut words = command.split_whitespace();
    assert_eq!(words.next(), Some("patchlock"));
    let mut again = patchlock();
    again.current_dir(bench.folder.path()).args(words).args(["--end", "5", "--quiet"]);
    again.assert().success();
    assert_eq!(bench.lines("d/mine.csv").len(), 6);
}
