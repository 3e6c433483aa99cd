//! The method `network`: the loop that was published with the network. It looks at the window
//! around the last place and moves to where the network sees the target. PatchNet learns: its template
//! follows the target, and a classifier has a say in where it is. Boxes are judged by the template of
//! the first frame, which cannot drift.

mod classifier;
mod config;
mod view;

use crate::estimate::{Estimate, Status};
use crate::network::predictions::{Buffers, CentredBox, logistic};
use crate::network::{Network, TemplateUpdate};
use crate::network_error::NetworkError;
use crate::numeric::numbers::Numbers;
use crate::target_tracker::{Input, Start, TargetTracker, ViewSink};
use crate::vision::frame::{Frame, FrameSize};
use crate::vision::geometry::{BoundingBox, MAX_SIDE};
use crate::{Error, error};
use classifier::{Classifier, ClassifierScratch, Label};
pub use config::NetworkConfig;
use serde::{Deserialize, Serialize};
pub use view::NetworkView;

/// The shortest side of a target, in pixels.
const MIN_SIDE: f64 = 10.0;

/// The first box of a network differs from that of the user at most by this factor: a larger
/// difference means another object.
const MOST_FACTOR: f64 = 2.0;

/// The share of the classifier in the score of a cell.
const CLASSIFIER_SHARE: f64 = 0.6;

/// A target of the method `network`.
#[derive(Debug)]
pub(crate) struct NetworkTarget {
    network: Network,
    place: CentredBox,
    /// The mean colour of the first frame, which is seen beyond the frame's border.
    border: [f32; 3],
    template: Template,
    /// `None` for networks that are used as published.
    classifier: Option<Classifier>,
    /// Width and height of its boxes, relative to those that the network sees.
    factor: [f64; 2],
    config: NetworkConfig,
}

/// What the network keeps of the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Template {
    /// That of the first frame, by which boxes are judged.
    first: Vec<f32>,
    /// The one that is searched for: `first`, or its mixture with those of later frames.
    current: Vec<f32>,
}

/// Buffers, shared by all targets of a thread.
#[derive(Debug, Default)]
pub(crate) struct NetworkScratch {
    buffers: Buffers,
    /// The template of the current frame.
    seen: Vec<f32>,
    classifier: ClassifierScratch,
    /// What the classifier says of each cell.
    response: Vec<f64>,
}

/// A target between two frames, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedNetwork {
    /// The hash of the network.
    network: String,
    place: CentredBox,
    border: [f32; 3],
    template: Template,
    classifier: Option<Numbers>,
    factor: [f64; 2],
}

impl Template {
    /// Mixes in the template of a frame.
    fn add(&mut self, seen: &[f32], update: TemplateUpdate) {
        let TemplateUpdate { share, rate, .. } = update;
        for ((current, &first), &seen) in self.current.iter_mut().zip(&self.first).zip(seen) {
            *current += rate * (first + share * (seen - first) - *current);
        }
    }
}

impl NetworkTarget {
    /// Begins on the target in this box of the first frame. Networks are trained on boxes that are
    /// wider or narrower than those of a user; `fit` is the share of the difference, on a
    /// logarithmic scale, that is taken out of all later boxes.
    ///
    /// # Errors
    /// [`NetworkError::None`] if there is no network; [`NetworkError::Runtime`] if it fails.
    pub fn fitted(
        start: Start<'_>,
        (config, fit): (&NetworkConfig, f64),
        scratch: &mut NetworkScratch,
    ) -> Result<(Self, Estimate), NetworkError> {
        let Start { input: Input { frame, .. }, bbox, network, .. } = start;
        let network = network.ok_or(NetworkError::None)?;
        let (place, border) = (CentredBox::of(bbox), frame.mean_colour());
        let (family, buffers) = (network.family(), &mut scratch.buffers);
        let mut first = Vec::new();
        family.template(frame, border, place, buffers, &mut first)?;
        if fit > 0.0 || family.channels().is_some() {
            family.predict(frame, border, &first, place, buffers)?;
        }
        let classifier = family.features(buffers, place).map(|map| {
            let label = Label { centre: [0.0; 2], size: place.size.map(|side| side / map.spacing) };
            Classifier::begin(&map, label, &mut scratch.classifier)
        });
        let mut factor = [1.0; 2];
        if fit > 0.0 {
            let seen = buffers.predictions.places[family.detect(&buffers.predictions, place).cell];
            factor = [0, 1].map(|k| {
                let factor = place.size[k] / seen.size[k];
                factor.clamp(1.0 / MOST_FACTOR, MOST_FACTOR).powf(fit)
            });
        }
        let template = Template { current: first.clone(), first };
        let (network, config) = (network.clone(), config.clone());
        let target = Self { network, place, border, template, classifier, factor, config };
        let mut estimate = Estimate::empty();
        fill(place, 1.0, Status::Tracked, &mut estimate);
        Ok((target, estimate))
    }

