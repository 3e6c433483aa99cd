//! Statistics of a run, as a JSON object and as text on the screen.

use std::fmt;
use std::path::PathBuf;

use anyhow::Result;
use patchlock::{Status, TrackerConfig};
use patchlock_bench::compare::quantile;
use patchlock_media::FrameRate;
use patchlock_track::UsedNetwork;
use patchlock_track::settings::basis;
use serde::Serialize;

use super::measurements::{LostSpan, LowScoreSpan, Measurements};
use super::pending::PendingFile;

/// The most losses that are shown on the screen.
const SHOWN: usize = 10;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of tracked frames, including the first.
    pub frames: usize,
    pub targets: usize,
    /// Number of frames in which the status is tracked; like the next two, the sum over all
    /// targets.
    pub frames_tracked: usize,
    pub frames_uncertain: usize,
    pub frames_lost: usize,
    /// Each loss, in the order in which they began.
    pub losses: Vec<LostSpan>,
    /// Each stretch of at least ten frames in which a target was not lost but its score stayed low.
    pub low_scores: Vec<LowScoreSpan>,
    /// Frames per second of the tracker alone: includes the first frame, but not decoding and
    /// writing.
    pub tracking_fps: f64,
    /// Frames per second of the whole run, with reading and writing; `None` if it was not measured.
    pub wall_fps: Option<f64>,
    /// Frames of a live source that were left out because a newer one had come; other sources have
    /// no such field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_dropped: Option<usize>,
    /// Median time per frame in milliseconds.
    pub ms_median: f64,
    /// 95th percentile of the time per frame in milliseconds.
    pub ms_p95: f64,
    #[serde(flatten)]
    pub settings: Settings,
    pub threads: usize,
    pub version: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Settings {
    pub method: &'static str,
    /// Name of the preset that the settings are based on.
    pub preset: String,
    pub seed: u64,
    /// The network, of the method `network`.
    #[serde(flatten)]
    pub network: Option<UsedNetwork>,
    /// Whether the scores are probabilities.
    #[serde(skip)]
    pub score_is_probability: bool,
}

impl Settings {
    /// Of a configuration that began as this preset.
    pub fn new(preset: &str, config: &TrackerConfig) -> Self {
        let preset = basis(preset, config).to_string();
        let network = config.network.as_ref().map(UsedNetwork::from);
        let info = config.method.info();
        Self {
            method: info.name,
            preset,
            seed: config.seed,
            network,
            score_is_probability: info.score_is_probability,
        }
    }
}

impl Summary {
    /// The statistics of a run. `rate` is the frame rate of the source, if it is known.
    pub fn new(
        run: &Measurements,
        rate: Option<FrameRate>,
        settings: Settings,
        threads: usize,
    ) -> Self {
        let seconds = |frame: usize| {
            let FrameRate { frames, seconds } = rate?;
            Some(round(frame as f64 * f64::from(seconds) / f64::from(frames)))
        };
        let timed = |loss: &LostSpan| LostSpan {
            lost_seconds: seconds(loss.lost_frame),
            return_seconds: loss.return_frame.and_then(seconds),
            ..loss.clone()
        };
        let mut sorted = run.times_ms().to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let quantile = |share| if sorted.is_empty() { 0.0 } else { quantile(&sorted, share) };
        Self {
            frames: run.frames(),
            targets: run.targets(),
            frames_tracked: run.count(Status::Tracked),
            frames_uncertain: run.count(Status::Uncertain),
            frames_lost: run.count(Status::Lost),
            losses: run.losses().iter().map(timed).collect(),
            low_scores: run.low_scores(settings.score_is_probability),
            tracking_fps: round(run.fps()),
            wall_fps: None,
            frames_dropped: None,
            ms_median: round(quantile(0.5)),
            ms_p95: round(quantile(0.95)),
            settings,
            threads,
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// With the seconds of the whole run, and the frames that a live source has left out.
    #[must_use]
    pub fn with_run(self, seconds: f64, dropped: Option<usize>) -> Self {
        let fps = self.frames as f64 / seconds.max(f64::MIN_POSITIVE);
        Self { wall_fps: Some(round(fps)), frames_dropped: dropped, ..self }
    }

    /// Writes the object and completes the file.
    pub fn write(&self, file: PendingFile) -> Result<PathBuf> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(file.filled(text.as_bytes())?.commit()?)
    }
}

/// The lines for the screen.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (fps, uncertain, lost) = (self.tracking_fps, self.frames_uncertain, self.frames_lost);
        write!(f, "tracked {} frames at {fps:.1} frames per second", self.frames)?;
        if uncertain + lost > 0 {
            write!(f, "; uncertain in {uncertain}, lost in {lost}")?;
        }
        lines(f, &self.losses)?;
        lines(f, &self.low_scores)?;
        if let Some(network) = &self.settings.network {
            write!(f, "\nnetwork: {network}")?;
        }
        if let Some(fps) = self.wall_fps {
            write!(f, "\n{fps:.1} frames per second with reading and writing")?;
        }
        match self.frames_dropped {
            Some(dropped @ 1..) => write!(f, "\n{dropped} frames dropped"),
            _ => Ok(()),
        }
    }
}

