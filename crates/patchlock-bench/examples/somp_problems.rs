//! Times the joint sparse codes of one real frame on one thread, and writes some of the problems
//! for other solvers.
//!
//! ```sh
//! cargo run --release -p patchlock-bench --example somp_problems -- DATASET TARGET FRAME WRITTEN OUT
//! ```
//!
//! Tracks TARGET of DATASET with the preset `paper` up to FRAME, then codes the patches of all
//! particles at all locations and both scales, without pruning. For WRITTEN evenly spaced
//! particles, it writes the problems of each scale to OUT: `dictionary.npy` (atoms, samples),
//! `shared.npy` (locations, buffer, samples), `patches.npy` (particles, locations, samples) and
//! `atoms.npy` (particles, locations, atoms of a code; padded with -1). The times are printed as a
//! line of JSON. `benchmarks/speed.py` runs this example. Patches of frames by third parties must
//! not be committed.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use patchlock::patch_model::scale::{CodingScratch, PatchScores, Scale, ScaleParams};
use patchlock::patch_model::sparse::codes::CodeParams;
use patchlock::patch_model::sparse::somp::batched::BLOCK;
use patchlock::vision::frame::GreyImage;
use patchlock::vision::patches::{PatchGrid, normalise};
use patchlock::vision::warp::warp;
use patchlock::{FrameView, PaperConfig, State, Tracker};
use patchlock_bench::dataset::Dataset;
use patchlock_media::image_file;
use serde::Deserialize;
use serde_json::{Value, json};

type Result<T> = std::result::Result<T, Box<dyn Error>>;
/// The samples of each template.
type Templates = Vec<Vec<f32>>;

/// Number of repetitions of each measurement; the median is reported.
const REPETITIONS: usize = 5;

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, target, frame, written, out] = args.as_slice() else {
        return Err("usage: somp_problems DATASET TARGET FRAME WRITTEN OUT".into());
    };
    let (frame, written, out) = (frame.parse()?, written.parse::<usize>()?, Path::new(out));
    // The library runs its work in the current pool, so this limits it to one thread.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let state =
        pool.install(|| FrameState::reach(Path::new(dataset), target, frame).map_err(text))?;
    let chosen: Vec<usize> =
        (0..written).map(|k| k * state.particles.len() / written.max(1)).collect();
    let scale = |name: &str| -> Result<Value> {
        pool.install(|| state.measure(name, &chosen, &out.join(name)).map_err(text))
            .map_err(Into::into)
    };
    let (large, small) = (scale("large")?, scale("small")?);
    let particles = state.particles.len();
    println!(
        "{}",
        json!({
            "target": target, "frame": frame, "particles": particles,
            "large": large, "small": small,
        })
    );
    Ok(())
}

/// Converts an error so that it can be sent to another thread.
fn text(error: Box<dyn Error>) -> String {
    error.to_string()
}

/// The required parts of a snapshot.
#[derive(Deserialize)]
struct SavedTracker {
    track: SavedTrack,
}

#[derive(Deserialize)]
struct SavedTrack {
    target: SavedTarget,
}

#[derive(Deserialize)]
struct SavedTarget {
    paper: SavedPaper,
}

#[derive(Deserialize)]
struct SavedPaper {
    model: Memory,
}

#[derive(Deserialize)]
struct Memory {
    templates: Templates,
    small_templates: Templates,
    large_buffer: Templates,
    small_buffer: Templates,
}

/// The state of the tracker before a frame, and the particles that it draws there.
struct FrameState {
    config: PaperConfig,
    memory: Memory,
    particles: Vec<State>,
    image: GreyImage,
}