    /// The name of its network.
    pub fn name(&self) -> &'static str {
        self.network.name()
    }

    /// Gives the classifier its share in the scores.
    fn classify(&self, scratch: &mut NetworkScratch) {
        let NetworkScratch { buffers, classifier, response, .. } = scratch;
        let map = self.network.family().features(buffers, self.place);
        let (Some(own), Some(map)) = (&self.classifier, map) else { return };
        own.classify(&map, classifier, response);
        for (score, response) in buffers.predictions.scores.iter_mut().zip(response) {
            *score += CLASSIFIER_SHARE * (*response - *score);
        }
    }

    /// Learns what the target looks like at this place of the frame.
    fn learn(
        &mut self,
        frame: &Frame<'_>,
        place: CentredBox,
        update: TemplateUpdate,
        scratch: &mut NetworkScratch,
    ) -> Result<(), NetworkError> {
        let NetworkScratch { buffers, seen, classifier, .. } = scratch;
        let family = self.network.family();
        let spacing = family.features(buffers, self.place).map_or(1.0, |map| map.spacing);
        family.template(frame, self.border, place, buffers, seen)?;
        self.template.add(seen, update);
        if let Some(own) = &mut self.classifier {
            let centre = [0, 1].map(|k| (place.centre[k] - self.place.centre[k]) / spacing);
            own.learn(Label { centre, size: place.size.map(|side| side / spacing) }, classifier);
        }
        Ok(())
    }
}

impl TargetTracker for NetworkTarget {
    type Config = NetworkConfig;
    type Scratch = NetworkScratch;
    type Snapshot = SavedNetwork;
    type View<'a> = NetworkView<'a>;

    fn begin(
        start: Start<'_>,
        config: &NetworkConfig,
        scratch: &mut NetworkScratch,
    ) -> Result<(Self, Estimate), Error> {
        Ok(Self::fitted(start, (config, 0.0), scratch)?)
    }

    // On an error nothing has changed.
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut NetworkScratch,
        show: ViewSink<'_, Self>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let frame = input.frame;
        let family = self.network.family();
        family.predict(
            frame,
            self.border,
            &self.template.current,
            self.place,
            &mut scratch.buffers,
        )?;
        self.classify(scratch);
        let detected = family.detect(&scratch.buffers.predictions, self.place);
        if let Some(show) = show {
            show(NetworkView::of(&scratch.buffers.predictions, detected));
        }
        let place = within(detected.place, frame.size());
        let mut log_odds = family.odds(scratch.buffers.predictions.logits[detected.cell]);
        if let Some(update) = family.template_update() {
            family.compare(&self.template.first, self.place, &mut scratch.buffers)?;
            log_odds = family.odds(scratch.buffers.predictions.logit_near(detected.cell));
            if detected.score > update.min_score {
                self.learn(frame, place, update, scratch)?;
            }
        }
        self.place = place;
        let size = [0, 1].map(|k| place.size[k] * self.factor[k]);
        let (score, found) = (logistic(log_odds), CentredBox { size, ..place });
        fill(found, score, status(score, &self.config), estimate);
        Ok(())
    }

    fn log_odds_at(
        &self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
        scratch: &mut NetworkScratch,
    ) -> Result<Option<f64>, NetworkError> {
        let (family, NetworkScratch { buffers, .. }) = (self.network.family(), scratch);
        let (border, template) = (self.border, &self.template.first);
        family.predict(frame, border, template, CentredBox::of(bbox), buffers)?;
        Ok(Some(family.odds(buffers.predictions.centre_logit())))
    }

    fn saved(&self) -> SavedNetwork {
        SavedNetwork {
            network: self.network.hash().to_owned(),
            place: self.place,
            border: self.border,
            template: self.template.clone(),
            classifier: self.classifier.as_ref().map(Classifier::saved),
            factor: self.factor,
        }
    }

    fn restore(
        saved: SavedNetwork,
        config: &NetworkConfig,
        network: Option<&Network>,
    ) -> Result<Self, Error> {
        let SavedNetwork { network: needed, place, border, template, classifier, factor } = saved;
        let Some(network) = network.filter(|network| network.hash() == needed) else {
            let given = network.map(|network| network.hash().to_owned());
            return Err(NetworkError::Other { needed, given }.into());
        };
        let Template { first, current } = &template;
        let numbers = border.iter().chain(first).chain(current).all(|number| number.is_finite());
        let factors = factor.iter().all(|f| (1.0 / MOST_FACTOR..=MOST_FACTOR).contains(f));
        let is_place = place.is_sound() && place.size.iter().all(|&side| side <= MAX_SIDE);
        if !(is_place && numbers && factors) {
            return Err(error::snapshot("a number of its target is out of range"));
        }
        let length = network.family().template_length();
        if [&template.first, &template.current].iter().any(|numbers| numbers.len() != length) {
            return Err(error::snapshot("its template has another length than its network's"));
        }
        let channels = network.family().channels();
        let classifier = classifier.zip(channels).and_then(|(c, n)| Classifier::restore(c, n));
        if classifier.is_some() != channels.is_some() {
            let reason = "its classifier does not fit its network";
            return Err(error::snapshot(reason));
        }
        let (network, config) = (network.clone(), config.clone());
        Ok(Self { network, place, border, template, classifier, factor, config })
    }
}

