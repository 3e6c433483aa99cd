//! The witness: a network of the user, which sees the target where the filters do not.

use super::place::Place;
use crate::network::Network;
use crate::network::family::Family;
use crate::network::look::{self, Buffers};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use crate::vision::geometry::{BoundingBox, MAX_SIDE};
use serde::{Deserialize, Serialize};

/// The box of a network differs from that of the user at most by this factor: a larger difference
/// means another object.
const MOST_FACTOR: f64 = 2.0;

/// Share of the way, on a logarithmic scale, from the user's box to the one that the network sees, to
/// the width and height for which its windows are cut. Measured:
/// `benchmarks/record/2026-11-27-own-window.md`.
const OWN: f64 = 0.5;

/// The windows in which the network looks at the target in the first frame: moved by this many
/// [`MOVED`] along x and y, and larger by this power of [`LARGER`]. One look depends on where the
/// target lies in its window; their mean hardly does.
const LOOKS: [[i32; 3]; 11] = [
    [0, 0, 0],
    [1, 0, 0],
    [-1, 0, 0],
    [0, 1, 0],
    [0, -1, 0],
    [0, 0, 1],
    [0, 0, -1],
    [1, 1, 1],
    [-1, -1, -1],
    [1, -1, -1],
    [-1, 1, 1],
];

/// In roots of the target's area.
const MOVED: f64 = 0.2;

const LARGER: f64 = 1.12;

/// A network that has seen the target.
#[derive(Debug)]
pub(crate) struct Witness {
    network: Network,
    learnt: SavedWitness,
}

/// A witness as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedWitness {
    /// The hash of the network.
    network: String,
    /// The mean colour of the first frame, which is seen beyond the frame's border.
    border: [f32; 3],
    template: Vec<f32>,
    /// Width and height of the target in the first frame.
    base: [f64; 2],
    /// Width and height for which its windows are cut, relative to those of the target.
    window: [f64; 2],
    /// Width and height of the target, relative to those that the network sees.
    factor: [f64; 2],
}

/// The first frame, as a network looks at it.
struct First<'a> {
    family: &'a dyn Family,
    frame: &'a Frame<'a>,
    border: [f32; 3],
}

/// What a network sees in the window around a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    /// Where it sees the target; the size follows by the rules that were published with it.
    pub place: Place,
    /// Width and height of the target as it sees them.
    pub size: [f64; 2],
    /// The share of the way to this size that its rules go.
    pub rate: f64,
    /// The logarithm of the odds that the target is there, as they were fitted for this network.
    pub odds: f64,
}

impl First<'_> {
    /// Width and height of the target at a place as the network sees them, relative to those of the
    /// place, as logarithms: the mean over its looks.
    fn seen(&self, place: look::Place, buffers: &mut Buffers) -> Result<[f64; 2], NetworkError> {
        let Self { family, frame, border } = *self;
        let mut mean = [0.0; 2];
        let template = family.template(frame, border, place, buffers)?;
        let moved = MOVED * (place.size[0] * place.size[1]).sqrt();
        for [x, y, larger] in LOOKS {
            let [cx, cy] = place.centre;
            let centre = [cx + f64::from(x) * moved, cy + f64::from(y) * moved];
            let around = look::Place { centre, ..place }.scaled([LARGER.powi(larger); 2]);
            family.look(frame, border, &template, around, buffers)?;
            let seen = buffers.look.places[family.settle(&buffers.look, around).cell];
            for (mean, (seen, own)) in mean.iter_mut().zip(seen.size.iter().zip(place.size)) {
                let ratio = (seen / own).clamp(1.0 / MOST_FACTOR, MOST_FACTOR);
                *mean += ratio.ln() / LOOKS.len() as f64;
            }
        }
        Ok(mean)
    }
}

