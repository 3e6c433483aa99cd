//! Numbers as a snapshot holds them.

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Numbers as a snapshot holds them. In a binary format they are bytes, little-endian, because a
/// snapshot is little else.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedNumbers(Vec<f32>);

impl SavedNumbers {
    /// These numbers.
    pub fn of(numbers: &[f32]) -> Self {
        Self(numbers.to_vec())
    }

    /// The numbers, if there are this many and all are finite.
    pub fn restore(self, length: usize) -> Option<Vec<f32>> {
        let Self(numbers) = self;
        let is_sound = numbers.len() == length && numbers.iter().all(|v| v.is_finite());
        is_sound.then_some(numbers)
    }
}

impl FromIterator<f32> for SavedNumbers {
    fn from_iter<I: IntoIterator<Item = f32>>(numbers: I) -> Self {
        Self(numbers.into_iter().collect())
    }
}

impl Serialize for SavedNumbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            return self.0.serialize(serializer);
        }
        let bytes: Vec<u8> = self.0.iter().flat_map(|value| value.to_le_bytes()).collect();
        serializer.serialize_bytes(&bytes)
    }
}

impl<'de> Deserialize<'de> for SavedNumbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            return Vec::deserialize(deserializer).map(Self);
        }
        deserializer.deserialize_bytes(NumberBytes)
    }
}

struct NumberBytes;

impl Visitor<'_> for NumberBytes {
    type Value = SavedNumbers;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("numbers of four bytes")
    }

    fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<SavedNumbers, E> {
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
        let saved = SavedNumbers::of(&[1.0, -2.0]);
        assert_eq!(saved.clone().restore(2), Some(vec![1.0, -2.0]));
        assert_eq!(saved.restore(3), None);
        assert_eq!(SavedNumbers::of(&[f32::NAN]).restore(1), None);
    }

    #[test]
    fn they_have_the_same_bits_in_text_and_in_bytes() {
        let values = [f32::MIN_POSITIVE, -0.1, 1e-45, f32::MAX, 0.0, -0.0, 1.0 / 3.0];
        let saved = SavedNumbers::of(&values);
        let bits = |saved: &SavedNumbers| saved.0.iter().map(|v| v.to_bits()).collect();
        let expected: Vec<u32> = bits(&saved);
        let text = serde_json::to_string(&saved).unwrap();
        assert_eq!(bits(&serde_json::from_str(&text).unwrap()), expected);
        let bytes = rmp_serde::to_vec(&saved).unwrap();
        assert!(bytes.len() < 4 * values.len() + 8);
        assert_eq!(bits(&rmp_serde::from_slice(&bytes).unwrap()), expected);
        // Two bytes are missing.
        let damaged = rmp_serde::to_vec(&DamagedNumbers).unwrap();
        assert!(rmp_serde::from_slice::<SavedNumbers>(&damaged).is_err());
    }

    struct DamagedNumbers;

    impl Serialize for DamagedNumbers {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.serialize_bytes(&[0; 10])
        }
    }
}