/// The first of these, one per line.
fn lines(f: &mut fmt::Formatter<'_>, all: &[impl fmt::Display]) -> fmt::Result {
    all.iter().take(SHOWN).try_for_each(|one| write!(f, "\n{one}"))?;
    match all.len().saturating_sub(SHOWN) {
        0 => Ok(()),
        more => write!(f, "\nand {more} more; --summary lists all"),
    }
}

/// The target that a line is about, if there are many.
fn called(f: &mut fmt::Formatter<'_>, id: Option<u64>, name: Option<&str>) -> fmt::Result {
    match (name, id) {
        (Some(name), _) => write!(f, "target {name} "),
        (None, Some(id)) => write!(f, "target {id} "),
        (None, None) => Ok(()),
    }
}

impl fmt::Display for LowScoreSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, name, first_frame, last_frame, lowest } = self;
        called(f, *id, name.as_deref())?;
        write!(
            f,
            "low score from frame {first_frame} to {last_frame}, down to {lowest:.2}: check the box there"
        )
    }
}

impl fmt::Display for LostSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let moment = |frame: usize, seconds: Option<f64>| match seconds {
            Some(seconds) => format!("in frame {frame} ({seconds:.2} s)"),
            None => format!("in frame {frame}"),
        };
        called(f, self.id, self.name.as_deref())?;
        write!(f, "lost {}, ", moment(self.lost_frame, self.lost_seconds))?;
        match self.return_frame {
            Some(frame) => write!(f, "back {}", moment(frame, self.return_seconds)),
            None => f.write_str("not back"),
        }
    }
}

