//! The search with a network: what the memory finds, the network has to confirm; what the network
//! finds counts if it is sure.

use super::place::Place;
use super::search::{SearchParams, Searcher};
use super::witness::Witness;
use crate::config::RobustConfig;
use crate::network::look::Buffers;
use crate::network_error::NetworkError;

/// When a place counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RegainParams {
    /// Windows that the network looks at on each frame, the one around the last place included.
    pub windows: u64,
    /// What the memory finds counts from these odds on.
    confirmed: f64,
    /// What the network finds counts above these odds.
    alone: f64,
}

impl RegainParams {
    pub fn new(config: &RobustConfig) -> Self {
        Self {
            windows: config.network_windows as u64,
            confirmed: config.found_confirmed,
            alone: config.found_alone,
        }
    }
}

/// Searches from window number `next` on; `last` is the last place.
///
/// # Errors
/// The runtime's own.
pub(crate) fn regain(
    mut searcher: Searcher<'_>,
    (last, next): (Place, u64),
    (search, params): (&SearchParams, &RegainParams),
    (witness, buffers): (&Witness, &mut Buffers),
) -> Result<Option<Place>, NetworkError> {
    let frame = searcher.setting.frame;
    if let Some(found) = searcher.search(last, next, search)
        && witness.examine(frame, found.place, buffers)? >= params.confirmed
    {
        return Ok(Some(found.place));
    }
    let mut best: Option<(f64, Place)> = None;
    for around in searcher.windows(last, next, search).take(params.windows as usize) {
        let sight = witness.look(frame, around, buffers)?;
        if best.is_none_or(|(odds, _)| sight.odds > odds) {
            best = Some((sight.odds, sight.place));
        }
    }
    let found = best.filter(|(odds, _)| *odds > params.alone);
    Ok(found.map(|(_, place)| searcher.setting.window.keep(place, frame)))
}
