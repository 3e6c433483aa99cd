//! Input data of the benchmarks: a rendered scene, processed with the paper's settings.

use patchlock::paper::motion::Motion;
use patchlock::paper::particles::Particles;
use patchlock::patch_model::sparse::codes::CodeParams;
use patchlock::patch_model::sparse::dictionary::Dictionary;
use patchlock::patch_model::{buffer, templates};
use patchlock::vision::frame::GreyImage;
use patchlock::vision::patches::{PatchGrid, normalise};
use patchlock::vision::warp;
use patchlock::{BoundingBox, Frame, PaperConfig, State};
use patchlock_scene::{Scene, SceneFrame};
use rand_pcg::Pcg64;

pub const SIDE: usize = 32;
pub const PARTICLES: usize = 650;
/// The centre of the small scale's 13 x 13 locations.
pub const LOCATION: usize = 84;
pub const PARAMS: CodeParams = CodeParams { atoms: 4, min_residual: 1e-6 };

/// A frame of the rendered scene, with the particles and templates of the paper's settings.
pub struct Bench {
    pub image: GreyImage,
    pub particles: Vec<State>,
    pub templates: Vec<Vec<f32>>,
}

impl Bench {
    pub fn new() -> Self {
        let scene = Scene::demo();
        let mut image = GreyImage::default();
        image.fill(&view(&scene.frame(0))).unwrap();
        let state = first_state(&scene);
        let motion = Motion::new(&PaperConfig::default(), [image.width(), image.height()]);
        let mut drawn = Particles::default();
        drawn.draw(PARTICLES, &state, &motion, &mut Pcg64::new(7, 1));
        let templates = templates::shifts(10)
            .into_iter()
            .map(|[dx, dy]| {
                let state = State { x: state.x + dx, y: state.y + dy, ..state };
                candidate(&image, &state)
            })
            .collect();
        Self { image, particles: drawn.states().to_vec(), templates }
    }

    /// The state of the target in the frame.
    pub fn first(&self) -> State {
        first_state(&Scene::demo())
    }

    pub fn candidates(&self) -> Vec<f32> {
        self.particles.iter().flat_map(|state| candidate(&self.image, state)).collect()
    }

    pub fn dictionary(&self, grid: &PatchGrid) -> Dictionary {
        let atoms = self.templates.iter().flat_map(|template| grid.cut_all(template)).collect();
        Dictionary::new(grid.dim(), grid.locations(), atoms)
    }

    /// The patches at [`LOCATION`] of the templates in `of`.
    pub fn patches<'a>(&self, grid: &PatchGrid, of: impl Iterator<Item = &'a [f32]>) -> Vec<f32> {
        of.flat_map(|template| {
            let mut patch = vec![0.0; grid.dim()];
            grid.cut(template, LOCATION, &mut patch);
            patch
        })
        .collect()
    }

    /// The dictionary, the buffer's patches and the candidates' patches at one location of the
    /// small scale.
    pub fn problems(&self) -> (Dictionary, Vec<f32>, Vec<f32>) {
        let grid = small();
        let buffer = buffer::begin(&self.templates, 4);
        let shared = self.patches(&grid, buffer.iter().map(Vec::as_slice));
        let candidates = self.candidates();
        let patches = self.patches(&grid, candidates.chunks_exact(SIDE * SIDE));
        (self.dictionary(&grid), shared, patches)
    }
}

fn first_state(scene: &Scene) -> State {
    let first = truth(scene);
    State::from_box(first.centre(), first.w, first.h, SIDE)
}

pub fn small() -> PatchGrid {
    PatchGrid::new(SIDE, 8, 2, false)
}

pub fn view(frame: &SceneFrame) -> Frame<'_> {
    Frame::rgb8(&frame.rgb, frame.width, frame.height).unwrap()
}

pub fn truth(scene: &Scene) -> BoundingBox {
    let [x, y, w, h] = scene.truth(0).bbox;
    BoundingBox { x, y, w, h }
}

pub fn candidate(image: &GreyImage, state: &State) -> Vec<f32> {
    let mut out = vec![0.0; SIDE * SIDE];
    warp::warp(image, &state.matrix(), SIDE, &mut out);
    normalise(&mut out);
    out
}