impl FrameState {
    fn reach(dataset: &Path, target: &str, frame: usize) -> Result<Self> {
        let dataset = Dataset::open(dataset)?;
        let sequence = dataset.find(target).ok_or("there is no such target")?;
        let first = sequence.truth.first().copied().flatten().ok_or("it has no first box")?;
        if !(1..sequence.frames.len()).contains(&frame) {
            return Err(format!("the target has frames 1 to {}", sequence.frames.len() - 1).into());
        }
        let config = PaperConfig::default();
        let picture = image_file::load(&sequence.frames[0])?;
        let mut tracker = Tracker::start(config.clone(), &picture.frame()?, first)?;
        for path in &sequence.frames[1..frame] {
            tracker.update(&image_file::load(path)?.frame()?)?;
        }
        // Through text, since a JSON value cannot hold the 128-bit numbers of the random generator.
        let saved: SavedTracker =
            serde_json::from_str(&serde_json::to_string(&tracker.snapshot())?)?;
        let (mut image, mut particles) = (GreyImage::default(), Vec::new());
        let picture = image_file::load(&sequence.frames[frame])?;
        image.fill(&picture.frame()?)?;
        let mut observer = |view: &FrameView<'_>| {
            if let FrameView::Paper(view) = view {
                particles = view.particles.to_vec();
            }
        };
        tracker.update_observed(&picture.frame()?, &mut observer)?;
        Ok(Self { config, memory: saved.track.target.paper.model, particles, image })
    }

    /// Times the coding of one scale, and writes the problems of the chosen particles.
    fn measure(&self, name: &str, chosen: &[usize], folder: &Path) -> Result<Value> {
        let (grid, templates, buffer) = self.parts(name);
        let scale = Scale::new(grid, self.params(), templates, buffer);
        let begin = Instant::now();
        let candidates = self.candidates();
        let warp_ms = begin.elapsed().as_secs_f64() * 1e3;
        let length = self.config.patches.template_side * self.config.patches.template_side;
        let which: Vec<u32> = (0..self.particles.len() as u32).collect();
        let (mut scratch, mut scores) = (CodingScratch::default(), PatchScores::default());
        scores.begin(which.len(), grid.locations());
        let mut found = vec![Default::default(); BLOCK];
        let template = |&k: &u32| &candidates[k as usize * length..][..length];
        let mut code_all = || {
            let begin = Instant::now();
            for location in 0..grid.locations() {
                for block in which.chunks(BLOCK) {
                    let found = &mut found[..block.len()];
                    scale.code_block(location, block.iter().map(template), &mut scratch, found);
                    scores.store(location, block, found);
                }
            }
            begin.elapsed().as_secs_f64() * 1e3
        };
        code_all(); // warm-up
        let mut times: Vec<f64> = (0..REPETITIONS).map(|_| code_all()).collect();
        times.sort_by(f64::total_cmp);
        self.write_problems(name, &candidates, &scores, chosen, folder)?;
        Ok(json!({
            "locations": grid.locations(), "warp_ms": warp_ms, "codes_ms": times[REPETITIONS / 2],
        }))
    }

    /// Writes the problems of the chosen particles, and the atoms of their codes.
    fn write_problems(
        &self,
        name: &str,
        candidates: &[f32],
        scores: &PatchScores,
        chosen: &[usize],
        folder: &Path,
    ) -> Result<()> {
        let (grid, templates, buffer) = self.parts(name);
        let length = self.config.patches.template_side * self.config.patches.template_side;
        fs::create_dir_all(folder)?;
        let dictionary: Vec<f32> = templates.iter().flat_map(|t| grid.cut_all(t)).collect();
        let by_location = |images: &[&[f32]]| -> Vec<f32> {
            let cut = |location: usize| {
                let mut patches = vec![0.0; images.len() * grid.dim()];
                grid.cut_each(images.iter().copied(), location, &mut patches);
                patches
            };
            (0..grid.locations()).flat_map(cut).collect()
        };
        let buffer: Vec<&[f32]> = buffer.iter().map(Vec::as_slice).collect();
        let shared = by_location(&buffer);
        let patches: Vec<f32> = chosen
            .iter()
            .flat_map(|&k| by_location(&[&candidates[k * length..][..length]]))
            .collect();
        let (dim, count) = (grid.dim(), grid.locations());
        write(folder, "dictionary", "<f4", &[dictionary.len() / dim, dim], &bytes(&dictionary))?;
        write(folder, "shared", "<f4", &[count, buffer.len(), dim], &bytes(&shared))?;
        write(folder, "patches", "<f4", &[chosen.len(), count, dim], &bytes(&patches))?;
        let atoms: Vec<i32> = chosen.iter().flat_map(|&k| self.atoms(scores, k)).collect();
        let atoms: Vec<u8> = atoms.into_iter().flat_map(i32::to_le_bytes).collect();
        write(folder, "atoms", "<i4", &[chosen.len(), count, self.config.patches.atoms], &atoms)?;
        Ok(())
    }

    /// The atoms of a candidate's codes, padded with -1.
    fn atoms(&self, scores: &PatchScores, candidate: usize) -> Vec<i32> {
        let count = self.config.patches.atoms;
        let one = |support: &[u32]| -> Vec<i32> {
            (0..count).map(|k| support.get(k).map_or(-1, |&atom| atom as i32)).collect()
        };
        scores.codes(candidate).flat_map(|code| one(code.support())).collect()
    }

    /// Patch grid, templates of the dictionary, and buffer of one scale.
    fn parts(&self, name: &str) -> (PatchGrid, &Templates, &Templates) {
        let (config, memory) = (&self.config, &self.memory);
        let patches = &config.patches;
        let grid =
            |patch, step| PatchGrid::new(patches.template_side, patch, step, patches.subtract_mean);
        match name {
            "large" => {
                let grid = grid(patches.large_patch, patches.large_step);
                (grid, &memory.templates, &memory.large_buffer)
            }
            _ => {
                let grid = grid(patches.small_patch, patches.small_step);
                (grid, &memory.small_templates, &memory.small_buffer)
            }
        }
    }

    /// The samples of all candidates, concatenated.
    fn candidates(&self) -> Vec<f32> {
        let side = self.config.patches.template_side;
        let mut all = vec![0.0; self.particles.len() * side * side];
        for (state, out) in self.particles.iter().zip(all.chunks_exact_mut(side * side)) {
            warp(&self.image, &state.matrix(), side, out);
            normalise(out);
        }
        all
    }

    fn params(&self) -> ScaleParams {
        let config = &self.config;
        ScaleParams {
            codes: CodeParams {
                atoms: config.patches.atoms,
                min_residual: config.patches.min_residual,
            },
            beta: config.beta,
            position_weights: config.position_weights,
            keeps_products: true,
        }
    }
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Writes an array in NumPy's `.npy` format, version 1.0.
fn write(folder: &Path, name: &str, kind: &str, shape: &[usize], data: &[u8]) -> Result<()> {
    let shape: String = shape.iter().map(|side| format!("{side}, ")).collect();
    let mut head =
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}").into_bytes();
    // With the 10 bytes of magic, version and length, the header fills whole blocks of 64 bytes.
    head.resize((head.len() + 11).next_multiple_of(64) - 11, b' ');
    head.push(b'\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((head.len() as u16).to_le_bytes());
    file.extend(head);
    file.extend(data);
    fs::write(folder.join(name).with_extension("npy"), file)?;
    Ok(())
}
