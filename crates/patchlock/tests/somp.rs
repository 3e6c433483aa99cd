//! The fast solver against the definition, on random and on awkward problems.

use patchlock::config::Selection;
use patchlock::sparse::codes::{Code, CodeRules};
use patchlock::sparse::dictionary::Dictionary;
use patchlock::sparse::somp::{batched, definition};
use proptest::prelude::*;

const RULES: CodeRules = CodeRules {
    atoms: 4,
    selection: Selection::OrderRecursive,
    min_residual: 1e-6,
    stop_energy: 0.0,
};

/// Scores that differ by less than this share are the same up to the rounding of `f64`.
const TIE: f64 = 1e-9;

fn unit(mut v: Vec<f32>) -> Vec<f32> {
    patchlock::vision::patches::normalise(&mut v);
    v
}

/// Vectors like patches: positive, alike, some of them equal, nearly equal, or zero.
fn vectors(dim: usize, count: usize) -> impl Strategy<Value = Vec<f32>> {
    let vector = prop::collection::vec(0.0..1.0f32, dim);
    let kinds = prop::collection::vec((vector, 0..12u8, 0..64usize), count);
    kinds.prop_map(move |kinds| {
        let mut all: Vec<Vec<f32>> = Vec::new();
        for (vector, kind, other) in kinds {
            let earlier = all.get(other % all.len().max(1)).cloned();
            let blend = |earlier: Vec<f32>, amount: f32| {
                earlier.iter().zip(&vector).map(|(e, v)| e + amount * v).collect::<Vec<_>>()
            };
            all.push(match (kind, earlier) {
                (0, _) => vec![0.0; dim],
                (1, Some(earlier)) => earlier,
                (2, Some(earlier)) => unit(blend(earlier, 1e-5)),
                (3, Some(earlier)) => unit(blend(earlier, 1e-3)),
                (4..7, Some(earlier)) => unit(blend(earlier, 0.05)),
                _ => unit(vector.iter().map(|v| v + 0.5).collect()),
            });
        }
        all.concat()
    })
}

fn residual(dictionary: &Dictionary, signal: &[f32], code: &Code) -> Vec<f64> {
    let mut left: Vec<f64> = signal.iter().map(|&v| f64::from(v)).collect();
    for (atom, x) in code.entries() {
        left.iter_mut().zip(dictionary.atom(atom)).for_each(|(l, &d)| *l -= x * f64::from(d));
    }
    left
}

/// How much of the energy of all signals a support explains, to compare supports that differ.
fn remaining(dictionary: &Dictionary, signals: &[&[f32]], support: &[usize]) -> f64 {
    let dim = dictionary.dim();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for &k in support {
        let mut d: Vec<f64> = dictionary.atom(k).iter().map(|&v| f64::from(v)).collect();
        for _ in 0..2 {
            for q in &basis {
                let along: f64 = (0..dim).map(|s| d[s] * q[s]).sum();
                (0..dim).for_each(|s| d[s] -= along * q[s]);
            }
        }
        let norm = d.iter().map(|v| v * v).sum::<f64>().sqrt();
        basis.push(d.iter().map(|v| v / norm).collect());
    }
    let mut energy = 0.0;
    for signal in signals {
        let mut left: Vec<f64> = signal.iter().map(|&v| f64::from(v)).collect();
        for q in &basis {
            let along: f64 = (0..dim).map(|s| left[s] * q[s]).sum();
            (0..dim).for_each(|s| left[s] -= along * q[s]);
        }
        energy += left.iter().map(|v| v * v).sum::<f64>();
    }
    energy
}

fn indices(code: &Code) -> Vec<usize> {
    code.support().iter().map(|&k| k as usize).collect()
}

