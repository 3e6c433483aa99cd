//! Both solvers behind one interface, and an independent computation of what a set of atoms
//! explains.

// Each test program uses only a part of this module.
#![allow(dead_code)]

mod definition;

use patchlock::numeric::instructions::Instructions;
use patchlock::patch_model::sparse::codes::{Code, CodeParams};
use patchlock::patch_model::sparse::dictionary::Dictionary;
use patchlock::patch_model::sparse::somp::batched;

/// The parameters of the preset `paper`.
pub const PARAMS: CodeParams = CodeParams { atoms: 4, min_residual: 1e-6 };

/// Scores whose relative difference is smaller are equal up to the rounding of `f64`.
pub const TIE: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solver {
    Definition,
    Batched,
}

impl Solver {
    pub const ALL: [Self; 2] = [Self::Definition, Self::Batched];

    /// The code of one candidate.
    pub fn solve(
        self,
        dictionary: &Dictionary,
        shared: &[f32],
        candidate: &[f32],
        params: &CodeParams,
    ) -> Code {
        match self {
            Self::Definition => definition::solve(dictionary, shared, candidate, params),
            Self::Batched => solve_all(dictionary, shared, candidate, params)[0],
        }
    }
}

/// The codes of many candidates by the batched solver; they must be the same with all instructions
/// of this processor, and for each candidate alone, for which no products are kept.
pub fn solve_all(
    dictionary: &Dictionary,
    shared: &[f32],
    candidates: &[f32],
    params: &CodeParams,
) -> Vec<Code> {
    let location = batched::Location::new(dictionary, (0, shared), params);
    let solved = Instructions::available().into_iter().map(|(name, instructions)| {
        let mut codes = vec![Code::default(); candidates.len() / dictionary.dim()];
        let mut scratch = batched::SolverScratch::with(instructions);
        batched::solve(dictionary, &location, candidates, params, &mut scratch, &mut codes);
        // As if each were the only candidate at a location of its own, with the same columns.
        let (shared, mut alone) = (shared.repeat(codes.len()), vec![Code::default(); codes.len()]);
        batched::solve_each(dictionary, &shared, candidates, params, &mut scratch, &mut alone);
        assert_eq!(codes, alone, "{name}, each alone");
        (name, codes)
    });
    let same = |(first, codes), (name, others)| {
        assert_eq!(codes, others, "{first} and {name}");
        (name, others)
    };
    solved.reduce(same).unwrap().1
}

pub fn indices(code: &Code) -> Vec<usize> {
    code.support().iter().map(|&k| k as usize).collect()
}

/// The residual of the candidate.
pub fn residual(dictionary: &Dictionary, candidate: &[f32], code: &Code) -> Vec<f64> {
    let mut left = wide(candidate);
    for (atom, x) in code.entries() {
        left.iter_mut().zip(dictionary.atom(atom)).for_each(|(l, &d)| *l -= x * f64::from(d));
    }
    left
}

/// Orthonormal directions that span a set of atoms.
pub struct Span(Vec<Vec<f64>>);

impl Span {
    pub fn new(dictionary: &Dictionary, support: &[usize]) -> Self {
        let mut span = Self(Vec::new());
        for &k in support {
            let mut direction = span.residual(dictionary.atom(k));
            let norm = energy(&direction).sqrt();
            direction.iter_mut().for_each(|v| *v /= norm);
            span.0.push(direction);
        }
        span
    }

    /// The residual of a vector after projecting out the span, twice to reduce rounding errors.
    pub fn residual(&self, vector: &[f32]) -> Vec<f64> {
        let mut left = wide(vector);
        for q in self.0.iter().chain(&self.0) {
            let projection = dot(&left, q);
            left.iter_mut().zip(q).for_each(|(l, q)| *l -= projection * q);
        }
        left
    }

    /// The score of `atom` if it were chosen next.
    pub fn score(&self, dictionary: &Dictionary, signals: &[&[f32]], atom: usize) -> f64 {
        let atom = self.residual(dictionary.atom(atom));
        let correlation: f64 = signals.iter().map(|s| dot(&self.residual(s), &atom).powi(2)).sum();
        correlation / energy(&atom)
    }
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn energy(v: &[f64]) -> f64 {
    dot(v, v)
}

pub fn wide(v: &[f32]) -> Vec<f64> {
    v.iter().map(|&v| f64::from(v)).collect()
}
