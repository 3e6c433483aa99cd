//! The configuration of a tracker, and the table of all settings.

use super::{Method, Preset};
use crate::Error;
use crate::config::{NetworkUse, Parameter, PatchModelConfig, SEED, Setting, checked, concat};
use crate::network::Network;
use crate::network_error::NetworkError;
use crate::value::Value;
use serde::Serialize;

/// The table of all settings: those of all methods, then those of each group.
pub const PARAMETERS: &[Parameter] = {
    const ALL: &[&[Parameter]] = Method::GROUPS;
    const COUNT: usize = {
        let (mut count, mut k) = (0, 0);
        while k < ALL.len() {
            count += ALL[k].len();
            k += 1;
        }
        count
    };
    &concat::<COUNT>(ALL)
};

/// Every number and choice of a tracker. The default is [`Preset::Robust`].
///
/// Begin with a [`Preset`], or with the settings of a method, and change what differs:
///
/// ```
/// use patchlock::{Method, PaperConfig, Preset, TrackerConfig};
///
/// let mut paper = PaperConfig::default();
/// paper.particles = 300;
/// let config = TrackerConfig::from(paper);
///
/// let mut same = TrackerConfig::from(Preset::Paper);
/// same.set("particles", 300)?;
/// assert_eq!(config, same);
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// Serialised, it is a table with `seed` and one table with the name and the settings of the
/// method. Settings that are missing when it is read have their defaults. The network is not
/// written: it has to be given again.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TrackerConfig {
    /// Seed of all randomness: the same seed gives the same boxes. Default 0; allowed: 0 to 2^53
    /// - 1.
    pub seed: u64,
    /// The method that follows the target, with its settings.
    #[serde(flatten)]
    pub method: Method,
    /// A network: the method `network` needs one, `robust` is right more often with one, and `paper`
    /// has none. Default: none; `Network::patchnet()` is our own.
    #[serde(skip)]
    pub network: Option<Network>,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Preset::default().into()
    }
}

impl From<Preset> for TrackerConfig {
    fn from(preset: Preset) -> Self {
        Self { seed: 0, method: preset.method(), network: None }
    }
}

impl Parameter {
    /// The row of the setting with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|row| row.name == name)
    }

    /// Whether users may rely on the setting with this method. The other ones are for research: they
    /// change without notice.
    pub fn is_stable_for(&self, method: &Method) -> bool {
        method.settings().is_stable(self)
    }

    /// Whether this method uses the setting.
    pub fn is_used_by(&self, method: &Method) -> bool {
        match self.group {
            "" => true,
            "patches" => method.patches().is_some(),
            group => group == method.name(),
        }
    }
}

impl TrackerConfig {
    /// The value of the setting with this name in [`PARAMETERS`].
    ///
    /// # Errors
    /// [`Error::UnknownSetting`]; [`Error::UnusedSetting`] if it belongs to another method.
    pub fn get(&self, name: &str) -> Result<Value, Error> {
        let parameter = self.parameter(name)?;
        if parameter.name == SEED.name {
            return Ok(self.seed.value());
        }
        self.method
            .settings()
            .get(name)
            .ok_or_else(|| Error::UnknownSetting { name: name.to_owned() })
    }

    /// Changes the setting with this name in [`PARAMETERS`].
    ///
    /// # Errors
    /// As [`TrackerConfig::get`]; [`Error::SettingKind`] and [`Error::Config`] if the value is of
    /// another kind or out of range. Then nothing has changed.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) -> Result<(), Error> {
        let (parameter, value) = (self.parameter(name)?, value.into());
        if parameter.name == SEED.name {
            self.seed = checked(parameter, &value)?;
            return Ok(());
        }
        self.method.settings_mut().set(parameter, &value)
    }

    /// Whether the tracker reads the setting: its method uses it, and no other setting turns it
    /// off.
    pub fn reads(&self, parameter: &Parameter) -> bool {
        let settings = self.method.settings();
        parameter.is_used_by(&self.method) && settings.reads(parameter.name, self.network.is_some())
    }

    /// The row of a setting that the method uses.
    fn parameter(&self, name: &str) -> Result<&'static Parameter, Error> {
        let unknown = || Error::UnknownSetting { name: name.to_owned() };
        let parameter = Parameter::named(name).ok_or_else(unknown)?;
        let Parameter { group, name, .. } = *parameter;
        if parameter.is_used_by(&self.method) {
            return Ok(parameter);
        }
        Err(Error::UnusedSetting { name, method: self.method.name(), owner: group })
    }

    /// Checks that there is a network if the method needs one.
    ///
    /// # Errors
    /// [`NetworkError::None`] if the method needs one and there is none.
    pub(crate) fn check_network(&self) -> Result<(), Error> {
        match (self.method.info().network, &self.network) {
            (NetworkUse::Required, None) => Err(NetworkError::None.into()),
            _ => Ok(()),
        }
    }

    /// Checks every setting against its range, and the settings that must fit each other. Whether
    /// there is the network that the method needs is checked when a tracker starts.
    ///
    /// # Errors
    /// [`Error::Config`] names the first setting that is wrong, its value and what is allowed.
    pub fn validate(&self) -> Result<(), Error> {
        let _: u64 = checked(&SEED, &self.seed.value())?;
        let settings = self.method.settings();
        settings.check_ranges()?;
        settings.check()?;
        settings.patches().map_or(Ok(()), PatchModelConfig::check)
    }
}
