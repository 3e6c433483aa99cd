//! What of a target is visible in a frame, in pictures and words.

use axum::Json;
use patchlock::{BoundingBox, Status, VisibilityMap};
use patchlock_media::Picture;
use serde::Deserialize;
use serde_json::{Value, json};

use super::answer::{JsonAnswer, QueryParams, Refusal, aside};
use super::clips::{ClipRequest, OpenClip, no_target};
use crate::engine::Settings;
use crate::engine::look::compare;
use crate::project::{Target, TrackedBox};

/// Where to look.
#[derive(Deserialize)]
pub struct LookQuery {
    target: u64,
    frame: usize,
}

/// `GET /api/clips/ID/look?target=T&frame=N`
pub async fn look(
    QueryParams(place): QueryParams<LookQuery>,
    ClipRequest { clip, .. }: ClipRequest,
) -> JsonAnswer {
    aside(move || look_at(&clip, &place)).await.map(Json)
}

fn look_at(clip: &OpenClip, &LookQuery { target, frame }: &LookQuery) -> Result<Value, Refusal> {
    let (bbox, tracked, key) = {
        let held = clip.hold();
        let found = held.store.project().target(target).ok_or_else(|| no_target(target))?;
        let tracked = found.tracked.get(&frame).copied();
        let key = found.keys.get(&frame).map(|key| key.bbox);
        let Some(bbox) = key.or(tracked.map(|tracked| tracked.bbox)) else {
            let message = format!("target {target} has no box in frame {frame}");
            return Err(Refusal::unknown(message));
        };
        (bbox, tracked, nearest_key(found, frame))
    };
    let Some((key_frame, key_box)) = key else {
        return Err(Refusal::bad(format!("target {target} has no key frame to compare with")));
    };
    let key_picture = picture(clip, key_frame)?;
    let now = picture(clip, frame)?;
    let Settings { config, pool, .. } = &clip.engine.settings;
    let compared = pool.install(|| compare(config, (&key_picture, key_box), (&now, bbox)));
    let estimate = compared.map_err(|error| Refusal::failed(error.to_string()))?;
    let maps = estimate.visibility.as_ref();
    let scales: Vec<Value> =
        maps.into_iter().flat_map(|maps| [scale(&maps.large), scale(&maps.small)]).collect();
    let visible = maps.map(patchlock::Visibility::share);
    // A network has no map of patches.
    let lost = estimate.status == Status::Lost;
    let outside = outside(bbox, [clip.width, clip.height]);
    Ok(json!({
        "box": bbox,
        "corners": estimate.corners,
        "score": tracked.map_or(estimate.score, |tracked| tracked.score),
        "status": tracked.map_or(estimate.status, |tracked| tracked.status),
        "visible": visible,
        "key": key_frame,
        "scales": scales,
        "words": words(tracked, (visible, lost), outside, key_frame),
    }))
}

/// The nearest key frame, another one than this frame if there is one.
fn nearest_key(target: &Target, frame: usize) -> Option<(usize, BoundingBox)> {
    let far = |other: usize| if other == frame { usize::MAX } else { other.abs_diff(frame) };
    let keys = target.keys.iter().map(|(&frame, key)| (frame, key.bbox));
    keys.min_by_key(|&(frame, _)| far(frame))
}

fn picture(clip: &OpenClip, frame: usize) -> Result<Picture, Refusal> {
    let picture = clip.engine.open(false)?.frame(frame)?;
    picture.ok_or_else(|| Refusal::unknown(format!("the video ended before frame {frame}")))
}

fn scale(map: &VisibilityMap) -> Value {
    let hidden: Vec<f64> =
        map.visible.iter().map(|&visible| f64::from(u8::from(!visible))).collect();
    json!({ "columns": map.columns, "rows": map.rows, "hidden": hidden })
}

/// The share of a box that is outside a frame of this size.
fn outside(bbox: BoundingBox, [width, height]: [usize; 2]) -> f64 {
    let inside = |from: f64, length: f64, end: usize| {
        ((from + length).min(end as f64) - from.max(0.0)).max(0.0) / length
    };
    1.0 - inside(bbox.x, bbox.w, width) * inside(bbox.y, bbox.h, height)
}

/// Why the place is doubtful, the weightiest first.
fn words(
    tracked: Option<TrackedBox>,
    (visible, lost): (Option<f64>, bool),
    outside: f64,
    key: usize,
) -> Vec<String> {
    let percent = |share: f64| (100.0 * share).round();
    let mut words = Vec::new();
    if let Some(TrackedBox { status, score, agreement, .. }) = tracked {
        match status {
            Status::Lost => words.push("lost, or out of the frame".to_owned()),
            Status::Uncertain => words.push(format!("uncertain: score {score:.2}")),
            Status::Tracked if score < 0.5 => words.push(format!("score {score:.2}")),
            Status::Tracked => {}
        }
        if let Some(agreement) = agreement.filter(|&agreement| agreement < 0.5) {
            let overlap = percent(agreement);
            words.push(format!("forward and backward tracks overlap by {overlap} %"));
        }
    }
    if outside >= 0.05 {
        words.push(format!("{} % outside the frame", percent(outside)));
    }
    match visible {
        Some(visible) if visible < 0.9 => {
            words.push(format!("hidden {} %, compared with frame {key}", percent(1.0 - visible)));
        }
        None if lost => words.push(format!("does not look like frame {key}")),
        Some(_) | None => {}
    }
    words
}