/// The place, with its centre in the frame and sides that a target can have.
fn within(place: CentredBox, frame: FrameSize) -> CentredBox {
    let lengths = [frame.width, frame.height].map(|length| length as f64);
    let limit = |side: f64, length: f64| side.clamp(MIN_SIDE, length.max(MIN_SIDE));
    CentredBox {
        centre: [0, 1].map(|axis| place.centre[axis].clamp(0.0, lengths[axis])),
        size: [0, 1].map(|axis| limit(place.size[axis], lengths[axis])),
    }
}

fn status(score: f64, config: &NetworkConfig) -> Status {
    match score {
        score if score >= config.tracked_score => Status::Tracked,
        score if score >= config.lost_score => Status::Uncertain,
        _ => Status::Lost,
    }
}

fn fill(place: CentredBox, score: f64, status: Status, out: &mut Estimate) {
    let bbox = place.bbox();
    let (right, bottom) = (bbox.x + bbox.w - 1.0, bbox.y + bbox.h - 1.0);
    out.bbox = bbox;
    out.corners = [[bbox.x, bbox.y], [right, bbox.y], [right, bottom], [bbox.x, bottom]];
    (out.score, out.status, out.visibility) = (score, status, None);
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: FrameSize = FrameSize { width: 100, height: 60 };

    #[test]
    fn a_place_stays_in_the_frame_with_a_size_that_a_target_can_have() {
        for (centre, size, wanted_centre, wanted_size) in [
            ([50.0, 30.0], [20.0, 15.0], [50.0, 30.0], [20.0, 15.0]),
            ([-9.0, 70.0], [20.0, 15.0], [0.0, 60.0], [20.0, 15.0]),
            ([1e300, -1e300], [20.0, 15.0], [100.0, 0.0], [20.0, 15.0]),
            ([50.0, 30.0], [3.0, 1e-300], [50.0, 30.0], [10.0, 10.0]),
            ([50.0, 30.0], [300.0, 1e300], [50.0, 30.0], [100.0, 60.0]),
        ] {
            let place = within(CentredBox { centre, size }, FRAME);
            assert_eq!(place, CentredBox { centre: wanted_centre, size: wanted_size });
        }
        // A frame that is smaller than the smallest target.
        let tiny = within(
            CentredBox { centre: [5.0; 2], size: [5.0; 2] },
            FrameSize { width: 4, height: 4 },
        );
        assert_eq!(tiny, CentredBox { centre: [4.0; 2], size: [10.0; 2] });
    }

    #[test]
    fn a_template_is_the_mixture_of_the_first_and_a_running_mean() {
        let update = TemplateUpdate { share: 0.3, rate: 0.1, min_score: 0.0 };
        let first = vec![1.0, -2.0, 0.5];
        let mut template = Template { current: first.clone(), first: first.clone() };
        let mut mean = first.clone();
        for k in 0..50 {
            let seen = [0.0, 1.0, 2.0].map(|at| (at + k as f32 * 0.7).sin());
            template.add(&seen, update);
            for (mean, seen) in mean.iter_mut().zip(seen) {
                *mean += 0.1 * (seen - *mean);
            }
            let mixture = first.iter().zip(&mean).map(|(first, mean)| 0.7 * first + 0.3 * mean);
            for (current, expected) in template.current.iter().zip(mixture) {
                assert!((current - expected).abs() < 1e-5, "{current} {expected}");
            }
        }
        assert_eq!(template.first, first);
    }

    #[test]
    fn the_status_follows_the_score() {
        let config = NetworkConfig::default();
        for (score, wanted) in [
            (1.0, Status::Tracked),
            (0.5, Status::Tracked),
            (0.49, Status::Uncertain),
            (0.25, Status::Uncertain),
            (0.24, Status::Lost),
            (0.0, Status::Lost),
        ] {
            assert_eq!(status(score, &config), wanted, "{score}");
        }
    }

    #[test]
    fn an_estimate_has_the_corners_of_its_box() {
        let mut estimate = Estimate::empty();
        let place = CentredBox { centre: [10.0, 20.0], size: [6.0, 4.0] };
        fill(place, 0.5, Status::Uncertain, &mut estimate);
        assert_eq!(estimate.bbox, BoundingBox { x: 7.0, y: 18.0, w: 6.0, h: 4.0 });
        assert_eq!(estimate.corners, [[7.0, 18.0], [12.0, 18.0], [12.0, 21.0], [7.0, 21.0]]);
        assert_eq!((estimate.score, estimate.visibility), (0.5, None));
    }
}
