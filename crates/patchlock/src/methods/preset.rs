//! Presets: named settings to begin with.

use super::Preset;
use crate::Error;
use crate::config::MethodInfo;
use std::fmt;
use std::str::FromStr;

impl Preset {
    /// The name, in lower case.
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// What is known of its method.
    pub fn info(self) -> &'static MethodInfo {
        self.method().info()
    }
}

impl Default for Preset {
    fn default() -> Self {
        Self::ALL[0]
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
