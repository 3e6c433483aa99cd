//! Numbers that a snapshot holds.

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Numbers that a snapshot holds. In a binary format they are bytes, little-endian, because a
/// snapshot is little else.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers(Vec<f32>);

impl Numbers {
    /// Whether there are this many, and all are finite.
    pub fn is_sound(&self, length: usize) -> bool {
        self.len() == length && self.iter().all(|value| value.is_finite())
    }
}

impl Deref for Numbers {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.0
    }
}

impl DerefMut for Numbers {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.0
    }
}

impl From<Vec<f32>> for Numbers {
    fn from(numbers: Vec<f32>) -> Self {
        Self(numbers)
    }
}

impl FromIterator<f32> for Numbers {
    fn from_iter<I: IntoIterator<Item = f32>>(numbers: I) -> Self {
        Self(numbers.into_iter().collect())
    }
}

impl Serialize for Numbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            return self.0.serialize(serializer);
        }
        let bytes: Vec<u8> = self.0.iter().flat_map(|value| value.to_le_bytes()).collect();
        serializer.serialize_bytes(&bytes)
    }
}

impl<'de> Deserialize<'de> for Numbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            return Vec::deserialize(deserializer).map(Self);
        }
        deserializer.deserialize_bytes(NumberBytes)
    }
}

struct NumberBytes;

impl Visitor<'_> for NumberBytes {
    type Value = Numbers;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("numbers of four bytes")
    }

    fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Numbers, E> {
        let (numbers, rest) = bytes.as_chunks();
        if !rest.is_empty() {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        Ok(numbers.iter().map(|&number| f32::from_le_bytes(number)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_have_their_length_and_are_finite() {
        let numbers = Numbers::from(vec![1.0, -2.0]);
        assert!(numbers.is_sound(2) && !numbers.is_sound(3));
        assert!(!Numbers::from(vec![f32::NAN]).is_sound(1));
    }

    #[test]
    fn they_have_the_same_bits_in_text_and_in_bytes() {
        let values = [f32::MIN_POSITIVE, -0.1, 1e-45, f32::MAX, 0.0, -0.0, 1.0 / 3.0];
        let saved = Numbers::from(values.to_vec());
        let bits = |saved: &Numbers| saved.iter().map(|v| v.to_bits()).collect();
        let expected: Vec<u32> = bits(&saved);
        let text = serde_json::to_string(&saved).unwrap();
        assert_eq!(bits(&serde_json::from_str(&text).unwrap()), expected);
        let bytes = rmp_serde::to_vec(&saved).unwrap();
        assert!(bytes.len() < 4 * values.len() + 8);
        assert_eq!(bits(&rmp_serde::from_slice(&bytes).unwrap()), expected);
        // Two bytes are missing.
        let damaged = rmp_serde::to_vec(&DamagedNumbers).unwrap();
        assert!(rmp_serde::from_slice::<Numbers>(&damaged).is_err());
    }

    struct DamagedNumbers;

    impl Serialize for DamagedNumbers {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.serialize_bytes(&[0; 10])
        }
    }
}
