//! Writes headers of H.264 bit by bit.

/// Packs (value, bits) pairs, most significant bit first.
pub fn pack(fields: &[(u32, usize)]) -> Vec<u8> {
    let bits: Vec<u8> = fields
        .iter()
        .flat_map(|&(v, n)| (0..n).rev().map(move |k| (u64::from(v) >> k & 1) as u8))
        .collect();
    bits.chunks(8)
        .map(|c| c.iter().enumerate().fold(0, |byte, (k, b)| byte | b << (7 - k)))
        .collect()
}

/// `ue(v)` as a (value, bits) pair: v + 1, in twice its bit length minus one bits.
pub fn ue(value: u32) -> (u32, usize) {
    let code = value + 1;
    (code, 2 * (32 - code.leading_zeros() as usize) - 1)
}