/// The atoms are those of the definition, unless a step was a tie; then each alternative explained as much.
fn check(
    dictionary: &Dictionary,
    shared: &[f32],
    candidate: &[f32],
    rules: &CodeRules,
    fast: &Code,
) {
    let slow = definition::solve(dictionary, shared, candidate, rules);
    let (fast_support, slow_support) = (indices(fast), indices(&slow));
    if fast_support == slow_support {
        for (a, b) in fast.coefficients().iter().zip(slow.coefficients()) {
            assert!((a - b).abs() <= 1e-6 * (1.0 + b.abs()), "{a} {b}");
        }
    } else {
        let signals: Vec<&[f32]> =
            shared.chunks_exact(dictionary.dim()).chain([candidate]).collect();
        let step = (0..).find(|&k| fast_support.get(k) != slow_support.get(k)).unwrap();
        let explained = |support: &[usize]| {
            let before = remaining(dictionary, &signals, &support[..step.min(support.len())]);
            before - remaining(dictionary, &signals, &support[..(step + 1).min(support.len())])
        };
        let (a, b) = (explained(&fast_support), explained(&slow_support));
        assert!(
            rules.selection == Selection::Textbook || (a - b).abs() <= TIE * b.max(1e-3),
            "{fast_support:?} explains {a}, {slow_support:?} explains {b}"
        );
    }
    let left = residual(dictionary, candidate, fast);
    for &k in &fast_support {
        let along: f64 = left.iter().zip(dictionary.atom(k)).map(|(l, &d)| l * f64::from(d)).sum();
        assert!(along.abs() < 1e-6, "the residual is not orthogonal to the support: {along}");
    }
}

fn solve_all(
    dictionary: &Dictionary,
    shared: &[f32],
    candidates: &[f32],
    rules: &CodeRules,
) -> Vec<Code> {
    let mut codes = vec![Code::default(); candidates.len() / dictionary.dim()];
    let mut scratch = batched::Scratch::default();
    batched::solve(dictionary, shared, candidates, rules, &mut scratch, &mut codes);
    codes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn fast_is_the_definition(
        atoms in vectors(16, 50),
        signals in vectors(16, 10),
        columns in 0..5usize,
        count in 1..7usize,
        textbook in any::<bool>(),
        stop_energy in prop_oneof![Just(0.0), Just(1e-3)],
    ) {
        let dictionary = Dictionary::new(16, 5, atoms);
        let selection = if textbook { Selection::Textbook } else { Selection::OrderRecursive };
        let rules = CodeRules { atoms: count, selection, stop_energy, ..RULES };
        let (shared, candidates) = signals.split_at(columns * 16);
        let codes = solve_all(&dictionary, shared, candidates, &rules);
        for (candidate, code) in candidates.chunks_exact(16).zip(&codes) {
            check(&dictionary, shared, candidate, &rules, code);
        }
    }

    /// More atoms never leave more energy.
    #[test]
    fn the_residual_never_grows(atoms in vectors(16, 40), signals in vectors(16, 5)) {
        let dictionary = Dictionary::new(16, 5, atoms);
        let (shared, candidate) = signals.split_at(4 * 16);
        let mut before = f64::INFINITY;
        for count in 1..=8 {
            let code = solve_all(&dictionary, shared, candidate, &CodeRules { atoms: count, ..RULES })[0];
            let left: f64 = residual(&dictionary, candidate, &code).iter().map(|v| v * v).sum();
            prop_assert!(left <= before * (1.0 + 1e-9) + 1e-12);
            before = left;
        }
    }
}

#[test]
fn more_candidates_than_a_block_get_their_own_codes() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let tree = (vectors(64, 170), vectors(64, 204)).new_tree(&mut runner).unwrap();
    let (atoms, signals) = proptest::strategy::ValueTree::current(&tree);
    let dictionary = Dictionary::new(64, 17, atoms);
    let (shared, candidates) = signals.split_at(4 * 64);
    let codes = solve_all(&dictionary, shared, candidates, &RULES);
    for (candidate, code) in candidates.chunks_exact(64).zip(&codes) {
        check(&dictionary, shared, candidate, &RULES, code);
    }
}

#[test]
fn nothing_to_explain_gives_an_empty_code() {
    let dictionary = Dictionary::new(4, 1, unit(vec![1.0, 2.0, 3.0, 4.0]));
    assert!(solve_all(&dictionary, &[], &[0.0; 4], &RULES)[0].support().is_empty());
    let zero = Dictionary::new(4, 1, vec![0.0; 4]);
    assert!(solve_all(&zero, &[], dictionary.atom(0), &RULES)[0].support().is_empty());
}