/// Three decimal places.
pub fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::super::{TargetResult, example};
    use super::*;
    use patchlock::Preset;
    use std::sync::Arc;

    fn summary(run: &Measurements, rate: Option<FrameRate>) -> Summary {
        Summary::new(run, rate, Settings::new("robust", &TrackerConfig::default()), 2)
    }

    #[test]
    fn statistics_of_known_times() {
        let mut run = Measurements::default();
        for ms in 1..=101 {
            run.add(0, &[example::target(Status::Tracked)], f64::from(102 - ms));
        }
        let known = summary(&run, None);
        assert_eq!((known.frames, known.ms_median, known.ms_p95), (101, 51.0, 96.0));
        assert_eq!(known.tracking_fps, 19.608); // 101 frames in 5.151 s
        assert_eq!(known.to_string(), "tracked 101 frames at 19.6 frames per second");
        let run = known.clone().with_run(10.1, Some(7));
        assert_eq!(
            run.to_string(),
            "tracked 101 frames at 19.6 frames per second\n\
             10.0 frames per second with reading and writing\n7 frames dropped"
        );
        let json = serde_json::to_value(run).expect("JSON");
        assert_eq!((&json["wall_fps"], &json["frames_dropped"]), (&10.0.into(), &7.into()));
        let json = serde_json::to_value(known.with_run(10.1, None)).expect("JSON");
        assert!(json.get("frames_dropped").is_none());
        assert_eq!(summary(&Measurements::default(), None).tracking_fps, 0.0);
    }

    #[test]
    fn the_network_is_named() {
        let network = UsedNetwork {
            model: "VitTrack".into(),
            model_sha256: "0f".into(),
            runtime: "built-in".into(),
        };
        let settings = Settings {
            network: Some(network),
            ..Settings::new("network", &TrackerConfig::from(Preset::Network))
        };
        let summary = Summary::new(&Measurements::default(), None, settings, 1);
        let text = summary.to_string();
        assert!(
            text.ends_with(" frames per second\nnetwork: VitTrack, runtime built-in"),
            "{text}"
        );
        let json = serde_json::to_value(summary).expect("JSON");
        let names = ["method", "model", "model_sha256", "runtime"].map(|name| json[name].clone());
        assert_eq!(names, ["network", "VitTrack", "0f", "built-in"].map(serde_json::Value::from));
    }

    /// Lost in frames 10 to 12 and from frame 20 on.
    fn with_losses(id: Option<u64>, name: Option<&str>) -> Measurements {
        let name: Option<Arc<str>> = name.map(Arc::from);
        let mut run = Measurements::default();
        for frame in 0..25 {
            let status = match frame {
                9 => Status::Uncertain,
                10..=12 | 20.. => Status::Lost,
                _ => Status::Tracked,
            };
            let target = TargetResult { id, name: name.clone(), ..example::target(status) };
            run.add(frame, &[target], 10.0);
        }
        run
    }

    #[test]
    fn losses_have_frames_and_times() {
        let rate = FrameRate::new(25, 2);
        let json = serde_json::to_value(summary(&with_losses(None, None), rate)).expect("JSON");
        assert_eq!([&json["method"], &json["preset"]], ["robust"; 2]);
        let counts = ["frames_tracked", "frames_uncertain", "frames_lost"].map(|k| json[k].clone());
        assert_eq!(counts, [16, 1, 8].map(serde_json::Value::from));
        let losses = serde_json::json!([
            { "lost_frame": 10, "lost_seconds": 0.8, "return_frame": 13, "return_seconds": 1.04 },
            { "lost_frame": 20, "lost_seconds": 1.6, "return_frame": null, "return_seconds": null },
        ]);
        assert_eq!(json["losses"], losses);
        let unknown =
            serde_json::to_value(summary(&with_losses(Some(4), None), None)).expect("JSON");
        let loss = serde_json::json!({
            "id": 4, "lost_frame": 10, "lost_seconds": null, "return_frame": 13, "return_seconds": null,
        });
        assert_eq!(unknown["losses"][0], loss);
    }

    #[test]
    fn stretches_of_low_scores_are_shown_and_listed() {
        let mut run = Measurements::default();
        for frame in 0..40 {
            let mut target = example::target(Status::Tracked);
            target.estimate.score = if frame < 25 { 0.9 } else { 0.25 };
            run.add(frame, &[target], 10.0);
        }
        let summary = summary(&run, None);
        let text = summary.to_string();
        let expected = "\nlow score from frame 25 to 39, down to 0.25: check the box there";
        assert!(text.ends_with(expected), "{text}");
        let json = serde_json::to_value(summary).expect("JSON");
        let listed = serde_json::json!([{ "first_frame": 25, "last_frame": 39, "lowest": 0.25 }]);
        assert_eq!(json["low_scores"], listed);
    }

    #[test]
    fn losses_are_shown_on_the_screen() {
        let text = summary(&with_losses(None, None), FrameRate::new(25, 2)).to_string();
        assert_eq!(
            text,
            "tracked 25 frames at 100.0 frames per second; uncertain in 1, lost in 8\n\
             lost in frame 10 (0.80 s), back in frame 13 (1.04 s)\n\
             lost in frame 20 (1.60 s), not back"
        );
        let text = summary(&with_losses(Some(4), None), None).to_string();
        assert!(text.ends_with("\ntarget 4 lost in frame 20, not back"), "{text}");
        let named = summary(&with_losses(Some(4), Some("car")), None);
        assert!(named.to_string().ends_with("\ntarget car lost in frame 20, not back"), "{named}");
        assert_eq!(serde_json::to_value(named).expect("JSON")["losses"][0]["name"], "car");
        let mut run = Measurements::default();
        for frame in 0..24 {
            let status = [Status::Tracked, Status::Lost][frame % 2];
            run.add(frame, &[example::target(status)], 10.0);
        }
        let text = summary(&run, None).to_string();
        assert_eq!(
            (text.lines().count(), text.lines().last()),
            (12, Some("and 2 more; --summary lists all"))
        );
    }
}
