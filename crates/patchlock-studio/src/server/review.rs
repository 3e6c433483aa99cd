//! The doubtful places of a clip, and what is left to check.

use axum::Json;
use serde::Deserialize;
use serde_json::{Value, json};

use super::answer::{JsonAnswer, QueryParams, aside};
use super::clips::{ClipRequest, no_target};
use crate::tracking::review::{ReviewStats, ReviewSuggestion, review_stats, suggestions};

/// Of which target.
#[derive(Deserialize)]
pub struct TargetQuery {
    target: Option<u64>,
}

/// `GET /api/clips/ID/doubts?target=T`
pub async fn doubtful(
    QueryParams(TargetQuery { target }): QueryParams<TargetQuery>,
    ClipRequest { clip, .. }: ClipRequest,
) -> JsonAnswer {
    let found = aside(move || {
        let tracking = clip.jobs.targets();
        let held = clip.hold();
        let project = held.store.project();
        if let Some(id) = target.filter(|&id| project.target(id).is_none()) {
            return Err(no_target(id));
        }
        let targets = project.targets.iter().filter(|it| target.is_none_or(|id| id == it.id));
        let mut found: Vec<_> = targets
            .flat_map(|target| {
                suggestions(target, clip.frames).into_iter().map(|it| (target.id, it))
            })
            .collect();
        // What is being tracked, or waits for it, will be known.
        found.retain(|(target, suggestion)| {
            !(tracking.contains(target) && suggestion.reason.is_untracked())
        });
        found.sort_by(|(_, a), (_, b)| a.order(b));
        let left: ReviewStats =
            project.targets.iter().map(|it| review_stats(it, clip.frames)).sum();
        let doubts: Vec<Value> = found.into_iter().map(shown).collect();
        Ok(json!({ "doubts": doubts, "left": left }))
    });
    found.await.map(Json)
}

/// A suggestion for the page.
fn shown((target, suggestion): (u64, ReviewSuggestion)) -> Value {
    let ReviewSuggestion { frame, stretch, gain, reason, .. } = suggestion;
    let (is_untracked, reason) = (reason.is_untracked(), reason.to_string());
    json!({
        "target": target, "frame": frame, "stretch": stretch, "gain": gain, "reason": reason,
        "untracked": is_untracked,
    })
}
