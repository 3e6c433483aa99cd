//! Random changes of inputs, the same on every run.

use fastrand::Rng;

const BYTES: [u8; 9] = [0, 1, 3, 0x7f, 0x80, 0xff, b'"', b',', b'\n'];
const WORDS: [u32; 8] = [0, 1, 2, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0xffff, 0x0100_0000];
/// Texts that take the place of a number.
const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "7",
    "0.5",
    "1e9",
    "-1e9",
    "1e10",
    "1e308",
    "1e-308",
    "1e999",
    "NaN",
    "inf",
    "null",
    "4294967295",
    "9007199254740993",
    "18446744073709551615",
    "99999999",
    "10000000",
    "\"x\"",
];

/// A few changes of `seed`; `other` is an input from which parts may be taken.
pub fn mutated(seed: &[u8], other: &[u8], draws: &mut Rng) -> Vec<u8> {
    let mut data = seed.to_vec();
    for _ in 0..1 + draws.usize(..4) {
        change(&mut data, other, draws);
    }
    data
}

fn change(data: &mut Vec<u8>, other: &[u8], draws: &mut Rng) {
    if data.is_empty() {
        data.push(draws.u8(..));
    }
    let at = draws.usize(..data.len());
    let end = (at + 1 + draws.usize(..32)).min(data.len());
    match draws.usize(..20) {
        0 => data.truncate(at),
        1 => drop(data.drain(at..end)),
        2 => {
            let part = data[at..end].to_vec();
            let to = draws.usize(..data.len());
            data.splice(to..to, part);
        }
        3 if !other.is_empty() => {
            let from = draws.usize(..other.len());
            let until = (from + 1 + draws.usize(..64)).min(other.len());
            data.splice(at..end, other[from..until].iter().copied());
        }
        4 if at + 4 <= data.len() => {
            let word = WORDS[draws.usize(..WORDS.len())];
            let bytes = if draws.bool() { word.to_be_bytes() } else { word.to_le_bytes() };
            data[at..at + 4].copy_from_slice(&bytes);
        }
        5..8 => data[at] ^= 1 << draws.usize(..8),
        8..11 => data[at] = BYTES[draws.usize(..BYTES.len())],
        11..13 => data[at] = draws.u8(..),
        13 => repeat_line(data, at, draws),
        _ => number(data, at, draws),
    }
}

/// Puts another number in the place of the next one as text.
fn number(data: &mut Vec<u8>, at: usize, draws: &mut Rng) {
    let is_digit = |byte: &u8| byte.is_ascii_digit();
    let Some(from) = data[at..].iter().position(is_digit).map(|k| at + k) else { return };
    let part = |byte: &u8| byte.is_ascii_digit() || b".eE+-".contains(byte);
    let length = data[from..].iter().take_while(|byte| part(byte)).count();
    let text = NUMBERS[draws.usize(..NUMBERS.len())];
    data.splice(from..from + length, text.bytes());
}

/// Repeats the line here, or removes it.
fn repeat_line(data: &mut Vec<u8>, at: usize, draws: &mut Rng) {
    let from = data[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |k| k + 1);
    let until =
        data[at..].iter().position(|byte| *byte == b'\n').map_or(data.len(), |k| at + k + 1);
    if draws.usize(..3) == 0 {
        data.drain(from..until);
    } else {
        let line = data[from..until].to_vec();
        data.splice(from..from, line);
    }
}
