//! The square window around a place, and the sample that it shows: a patch, its features, their
//! spectra.

use super::RobustConfig;
use super::pose::Pose;
use crate::correlation::batch::Mask;
use crate::correlation::features::{FeatureScratch, Features};
use crate::correlation::fhog::CELL;
use crate::correlation::fourier::{Complex32, Fourier, smooth_side};
use crate::correlation::response::{Response, ResponseBuffers};
use crate::vision::crop::{Crop, CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use crate::vision::geometry::{BoundingBox, MAX_SIDE};
use serde::{Deserialize, Serialize};

/// The longest side of a window in cells.
const MAX_CELLS: usize = 512;

/// The square window around the target: its size in the frame, and the features that are taken from
/// it.
#[derive(Debug)]
pub(crate) struct Window {
    shape: WindowShape,
    features: Features,
    /// The cells of the target, inside which the filter may be other than zero.
    mask: Mask,
}

/// What the rest of a window follows from, and a snapshot holds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct WindowShape {
    /// Width and height of the target in the first frame.
    base: [f64; 2],
    /// Frame pixels per pixel of the patch, at scale 1.
    pixel: f64,
    /// Cells on a side of the patch.
    cells: usize,
    /// Whether patches have three planes, not one of grey.
    colour: bool,
}

/// The window around a place in one frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a> {
    /// The centre of the window, and its size and rotation.
    pub pose: Pose,
    /// The window that was cut out.
    pub window: &'a Window,
    /// Its pixels.
    pub patch: &'a Planes,
    /// The spectra of its features, bin by bin, the channels of a bin side by side.
    pub spectra: &'a [Complex32],
}

/// The buffers of a [`Sample`].
#[derive(Debug, Default)]
pub(crate) struct SampleBuffers {
    crop: CropScratch,
    patch: Planes,
    features: FeatureScratch,
    spectra: Vec<Complex32>,
}

impl Window {
    /// The window for a target in this box. Patches are in colour if there is colour in it.
    pub fn begin(
        frame: &Frame<'_>,
        bbox: BoundingBox,
        config: &RobustConfig,
        buffers: &mut SampleBuffers,
    ) -> Self {
        let base = [bbox.w, bbox.h];
        let side = config.search * (bbox.w * bbox.h).sqrt();
        let cells = smooth_side(config.patch / CELL as f64);
        let pixel = side / (cells * CELL) as f64;
        let size = [cells * CELL; 2];
        let crop = Crop { centre: bbox.centre(), scale: [pixel; 2], size, rotation: 0.0 };
        let mut colour = frame.has_colour();
        if colour {
            crop.cut(frame, 3, &mut buffers.crop, &mut buffers.patch);
            let [red, green, blue] = buffers.patch.rgb();
            colour = red != green || green != blue;
        }
        Self::of(WindowShape { base, pixel, cells, colour })
    }

    fn of(shape: WindowShape) -> Self {
        let WindowShape { base, pixel, cells, .. } = shape;
        let mask = Mask::middle(cells, base.map(|side| side / (pixel * CELL as f64)));
        Self { shape, features: Features::new(cells), mask }
    }

    /// What a snapshot holds of it.
    pub fn shape(&self) -> WindowShape {
        self.shape
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn restore(shape: WindowShape) -> Result<Self, &'static str> {
        let WindowShape { base, pixel, cells, .. } = shape;
        let patch = pixel * (cells * CELL) as f64;
        let is_size = base.iter().all(|side| (1.0..=MAX_SIDE).contains(side));
        if !(is_size && patch.is_finite() && patch > 0.0) {
            return Err("the target's first size is not a size");
        }
        if cells > MAX_CELLS || smooth_side(cells as f64) != cells {
            return Err("the number of cells is not one that the tracker uses");
        }
        Ok(Self::of(shape))
    }

    /// Width and height of the target in the first frame.
    pub fn base(&self) -> [f64; 2] {
        self.shape.base
    }

    /// Frame pixels per cell for a target of this scale.
    pub fn cell(&self, scale: f64) -> f64 {
        self.shape.pixel * scale * CELL as f64
    }

    /// Side of the window in the frame for a target of this scale.
    pub fn side(&self, scale: f64) -> f64 {
        self.cell(scale) * self.fourier().side() as f64
    }

    /// Width and height of the target in cells.
    pub fn cells(&self) -> [f64; 2] {
        self.base().map(|side| side / self.cell(1.0))
    }

    /// Width and height of the target in pixels of the patch.
    pub fn pixels(&self) -> [f64; 2] {
        self.cells().map(|cells| cells * CELL as f64)
    }

    /// Number of planes of a patch: 3 in colour, 1 in grey.
    pub fn planes(&self) -> usize {
        if self.shape.colour { 3 } else { 1 }
    }

    /// The transforms of a plane of cells.
    pub fn fourier(&self) -> &Fourier {
        self.features.fourier()
    }

    /// The cells of the filter that are held.
    pub fn mask(&self) -> &Mask {
        &self.mask
    }

    /// Length of what is held of the filter.
    pub fn filter(&self) -> usize {
        self.features.channels() * self.mask.len()
    }

