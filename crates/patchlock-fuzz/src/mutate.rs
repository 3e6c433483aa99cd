//! Random changes of inputs, the same on every run.

/// A small generator with a fixed stream (splitmix64).
pub struct Draws(pub u64);

impl Draws {
    /// The next number below `below`, which is at least 1.
    pub fn next(&mut self, below: usize) -> usize {
        (self.bits() % below as u64) as usize
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.next(choices.len())]
    }
}

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
pub fn mutated(seed: &[u8], other: &[u8], draws: &mut Draws) -> Vec<u8> {
    let mut data = seed.to_vec();
    for _ in 0..1 + draws.next(4) {
        change(&mut data, other, draws);
    }
    data
}

fn change(data: &mut Vec<u8>, other: &[u8], draws: &mut Draws) {
    if data.is_empty() {
        data.push(draws.next(256) as u8);
    }
    let at = draws.next(data.len());
    let end = (at + 1 + draws.next(32)).min(data.len());
    match draws.next(20) {
        0 => data.truncate(at),
        1 => drop(data.drain(at..end)),
        2 => {
            let part = data[at..end].to_vec();
            let to = draws.next(data.len());
            data.splice(to..to, part);
        }
        3 if !other.is_empty() => {
            let from = draws.next(other.len());
            let until = (from + 1 + draws.next(64)).min(other.len());
            data.splice(at..end, other[from..until].iter().copied());
        }
        4 if at + 4 <= data.len() => {
            let word = draws.of(&WORDS);
            let bytes = if draws.next(2) == 0 { word.to_be_bytes() } else { word.to_le_bytes() };
            data[at..at + 4].copy_from_slice(&bytes);
        }
        5..8 => data[at] ^= 1 << draws.next(8),
        8..11 => data[at] = draws.of(&BYTES),
        11..13 => data[at] = draws.next(256) as u8,
        13 => repeat_line(data, at, draws),
        _ => number(data, at, draws),
    }
}

/// Puts another number in the place of the next one as text.
fn number(data: &mut Vec<u8>, at: usize, draws: &mut Draws) {
    let is_digit = |byte: &u8| byte.is_ascii_digit();
    let Some(from) = data[at..].iter().position(is_digit).map(|k| at + k) else { return };
    let part = |byte: &u8| byte.is_ascii_digit() || b".eE+-".contains(byte);
    let length = data[from..].iter().take_while(|byte| part(byte)).count();
    let text = draws.of(&NUMBERS);
    data.splice(from..from + length, text.bytes());
}

/// Repeats the line here, or removes it.
fn repeat_line(data: &mut Vec<u8>, at: usize, draws: &mut Draws) {
    let from = data[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |k| k + 1);
    let until =
        data[at..].iter().position(|byte| *byte == b'\n').map_or(data.len(), |k| at + k + 1);
    if draws.next(3) == 0 {
        data.drain(from..until);
    } else {
        let line = data[from..until].to_vec();
        data.splice(from..from, line);
    }
}
