//! Which frames of a source are used, in which order.

use crate::Error;

/// Frames `start..end` by `stride`, forwards or backwards. The set of frames is the same in both directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// First frame of the range.
    pub start: usize,
    /// First frame after the range.
    pub end: Option<usize>,
    /// Distance from one frame to the next.
    pub stride: usize,
    /// From the last frame of the range to the first.
    pub reverse: bool,
}

impl Order {
    /// Checks what can be checked before the source is open.
    ///
    /// # Errors
    /// [`Error::Range`].
    pub fn check(&self) -> Result<(), Error> {
        if self.stride == 0 {
            return Err(Error::range(
                "--stride is 0: the same frame would come for ever",
                "--stride 1 takes every frame",
            ));
        }
        match self.end {
            Some(end) if end <= self.start => Err(Error::range(
                format!(
                    "--end {end} is not after --start {}: no frame is left to track",
                    self.start
                ),
                "--end is the first frame that is not tracked; leave it out to go to the last frame",
            )),
            _ => Ok(()),
        }
    }

    /// The frame numbers in their order. An end beyond the source stands for its last frame.
    ///
    /// # Errors
    /// [`Error::Range`] where the range begins after the last frame.
    pub fn indices(
        &self,
        length: Option<usize>,
    ) -> Result<Box<dyn Iterator<Item = usize> + Send>, Error> {
        if let Some(length) = length
            && self.start >= length
        {
            return Err(self.beyond(length));
        }
        let end = match (self.end, length) {
            (Some(end), Some(length)) => end.min(length),
            (Some(end), None) => end,
            (None, Some(length)) => length,
            (None, None) => usize::MAX,
        };
        let rising = (self.start..end).step_by(self.stride);
        Ok(if self.reverse { Box::new(rising.rev()) } else { Box::new(rising) })
    }

    /// How many frames there will be, where the length of the source is known or the range is closed by it.
    pub fn count(&self, length: Option<usize>) -> Option<usize> {
        let end = self.end.unwrap_or(usize::MAX).min(length?);
        Some(end.saturating_sub(self.start).div_ceil(self.stride.max(1)))
    }

    /// Whether a frame is among them, as far as that is known before the end of the source is.
    pub fn holds(&self, frame: usize, length: Option<usize>) -> bool {
        let end = self.end.unwrap_or(usize::MAX).min(length.unwrap_or(usize::MAX));
        (self.start..end).contains(&frame)
            && (frame - self.start).is_multiple_of(self.stride.max(1))
    }

    /// The error that a source of unknown length ended before the range began.
    pub fn nothing(&self) -> Error {
        match self.start {
            0 => Error::plain("the source has no frames"),
            start => Error::range(
                format!("--start {start} is beyond the end of the source"),
                "frames count from 0",
            ),
        }
    }

    /// The error that the range begins after the last frame.
    fn beyond(&self, length: usize) -> Error {
        Error::range(
            format!("--start {} is beyond the end: the source has {length} frames", self.start),
            format!("frames count from 0, so the last one is {}", length.saturating_sub(1)),
        )
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
