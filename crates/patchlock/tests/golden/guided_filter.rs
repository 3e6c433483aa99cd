//! Compares the guided filter with its definition, window by window.

use crate::{difference, golden};
use patchlock::vision::guided_filter::GuidedFilter;
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    side: usize,
    radius: usize,
    eps: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    guide: Vec<Vec<f32>>,
    input: Vec<Vec<f32>>,
    output: Vec<Vec<f64>>,
}

#[test]
fn the_filter_matches_its_definition() {
    let file: File = golden("guided_filter.json");
    assert_eq!(file.cases.len(), 7);
    let mut filter = GuidedFilter::default();
    let wide = |rows: &[Vec<f32>]| rows.iter().flatten().map(|&v| f64::from(v)).collect::<Vec<_>>();
    for case in &file.cases {
        let (guide, input) = (wide(&case.guide), wide(&case.input));
        let ours = filter.filter(&guide, &input, file.side, file.radius, file.eps);
        let gap = difference(ours, case.output.iter().flatten());
        assert!(gap < 1e-8, "{}: {gap}", case.name);
    }
}
