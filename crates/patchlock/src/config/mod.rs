//! The configuration: every number and choice, in one table, in groups.
//!
//! Each group is a file: [`paper`], [`robust`], [`network`], and [`patches`] for the patch model
//! that the first two use. The macro call in it *is* its part of the table. Each row is a setting with its
//! type, default, range, purpose and source. The structs, their defaults, the checks of ranges,
//! access by name ([`TrackerConfig::get`], [`TrackerConfig::set`]) and [`PARAMETERS`] are all made
//! from the rows, so they cannot disagree.

mod info;
mod network;
mod paper;
mod patches;
mod preset;
mod reading;
mod robust;
mod table;

use crate::Error;
use crate::network::Network;
use crate::network_error::NetworkError;
use serde::Serialize;

use crate::value::Value;
pub use info::{MethodInfo, NetworkUse};
pub use network::NetworkConfig;
pub use paper::PaperConfig;
pub use patches::PatchModelConfig;
pub use preset::Preset;
pub use robust::RobustConfig;
pub use table::{Parameter, Range};
use table::{Setting, checked, number};

/// The largest seed: every file format keeps whole numbers up to it.
const MAX_SEED: f64 = 9_007_199_254_740_991.0;

/// The seed, the only setting of all methods.
const SEED: Parameter = Parameter {
    group: "",
    name: "seed",
    kind: <u64 as Setting>::KIND,
    range: number(0.0, MAX_SEED),
    source: "own choice",
    purpose: "Seed of all randomness: the same seed gives the same boxes.",
    is_stable: true,
};

/// Access by name to a group of settings, and to the one in it; [`table::group`] implements it.
pub(crate) trait SettingsGroup {
    /// The value of the setting of this name, if there is one.
    fn get(&self, name: &str) -> Option<Value>;

    /// Changes a setting.
    ///
    /// # Errors
    /// As [`checked`]; then nothing has changed.
    fn set(&mut self, parameter: &Parameter, value: &Value) -> Result<(), Error>;

    /// Checks all ranges.
    ///
    /// # Errors
    /// [`Error::Config`] names the first setting that is out of range.
    fn check_ranges(&self) -> Result<(), Error>;
}

/// The settings of a method, and what they say of it.
pub(crate) trait MethodConfig: SettingsGroup {
    /// What is known of the method without its settings.
    fn info(&self) -> &'static MethodInfo;

    /// The patch model, if the method has one.
    fn patches(&self) -> Option<&PatchModelConfig> {
        None
    }

    /// Whether the tracker reads the setting of this name: no other setting turns it off.
    fn reads(&self, _name: &str, _has_network: bool) -> bool {
        true
    }

    /// Whether users may rely on the setting of this row.
    fn is_stable(&self, _row: &Parameter) -> bool {
        true
    }

    /// Whether the tracker works on grey frames.
    fn needs_grey(&self) -> bool {
        false
    }

    /// Checks the settings that a range cannot express.
    ///
    /// # Errors
    /// [`Error::Config`] names the setting that is wrong.
    fn check(&self) -> Result<(), Error> {
        Ok(())
    }
}

/// The table of all settings: those of all methods, then those of each group.
pub const PARAMETERS: &[Parameter] = {
    const ALL: &[&[Parameter]] = &[
        &[SEED],
        RobustConfig::ROWS,
        PaperConfig::ROWS,
        PatchModelConfig::ROWS,
        NetworkConfig::ROWS,
    ];
    const COUNT: usize = {
        let (mut count, mut k) = (0, 0);
        while k < ALL.len() {
            count += ALL[k].len();
            k += 1;
        }
        count
    };
    &table::concat::<COUNT>(ALL)
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

/// The methods of tracking, with their settings.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
#[expect(clippy::large_enum_variant, reason = "a tracker has one")]
pub enum Method {
    /// The default tracker: correlation filters that follow and remember the target, and the
    /// paper's patch model, which sees what is hidden.
    Robust(RobustConfig),
    /// The paper's tracker: particles, weighed by structural local sparse appearance.
    Paper(PaperConfig),
    /// A network, [`TrackerConfig::network`], in the loop that was published with it.
    Network(NetworkConfig),
}

impl Method {
    /// The names of all methods.
    pub const NAMES: [&'static str; 3] =
        [RobustConfig::NAME, PaperConfig::NAME, NetworkConfig::NAME];

    /// What is known of the method without its settings.
    pub fn info(&self) -> &'static MethodInfo {
        self.settings().info()
    }

    /// The name of the method, which is also that of its group of settings.
    pub fn name(&self) -> &'static str {
        self.info().name
    }

    /// The patch model, if the method has one.
    pub fn patches(&self) -> Option<&PatchModelConfig> {
        self.settings().patches()
    }

    pub(crate) fn settings(&self) -> &dyn MethodConfig {
        match self {
            Self::Robust(config) => config,
            Self::Paper(config) => config,
            Self::Network(config) => config,
        }
    }

    fn settings_mut(&mut self) -> &mut dyn MethodConfig {
        match self {
            Self::Robust(config) => config,
            Self::Paper(config) => config,
            Self::Network(config) => config,
        }
    }
}

impl Default for TrackerConfig {
    fn default() -> Self {
        RobustConfig::default().into()
    }
}

impl From<Preset> for TrackerConfig {
    fn from(preset: Preset) -> Self {
        Self { seed: 0, method: preset.method(), network: None }
    }
}

impl From<RobustConfig> for TrackerConfig {
    fn from(config: RobustConfig) -> Self {
        Self { seed: 0, method: Method::Robust(config), network: None }
    }
}

impl From<PaperConfig> for TrackerConfig {
    fn from(config: PaperConfig) -> Self {
        Self { seed: 0, method: Method::Paper(config), network: None }
    }
}

impl From<NetworkConfig> for TrackerConfig {
    fn from(config: NetworkConfig) -> Self {
        Self { seed: 0, method: Method::Network(config), network: None }
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
