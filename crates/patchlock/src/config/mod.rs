//! What the settings of methods are made of: every number and choice, in one table, in groups.
//!
//! Each group is a file: `config.rs` of a tracker's folder, and [`patches`] for the patch model that
//! two of them use. The macro call in it *is* its part of the table. Each row is a setting with its
//! type, default, range, purpose and source. The structs, their defaults, the checks of ranges,
//! access by name ([`SettingsGroup`]) and [`PARAMETERS`](crate::PARAMETERS) are all made from the
//! rows, so they cannot disagree.

mod info;
mod patches;
mod table;

use crate::Error;
use crate::value::Value;
pub use info::{MethodInfo, NetworkUse};
pub use patches::PatchModelConfig;
pub use table::{Parameter, Range};
pub(crate) use table::{STABLE, Setting, checked, concat, group, number};

/// The largest seed: every file format keeps whole numbers up to it.
const MAX_SEED: f64 = 9_007_199_254_740_991.0;

/// The seed, the only setting of all methods.
pub(crate) const SEED: Parameter = Parameter {
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
