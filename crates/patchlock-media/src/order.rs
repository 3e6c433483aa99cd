//! The range of frames that is used, and its direction.

use serde::{Deserialize, Serialize};

use crate::Error;

/// A range of frames that is invalid, or does not fit a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum RangeError {
    /// The stride is 0.
    #[error("the stride is 0; it must be at least 1")]
    ZeroStride,
    /// The end is not after the start.
    #[error(
        "the range of frames ends at {end}, which is not after its start, {start}: it has no frame"
    )]
    Empty {
        /// The first frame.
        start: usize,
        /// The first frame after the range.
        end: usize,
    },
    /// The range starts after the last frame of the source.
    #[error("the range of frames starts at {start}, beyond the end{}", has(*length))]
    Beyond {
        /// The first frame.
        start: usize,
        /// The number of frames of the source; `None` if it is unknown.
        length: Option<usize>,
    },
}

impl RangeError {
    /// What the user can do, whichever front end is used.
    pub(crate) fn advice(&self) -> Option<String> {
        match self {
            Self::ZeroStride | Self::Empty { .. } => None,
            Self::Beyond { length: None, .. } => Some("frames count from 0".to_string()),
            Self::Beyond { length: Some(length), .. } => {
                let last = length.saturating_sub(1);
                Some(format!("frames count from 0, so the last one is {last}"))
            }
        }
    }
}

/// The length of the source, after "beyond the end".
fn has(length: Option<usize>) -> String {
    length.map_or(" of the source".to_string(), |n| format!(": the source has {n} frames"))
}

/// The frames `start..end` with a stride, forwards or backwards. Both directions visit the same
/// frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// First frame of the range.
    pub start: usize,
    /// First frame after the range; `None` for the end of the source.
    pub end: Option<usize>,
    /// Distance from one frame to the next.
    pub stride: usize,
    /// Whether frames are visited from the last to the first.
    pub reverse: bool,
}

impl Order {
    /// Checks the range as far as possible without the source.
    ///
    /// # Errors
    /// [`Error::Range`] for a stride of 0 or an empty range.
    pub fn check(&self) -> Result<(), Error> {
        if self.stride == 0 {
            return Err(RangeError::ZeroStride.into());
        }
        match self.end {
            Some(end) if end <= self.start => {
                Err(RangeError::Empty { start: self.start, end }.into())
            }
            _ => Ok(()),
        }
    }

    /// The indices of the frames, in the order of the visit. An end beyond the source is clamped to
    /// its length.
    ///
    /// # Errors
    /// [`Error::Range`] if the range starts after the last frame.
    pub fn indices(
        &self,
        length: Option<usize>,
    ) -> Result<Box<dyn Iterator<Item = usize> + Send>, Error> {
        if length.is_some_and(|length| self.start >= length) {
            return Err(RangeError::Beyond { start: self.start, length }.into());
        }
        let forwards = (self.start..self.end_within(length)).step_by(self.stride);
        Ok(if self.reverse { Box::new(forwards.rev()) } else { Box::new(forwards) })
    }

    /// The number of frames; `None` if the length of the source is unknown.
    pub fn count(&self, length: Option<usize>) -> Option<usize> {
        let end = self.end_within(Some(length?));
        Some(end.saturating_sub(self.start).div_ceil(self.stride.max(1)))
    }

    /// Whether a frame is in the range. A source of unknown `length` is assumed not to end.
    pub fn holds(&self, frame: usize, length: Option<usize>) -> bool {
        (self.start..self.end_within(length)).contains(&frame)
            && (frame - self.start).is_multiple_of(self.stride.max(1))
    }

    /// The first frame that is not visited any more.
    fn end_within(&self, length: Option<usize>) -> usize {
        self.end.unwrap_or(usize::MAX).min(length.unwrap_or(usize::MAX))
    }

    /// The error for a range without frames, found after reading a source of unknown length.
    pub fn nothing(&self) -> Error {
        match self.start {
            0 => Error::NoFrames,
            start => RangeError::Beyond { start, length: None }.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Order;

    fn list(start: usize, end: Option<usize>, stride: usize, reverse: bool) -> Vec<usize> {
        Order { start, end, stride, reverse }.indices(Some(10)).expect("a good range").collect()
    }

    #[test]
    fn both_directions_visit_the_same_frames() {
        assert_eq!(list(1, None, 3, false), [1, 4, 7]);
        assert_eq!(list(1, None, 3, true), [7, 4, 1]);
        assert_eq!(list(2, Some(5), 1, false), [2, 3, 4]);
        assert_eq!(list(8, Some(500), 1, false), [8, 9]);
    }
}