    /// What the window around a place shows.
    pub fn sample<'a>(
        &'a self,
        frame: &Frame<'_>,
        pose: Pose,
        buffers: &'a mut SampleBuffers,
    ) -> Sample<'a> {
        let SampleBuffers { crop, patch, features, spectra } = buffers;
        let scale = [self.shape.pixel * pose.scale; 2];
        let (Pose { centre, rotation, .. }, size) = (pose, [self.features.side(); 2]);
        let part = Crop { centre, scale, size, rotation };
        part.cut(frame, self.planes(), crop, patch);
        self.features.spectra(patch, features, spectra);
        Sample { pose, window: self, patch, spectra }
    }
}

impl<'a> Sample<'a> {
    /// The target's region.
    pub fn region(&self) -> Region {
        self.pose.region(self.window.base())
    }

    /// The place at a displacement, in cells.
    pub fn pose_at(&self, shift: [f64; 2]) -> Pose {
        let cell = self.window.cell(self.pose.scale);
        self.pose.shifted(shift.map(|cells| cells * cell))
    }

    /// The response of a filter, of which these cells are held.
    pub fn respond<'b>(&self, filter: &[f32], buffers: &'b mut ResponseBuffers) -> Response<'b>
    where
        'a: 'b,
    {
        let filter = (filter, self.window.mask());
        Response::of_cells(self.window.fourier(), filter, self.spectra, buffers)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Cells on a side of [`window`].
    pub const SIDE: usize = 8;

    /// A grey window for a target of 2 x 3 cells, with 2 frame pixels per pixel of the patch.
    pub fn window() -> Window {
        let (cell, pixel) = (CELL as f64, 2.0);
        let base = [2.0 * cell * pixel, 3.0 * cell * pixel];
        Window::of(WindowShape { base, pixel, cells: SIDE, colour: false })
    }

    /// The cell in the middle, where [`impulse`] is.
    const MIDDLE: usize = SIDE / 2;

    /// A filter whose first channel is 1 in the middle, and 0 elsewhere as all others.
    pub fn impulse(window: &Window) -> Vec<f32> {
        let Mask { x, y } = window.mask();
        let cell = (MIDDLE - y.start) * x.len() + MIDDLE - x.start;
        let mut filter = vec![0.0; window.filter()];
        filter[cell * window.features.channels()] = 1.0;
        filter
    }

    /// Spectra whose first channel is that of a plane, displaced so that [`impulse`] responds with
    /// the plane; all others are 0.
    pub fn spectra(window: &Window, plane: &[f32]) -> Vec<Complex32> {
        let (fourier, channels) = (window.fourier(), window.features.channels());
        let from = |k: usize| (k % SIDE + MIDDLE) % SIDE + (k / SIDE + MIDDLE) % SIDE * SIDE;
        let plane: Vec<f32> = (0..plane.len()).map(|k| plane[from(k)]).collect();
        let mut first = vec![Complex32::ZERO; fourier.bins()];
        fourier.forward(&plane, &mut first, &mut Default::default());
        let mut all = vec![Complex32::ZERO; channels * first.len()];
        all.chunks_exact_mut(channels).zip(&first).for_each(|(bin, value)| bin[0] = *value);
        all
    }

    /// A plane that is 0 but for these cells.
    pub fn plane(values: &[(usize, f32)]) -> Vec<f32> {
        let mut plane = vec![0.0; SIDE * SIDE];
        values.iter().for_each(|&(cell, value)| plane[cell] = value);
        plane
    }

    #[test]
    fn sizes_in_cells_pixels_and_frame_pixels_agree() {
        let window = window();
        let cell = 2.0 * CELL as f64;
        assert_eq!((window.cell(1.0), window.cell(1.5)), (cell, 1.5 * cell));
        assert_eq!(window.side(0.5), 0.5 * cell * SIDE as f64);
        assert_eq!(window.cells(), [2.0, 3.0]);
        assert_eq!(window.pixels(), [2.0 * CELL as f64, 3.0 * CELL as f64]);
    }

    #[test]
    fn a_displacement_in_cells_is_a_place() {
        let (window, patch) = (window(), Planes::default());
        let pose = Pose { centre: [50.0, 40.0], scale: 1.5, rotation: 0.0 };
        let sample = Sample { pose, window: &window, patch: &patch, spectra: &[] };
        let cell = 3.0 * CELL as f64;
        let moved = Pose { centre: [50.0 + cell, 40.0 - 0.5 * cell], ..pose };
        assert_eq!(sample.pose_at([1.0, -0.5]), moved);
    }

    #[test]
    fn the_response_to_an_impulse_is_the_filters_plane() {
        let (window, patch) = (window(), Planes::default());
        let sample = spectra(&window, &plane(&[(10, 2.0), (0, -1.0)]));
        let pose = Pose { centre: [0.0; 2], scale: 1.0, rotation: 0.0 };
        let sample = Sample { pose, window: &window, patch: &patch, spectra: &sample };
        let mut buffers = ResponseBuffers::default();
        let filter = impulse(&window);
        let response = sample.respond(&filter, &mut buffers);
        assert!((response.cells()[10] - 2.0).abs() < 1e-6);
        assert!((response.cells()[0] + 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_damaged_window_is_refused() {
        let good = window().shape();
        assert_eq!(Window::restore(good).unwrap().shape(), good);
        for damaged in [
            WindowShape { base: [0.5, 10.0], ..good },
            WindowShape { base: [10.0, f64::NAN], ..good },
            WindowShape { pixel: -1.0, ..good },
            WindowShape { cells: 11, ..good },
            WindowShape { cells: 1024, ..good },
        ] {
            assert!(Window::restore(damaged).is_err(), "{damaged:?}");
        }
    }
}