impl Witness {
    /// A witness that has seen the target in this box of the first frame. Networks are trained on
    /// boxes that are wider or narrower than those of a user; `fit` is the share of the difference,
    /// on a logarithmic scale, that is taken out of all later boxes.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn begin(
        network: &Network,
        frame: &Frame<'_>,
        bbox: BoundingBox,
        fit: f64,
        buffers: &mut Buffers,
    ) -> Result<Self, NetworkError> {
        let (place, border, family) =
            (look::Place::of(bbox), frame.mean_colour(), network.family());
        let seen = First { family, frame, border }.seen(place, buffers)?;
        let window = seen.map(|seen| (OWN * seen).exp());
        let template = family.template(frame, border, place.scaled(window), buffers)?;
        let factor = seen.map(|seen| (-fit * seen).exp().clamp(1.0 / MOST_FACTOR, MOST_FACTOR));
        let (hash, base) = (network.hash().to_owned(), [bbox.w, bbox.h]);
        let learnt = SavedWitness { network: hash, border, template, base, window, factor };
        Ok(Self { network: network.clone(), learnt })
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedWitness {
        self.learnt.clone()
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// The network is missing or another one, or the numbers do not fit it.
    pub fn restore(saved: SavedWitness, network: Option<&Network>) -> Result<Self, crate::Error> {
        let network =
            network.filter(|network| network.hash() == saved.network).ok_or_else(|| {
                let given = network.map(|network| network.hash().to_owned());
                NetworkError::Other { needed: saved.network.clone(), given }
            })?;
        let SavedWitness { border, template, base, window, factor, .. } = &saved;
        let numbers = border.iter().chain(template).all(|number| number.is_finite());
        let sides = base.iter().all(|side| (1.0..=MAX_SIDE).contains(side));
        let mut factors = window.iter().chain(factor);
        let factors = factors.all(|f| (1.0 / MOST_FACTOR..=MOST_FACTOR).contains(f));
        if !(numbers && sides && factors && template.len() == network.family().template_length()) {
            return Err(crate::error::snapshot("what its network has learnt is damaged"));
        }
        Ok(Self { network: network.clone(), learnt: saved })
    }

    /// Where it sees the target in the window around a place.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn look(
        &self,
        frame: &Frame<'_>,
        around: Place,
        buffers: &mut Buffers,
    ) -> Result<Sight, NetworkError> {
        let SavedWitness { base, factor, .. } = self.learnt;
        self.fill(frame, around, buffers)?;
        for place in &mut buffers.look.places {
            place.size = [0, 1].map(|k| place.size[k] * factor[k]);
        }
        let last = look::Place::of(around.bbox(base));
        let settled = self.network.family().settle(&buffers.look, last);
        let [size, seen] = [settled.place, buffers.look.places[settled.cell]].map(|p| p.size);
        let centre = settled.place.bbox().centre();
        let place = Place { centre, ..around }.sized(size, base);
        let odds = self.network.family().odds(buffers.look.logits[settled.cell]);
        Ok(Sight { place, size: seen, rate: settled.rate, odds })
    }

    /// How it judges a target at this very place: the logarithm of the odds.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn examine(
        &self,
        frame: &Frame<'_>,
        place: Place,
        buffers: &mut Buffers,
    ) -> Result<f64, NetworkError> {
        self.fill(frame, place, buffers)?;
        Ok(self.network.family().odds(buffers.look.centre_logit()))
    }

    /// Looks at the window around a place.
    fn fill(
        &self,
        frame: &Frame<'_>,
        around: Place,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        let SavedWitness { border, template, base, window, .. } = &self.learnt;
        let own = look::Place::of(around.bbox(*base)).scaled(*window);
        self.network.family().look(frame, *border, template, own, buffers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::look::{Look, Settled};

    const BOX: look::Place = look::Place { centre: [50.0, 40.0], size: [30.0, 20.0] };

    /// A network that sees a box of this size, times `tilt` to the power of the pixels by which the
    /// window is moved right and down of [`BOX`], and divided by how much larger it is.
    #[derive(Debug)]
    struct Seeing {
        size: [f64; 2],
        tilt: f64,
    }

    impl Family for Seeing {
        fn name(&self) -> &'static str {
            "made up"
        }

        fn template(
            &self,
            _: &Frame<'_>,
            _: [f32; 3],
            place: look::Place,
            _: &mut Buffers,
        ) -> Result<Vec<f32>, NetworkError> {
            Ok(vec![place.size[0] as f32])
        }

        fn template_length(&self) -> usize {
            1
        }

        fn look(
            &self,
            _: &Frame<'_>,
            _: [f32; 3],
            template: &[f32],
            place: look::Place,
            buffers: &mut Buffers,
        ) -> Result<(), NetworkError> {
            assert_eq!(template, [BOX.size[0] as f32], "the template is that of the user's box");
            let moved = place.centre[0] - BOX.centre[0] + place.centre[1] - BOX.centre[1];
            let factor = self.tilt.powf(moved) * BOX.size[0] / place.size[0];
            let seen = look::Place { size: self.size, ..place }.scaled([factor; 2]);
            buffers.look = Look { scores: vec![1.0], logits: vec![0.0], places: vec![seen] };
            Ok(())
        }

        fn odds(&self, logit: f64) -> f64 {
            logit
        }

        fn settle(&self, look: &Look, _: look::Place) -> Settled {
            Settled { place: look.places[0], score: 1.0, cell: 0, rate: 1.0 }
        }
    }

    fn seen(size: [f64; 2], tilt: f64) -> [f64; 2] {
        let pixels = [0; 4];
        let frame = Frame::grey8(&pixels, 2, 2).unwrap();
        let first = First { family: &Seeing { size, tilt }, frame: &frame, border: [0.0; 3] };
        first.seen(BOX, &mut Buffers::default()).unwrap()
    }

    #[test]
    fn errors_that_depend_on_the_window_cancel_out() {
        for tilt in [1.0, 1.02, 0.99] {
            let [w, h] = seen([40.0, 15.0], tilt);
            let wanted = [(40.0 / 30.0_f64).ln(), (15.0 / 20.0_f64).ln()];
            assert!((w - wanted[0]).abs() < 1e-12 && (h - wanted[1]).abs() < 1e-12, "{w} {h}");
        }
    }

    #[test]
    fn a_box_that_is_far_larger_or_smaller_counts_as_twice_or_half() {
        let [w, h] = seen([3000.0, 0.2], 1.0);
        assert!((w - MOST_FACTOR.ln()).abs() < 1e-12 && (h + MOST_FACTOR.ln()).abs() < 1e-12);
    }
}
