//! Compares joint sparse codes with SPAMS, and with the oracle's reference where SPAMS itself
//! fails.

use crate::solvers::{PARAMS, Solver, Span, energy, indices};
use crate::{golden, read};
use patchlock::patch_model::sparse::codes::{Code, CodeParams};
use patchlock::patch_model::sparse::dictionary::Dictionary;
use patchlock::vision::patches::PatchGrid;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A choice is clear if the best score exceeds the second by at least this share.
const CLEAR: f64 = 1e-9;

#[derive(Deserialize)]
struct File {
    limit: usize,
    scales: BTreeMap<String, GoldenScale>,
    images: Vec<Vec<f32>>,
    settings: Vec<Setting>,
    agree: Vec<Scene>,
    spams_degenerate: Vec<Scene>,
    random: Option<Random>,
}

#[derive(Deserialize)]
struct GoldenScale {
    size: usize,
    step: usize,
    locations: usize,
}

/// Indices of images.
#[derive(Deserialize)]
struct Setting {
    name: String,
    templates: Vec<usize>,
    buffer: Vec<usize>,
    candidates: Vec<usize>,
}

#[derive(Deserialize)]
struct Scene {
    setting: usize,
    scale: String,
    candidate: usize,
    location: usize,
    #[serde(flatten)]
    answers: Answers,
}

#[derive(Deserialize)]
struct Random {
    agree: Vec<RandomProblem>,
    spams_degenerate: Vec<RandomProblem>,
}

#[derive(Deserialize)]
struct RandomProblem {
    flaw: String,
    dictionary: Vec<Vec<f32>>,
    signals: Vec<Vec<f32>>,
    #[serde(flatten)]
    answers: Answers,
}

#[derive(Deserialize)]
struct Answers {
    spams: Answer,
    reference: Answer,
}

/// `None` stands for NaN.
#[derive(Deserialize)]
struct Answer {
    atoms: Vec<usize>,
    coefficients: Vec<Option<f64>>,
    residual_energies: Vec<Option<f64>>,
    margin: Option<f64>,
}

fn is_clear(margin: Option<f64>) -> bool {
    margin.is_some_and(|margin| margin >= CLEAR)
}

/// One problem in the form that our solvers expect. The files list the candidate first, then the
/// buffer.
struct Problem<'a> {
    name: String,
    dictionary: &'a Dictionary,
    candidate: Vec<f32>,
    shared: Vec<f32>,
}

/// How many problems were compared, and how many of them only by their energies.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    agree: usize,
    degenerate: usize,
    unclear: usize,
}

impl Problem<'_> {
    fn solve(&self, solver: Solver, params: &CodeParams) -> Code {
        solver.solve(self.dictionary, &self.shared, &self.candidate, params)
    }

    fn energies(&self, support: &[usize]) -> Vec<f64> {
        let span = Span::new(self.dictionary, support);
        let shared = self.shared.chunks_exact(self.dictionary.dim());
        [self.candidate.as_slice()]
            .into_iter()
            .chain(shared)
            .map(|s| energy(&span.residual(s)))
            .collect()
    }

    /// Compares both solvers with the reference, which is also SPAMS' answer unless SPAMS failed.
    fn check(&self, answers: &Answers, limit: usize, counts: &mut Counts) {
        let params = CodeParams { atoms: limit, ..PARAMS };
        for solver in Solver::ALL {
            let code = self.solve(solver, &params);
            self.check_reference(&answers.reference, &code, solver);
        }
        counts.unclear += usize::from(!is_clear(answers.reference.margin));
    }

    fn check_reference(&self, reference: &Answer, code: &Code, solver: Solver) {
        let name = format!("{} {solver:?}", self.name);
        let (support, energies) = (indices(code), self.energies(&indices(code)));
        let theirs = reference.residual_energies.iter().map(|e| e.unwrap());
        if !is_clear(reference.margin) {
            assert_eq!(support.len(), reference.atoms.len(), "{name}");
            let (ours, theirs) = (energies.iter().sum::<f64>(), theirs.sum::<f64>());
            assert!((ours - theirs).abs() < 1e-9, "{name}: energy {ours} instead of {theirs}");
            return;
        }
        assert_eq!(support, reference.atoms, "{name}");
        for (ours, theirs) in code.coefficients().iter().zip(&reference.coefficients) {
            let theirs = theirs.unwrap();
            assert!((ours - theirs).abs() <= 1e-6 * theirs.abs(), "{name}: {ours} {theirs}");
        }
        for (ours, theirs) in energies.iter().zip(theirs) {
            assert!((ours - theirs).abs() <= 1e-9, "{name}: {ours} {theirs}");
        }
    }

    fn check_agree(&self, answers: &Answers, limit: usize, counts: &mut Counts) {
        assert_eq!(answers.spams.atoms, answers.reference.atoms, "{}", self.name);
        self.check(answers, limit, counts);
        counts.agree += 1;
    }

    /// SPAMS' answer must differ from that of our solvers.
    fn check_degenerate(&self, answers: &Answers, limit: usize, counts: &mut Counts) {
        self.check(answers, limit, counts);
        let sorted = |mut atoms: Vec<usize>| {
            atoms.sort_unstable();
            atoms
        };
        let finite = answers.spams.coefficients.iter().all(Option::is_some);
        for solver in Solver::ALL {
            let ours = indices(&self.solve(solver, &CodeParams { atoms: limit, ..PARAMS }));
            assert!(
                !finite || sorted(ours) != sorted(answers.spams.atoms.clone()),
                "{}",
                self.name
            );
        }
        counts.degenerate += 1;
    }
}

