//! Presets: named settings to begin with.

use super::{Method, MethodInfo, NetworkConfig, PaperConfig, RobustConfig};
use crate::Error;
use std::fmt;
use std::str::FromStr;

/// Named settings to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Preset {
    /// The default: correlation filters follow the target, a memory finds it again after a loss.
    #[default]
    Robust,
    /// The tracker of the paper.
    Paper,
    /// A network alone; see [`TrackerConfig::network`](crate::TrackerConfig::network).
    Network,
}

impl Preset {
    /// All presets, the default first.
    pub const ALL: [Self; 3] = [Self::Robust, Self::Paper, Self::Network];

    /// The name, in lower case.
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// What is known of its method.
    pub fn info(self) -> &'static MethodInfo {
        self.method().info()
    }

    /// The method and its settings.
    pub(super) fn method(self) -> Method {
        match self {
            Self::Robust => Method::Robust(RobustConfig::default()),
            Self::Paper => Method::Paper(PaperConfig::default()),
            Self::Network => Method::Network(NetworkConfig::default()),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = Error;

    /// The preset of this name.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] names the presets that exist.
    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::UnknownPreset { name: name.to_owned(), known }
        })
    }
}
