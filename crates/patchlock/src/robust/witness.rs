//! The witness: a network of the user, which sees the target where the filters do not.

use super::place::Place;
use crate::network::Network;
use crate::network::look::{self, Buffers};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use crate::vision::geometry::{BoundingBox, MAX_SIDE};
use serde::{Deserialize, Serialize};

/// The box of a network differs from that of the user at most by this factor: a larger difference
/// means another object.
const MOST_FACTOR: f64 = 2.0;

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
    /// Width and height of the target, relative to those that the network sees.
    factor: [f64; 2],
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
        let template = family.template(frame, border, place, buffers)?;
        family.look(frame, border, &template, place, buffers)?;
        let seen = buffers.look.places[family.settle(&buffers.look, place).cell];
        let factor = [0, 1].map(|k| {
            let factor = place.size[k] / seen.size[k];
            factor.clamp(1.0 / MOST_FACTOR, MOST_FACTOR).powf(fit)
        });
        let (hash, base) = (network.hash().to_owned(), [bbox.w, bbox.h]);
        let learnt = SavedWitness { network: hash, border, template, base, factor };
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
        let SavedWitness { border, template, base, factor, .. } = &saved;
        let numbers = border.iter().chain(template).all(|number| number.is_finite());
        let sides = base.iter().all(|side| (1.0..=MAX_SIDE).contains(side));
        let factors = factor.iter().all(|f| (1.0 / MOST_FACTOR..=MOST_FACTOR).contains(f));
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
        let last = self.fill(frame, around, buffers)?;
        for place in &mut buffers.look.places {
            place.size = [0, 1].map(|k| place.size[k] * factor[k]);
        }
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

    /// Looks at the window around a place, which is returned as the network understands it.
    fn fill(
        &self,
        frame: &Frame<'_>,
        around: Place,
        buffers: &mut Buffers,
    ) -> Result<look::Place, NetworkError> {
        let SavedWitness { border, template, base, .. } = &self.learnt;
        let last = look::Place::of(around.bbox(*base));
        self.network.family().look(frame, *border, template, last, buffers)?;
        Ok(last)
    }
}
