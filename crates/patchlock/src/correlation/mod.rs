//! Correlation filters: features of a patch, their spectra, a filter with a spatial mask, the place
//! of a response's peak, and filters over scale and rotation.

pub mod batch;
pub mod colour;
pub mod features;
pub mod fhog;
pub mod filter;
pub mod fourier;
pub mod histogram;
pub mod lanes;
pub mod response;
pub mod rotation;
pub mod scale;
pub mod spectral_filter;