impl File {
    fn grid(&self, scale: &str) -> PatchGrid {
        let GoldenScale { size, step, locations } = self.scales[scale];
        let grid = PatchGrid::new(32, size, step, false);
        assert_eq!(grid.locations(), locations);
        grid
    }

    fn cut(&self, grid: &PatchGrid, images: &[usize], location: usize) -> Vec<f32> {
        let mut patches = vec![0.0; images.len() * grid.dim()];
        for (&image, patch) in images.iter().zip(patches.chunks_exact_mut(grid.dim())) {
            grid.cut(&self.images[image], location, patch);
        }
        patches
    }

    fn dictionary(&self, setting: &Setting, grid: &PatchGrid) -> Dictionary {
        let atoms = setting.templates.iter().flat_map(|&k| grid.cut_all(&self.images[k])).collect();
        Dictionary::new(grid.dim(), grid.locations(), atoms)
    }

    /// Compares all problems made from the file's images.
    fn check_scenes(&self) -> Counts {
        let mut counts = Counts::default();
        for (index, setting) in self.settings.iter().enumerate() {
            for scale in self.scales.keys() {
                let grid = self.grid(scale);
                let dictionary = self.dictionary(setting, &grid);
                let problem = |scene: &Scene| Problem {
                    name: format!("{}, {scale}, location {}", setting.name, scene.location),
                    dictionary: &dictionary,
                    candidate: self.cut(
                        &grid,
                        &[setting.candidates[scene.candidate]],
                        scene.location,
                    ),
                    shared: self.cut(&grid, &setting.buffer, scene.location),
                };
                let here = |scene: &&Scene| scene.setting == index && scene.scale == *scale;
                for scene in self.agree.iter().filter(here) {
                    problem(scene).check_agree(&scene.answers, self.limit, &mut counts);
                }
                for scene in self.spams_degenerate.iter().filter(here) {
                    problem(scene).check_degenerate(&scene.answers, self.limit, &mut counts);
                }
            }
        }
        assert_eq!(
            (counts.agree, counts.degenerate),
            (self.agree.len(), self.spams_degenerate.len())
        );
        counts
    }
}

impl RandomProblem {
    /// Calls `use_it` with the problem. Its atoms have no locations.
    fn with<T>(&self, use_it: impl FnOnce(Problem<'_>) -> T) -> T {
        let dictionary = Dictionary::new(16, 1, self.dictionary.concat());
        use_it(Problem {
            name: format!("random, {}", self.flaw),
            dictionary: &dictionary,
            candidate: self.signals[0].clone(),
            shared: self.signals[1..].concat(),
        })
    }
}

#[test]
fn codes_of_rendered_scenes_match_spams() {
    let counts = golden::<File>("somp.json").check_scenes();
    // Atoms tie where templates are repeated.
    assert_eq!(counts, Counts { agree: 80, degenerate: 15, unclear: 13 });
}

#[test]
fn codes_of_random_problems_match_spams() {
    let file: File = golden("somp.json");
    let random = file.random.as_ref().unwrap();
    let mut counts = Counts::default();
    for random in &random.agree {
        random.with(|problem| problem.check_agree(&random.answers, file.limit, &mut counts));
    }
    for random in &random.spams_degenerate {
        random.with(|problem| problem.check_degenerate(&random.answers, file.limit, &mut counts));
    }
    assert_eq!(counts, Counts { agree: 14, degenerate: 3, unclear: 3 });
}

/// `tools/oracles/somp_real.py` writes such a file from real frames, which we may not distribute.
#[test]
fn codes_of_real_frames_match_spams() {
    let Some(path) = std::env::var_os("PATCHLOCK_SOMP_GOLDEN") else {
        eprintln!(
            "skipped: PATCHLOCK_SOMP_GOLDEN names no file made by tools/oracles/somp_real.py"
        );
        return;
    };
    let counts = read::<File>(path.as_ref()).check_scenes();
    eprintln!("{}: {counts:?}", path.display());
}
