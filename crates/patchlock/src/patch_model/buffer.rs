//! The buffers (Sec. 2.1, 2.5): recent appearances of the target, which are coded jointly with each
//! candidate.

/// Replaces the oldest entry by the newest.
pub fn push(buffer: &mut [Vec<f32>], newest: &[f32]) {
    if let Some(oldest) = buffer.first_mut() {
        oldest.clear();
        oldest.extend_from_slice(newest);
        buffer.rotate_left(1);
    }
}

/// The first entries: the last `length` templates. If there are fewer, the first template is
/// repeated before them.
pub fn begin(templates: &[Vec<f32>], length: usize) -> Vec<Vec<f32>> {
    let missing = length.saturating_sub(templates.len());
    let first = templates.len().saturating_sub(length);
    let earlier = templates.iter().take(1).cycle().take(missing);
    earlier.chain(&templates[first..]).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn push_replaces_the_oldest() {
        let templates: Vec<_> = (0..5u8).map(|k| vec![f32::from(k)]).collect();
        let mut buffer = begin(&templates, 3);
        assert_eq!(buffer, [[2.0], [3.0], [4.0]]);
        push(&mut buffer, &[9.0]);
        assert_eq!(buffer, [[3.0], [4.0], [9.0]]);
        assert_eq!(begin(&templates[..2], 4), [[0.0], [0.0], [0.0], [1.0]]);
        push(&mut [], &[1.0]);
    }
}
