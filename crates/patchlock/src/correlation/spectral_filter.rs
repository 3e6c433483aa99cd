//! Filters that are learnt and held as spectra.

use super::fourier::Complex32;
use super::lanes;
use crate::numeric::numbers::Numbers;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A filter that is the quotient of two spectra.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SpectralFilter {
    /// The conjugate numerator: bin by bin, the features side by side.
    #[serde(serialize_with = "serialize_spectrum", deserialize_with = "deserialize_spectrum")]
    pub numerator: Vec<Complex32>,
    /// The denominator of each bin.
    pub denominator: Vec<f32>,
}

impl SpectralFilter {
    /// Learns the spectra of a sample at this rate.
    pub fn learn(&mut self, label: &[Complex32], sample: &[Complex32], rate: f32) {
        let Self { numerator, denominator } = self;
        numerator.resize(sample.len(), Complex32::ZERO);
        denominator.resize(label.len(), 0.0);
        lanes::learn(label, sample, rate, (numerator, denominator));
    }

    /// Whether it has this many features and bins, and all numbers are ones that learning can lead
    /// to.
    pub fn is_sound(&self, features: usize, bins: usize) -> bool {
        let Self { numerator, denominator } = self;
        numerator.len() == features * bins
            && numerator.iter().all(|value| value.is_finite())
            && denominator.len() == bins
            && denominator.iter().all(|value| value.is_finite() && *value >= 0.0)
    }
}

/// Writes real and imaginary parts in turn.
fn serialize_spectrum<S: Serializer>(spectrum: &[Complex32], to: S) -> Result<S::Ok, S::Error> {
    let parts = spectrum.iter().flat_map(|value| [value.re, value.im]);
    parts.collect::<Numbers>().serialize(to)
}

fn deserialize_spectrum<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Complex32>, D::Error> {
    let numbers = Numbers::deserialize(from)?;
    // A last real part without its imaginary part makes a filter that is not sound.
    let value = |parts: &[f32]| Complex32::new(parts[0], *parts.get(1).unwrap_or(&f32::NAN));
    Ok(numbers.chunks(2).map(value).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_has_its_length_and_numbers_that_learning_can_lead_to() {
        let text = r#"{"numerator":[1.0,-2.0,0.5,3.0],"denominator":[0.0,1.0]}"#;
        let read = |text: &str| serde_json::from_str::<SpectralFilter>(text).unwrap();
        let good = read(text);
        assert_eq!(good.numerator, [Complex32::new(1.0, -2.0), Complex32::new(0.5, 3.0)]);
        assert_eq!(serde_json::to_string(&good).unwrap(), text);
        assert!(good.is_sound(1, 2) && !good.is_sound(2, 2) && !good.is_sound(1, 1));
        // A part less, a bin less, a negative energy.
        for (from, to) in [(",3.0", ""), (",1.0]", "]"), ("[0.0", "[-1.0")] {
            assert!(!read(&text.replace(from, to)).is_sound(1, 2), "{from}");
        }
        let damaged = SpectralFilter { numerator: vec![f32::NAN.into(); 2], ..good };
        assert!(!damaged.is_sound(1, 2));
    }
}
