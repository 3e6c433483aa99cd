//! Where the target is, and the window around it that filters see.

use super::Scratch;
use crate::config::RobustConfig;
use crate::correlation::features::Features;
use crate::correlation::fhog::CELL;
use crate::correlation::fourier::smooth_side;
use crate::vision::crop::{Crop, Region};
use crate::vision::frame::Frame;
use crate::vision::geometry::{BoundingBox, Point};
use serde::{Deserialize, Serialize};

/// The smallest side of a target to which its scale may shrink, in pixels.
const LEAST_SIDE: f64 = 5.0;

/// Where the target is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    /// The centre in the frame.
    pub centre: Point,
    /// The target's size, relative to the first frame.
    pub scale: f64,
    /// By how much the target has turned since the first frame, in radians: from x towards y, so clockwise as
    /// seen.
    pub rotation: f64,
}

impl Place {
    /// Width and height of a target with this size in the first frame.
    pub fn size(self, base: [f64; 2]) -> [f64; 2] {
        base.map(|side| side * self.scale)
    }

    /// The target's region, if it had this size in the first frame.
    pub fn region(self, base: [f64; 2]) -> Region {
        Region { centre: self.centre, size: self.size(base), rotation: self.rotation }
    }

    /// Moves the centre by this many frame pixels along the target's own axes.
    pub fn shift(&mut self, [dx, dy]: [f64; 2]) {
        let (sin, cos) = self.rotation.sin_cos();
        self.centre[0] += cos * dx - sin * dy;
        self.centre[1] += sin * dx + cos * dy;
    }

    /// Moves the centre into the frame and limits the size to what the frame can show.
    pub fn keep_within(&mut self, frame: &Frame<'_>, base: [f64; 2]) {
        let size = [frame.width() as f64, frame.height() as f64];
        for (centre, side) in self.centre.iter_mut().zip(size) {
            *centre = centre.clamp(0.0, side - 1.0);
        }
        let least = (LEAST_SIDE / base[0].min(base[1])).min(1.0);
        let most = (size[0] / base[0]).min(size[1] / base[1]).max(1.0);
        self.scale = self.scale.clamp(least, most);
    }
}

/// The square window around the target: its features, and its size in the frame.
#[derive(Debug)]
pub(crate) struct Window {
    base: [f64; 2],
    /// Frame pixels per pixel of the patch, at scale 1.
    pixel: f64,
    /// Whether patches have three planes, not one of grey.
    colour: bool,
    features: Features,
}

impl Window {
    /// The window for a target in this box. Patches are in colour if there is colour in it.
    pub fn begin(
        frame: &Frame<'_>,
        bbox: BoundingBox,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> Self {
        let base = [bbox.w, bbox.h];
        let side = config.search * (bbox.w * bbox.h).sqrt();
        let patch = side.clamp(config.min_patch, config.max_patch.max(config.min_patch));
        let n = smooth_side(patch / CELL as f64);
        let pixel = side / (n * CELL) as f64;
        let size = [n * CELL; 2];
        let crop = Crop { centre: bbox.centre(), scale: [pixel; 2], size, rotation: 0.0 };
        let mut colour = frame.has_colour();
        if colour {
            crop.cut(frame, 3, &mut scratch.crop, &mut scratch.patch);
            let [red, green, blue] = [0, 1, 2].map(|plane| scratch.patch.plane(plane));
            colour = red != green || green != blue;
        }
        Self::new(base, pixel, colour, n)
    }

    /// A window with `n` cells on a side.
    pub fn new(base: [f64; 2], pixel: f64, colour: bool, n: usize) -> Self {
        Self { base, pixel, colour, features: Features::new(n) }
    }

    /// Width and height of the target in the first frame.
    pub fn base(&self) -> [f64; 2] {
        self.base
    }

    /// Frame pixels per pixel of the patch, at scale 1.
    pub fn pixel(&self) -> f64 {
        self.pixel
    }

    /// Frame pixels per cell for a target of this scale.
    pub fn cell(&self, scale: f64) -> f64 {
        self.pixel * scale * CELL as f64
    }

    /// Side of the window in the frame for a target of this scale.
    pub fn side(&self, scale: f64) -> f64 {
        self.cell(scale) * self.features.fourier().side() as f64
    }

    /// Width and height of the target in cells.
    pub fn cells(&self) -> [f64; 2] {
        self.base.map(|side| side / self.cell(1.0))
    }

    pub fn features(&self) -> &Features {
        &self.features
    }

    /// Whether patches are in colour.
    pub fn colour(&self) -> bool {
        self.colour
    }

    /// Width and height of the target in pixels of the patch.
    pub fn pixels(&self) -> [f64; 2] {
        self.cells().map(|cells| cells * CELL as f64)
    }

    /// Number of planes of a patch.
    pub fn planes(&self) -> usize {
        if self.colour { 3 } else { 1 }
    }

    /// Fills `scratch.sample` with the spectra of the window around a place.
    pub fn sample(&self, frame: &Frame<'_>, place: Place, scratch: &mut Scratch) {
        let Scratch { crop, patch, features, sample, .. } = scratch;
        let scale = [self.pixel * place.scale; 2];
        let (Place { centre, rotation, .. }, size) = (place, [self.features.side(); 2]);
        let part = Crop { centre, scale, size, rotation };
        part.cut(frame, self.planes(), crop, patch);
        self.features.spectra(patch, features, sample);
    }
}
