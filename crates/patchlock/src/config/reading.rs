//! Reads a configuration: groups as tables, and for files of version 0.1 also their fields without a group.
//! Such a file means the paper's tracker, which was the only method, unless it names another one.

use super::{Method, TrackerConfig};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use std::fmt;

/// Options of version 0.1 that no longer exist, with the value that is always used now (`None`: any).
const REMOVED: &[(&str, Option<Scalar>)] = &[
    ("scale_motion", Some(Scalar::Word("absolute"))),
    ("outside", Some(Scalar::Word("zero"))),
    ("selection", Some(Scalar::Word("order_recursive"))),
    ("stop_energy", Some(Scalar::Number(0.0))),
    ("coefficients", Some(Scalar::Word("absolute"))),
    ("divide", Some(Scalar::Flag(true))),
    ("first_templates", Some(Scalar::Word("shifts"))),
    ("warm_up_frames", None),
];

/// A value of a removed option.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scalar {
    Flag(bool),
    Number(f64),
    Word(&'static str),
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// A value of any kind, as a file has it.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Given {
    Flag(bool),
    Number(f64),
    Word(String),
}

impl Given {
    fn is(&self, scalar: Scalar) -> bool {
        match (self, scalar) {
            (Self::Flag(a), Scalar::Flag(b)) => *a == b,
            (Self::Number(a), Scalar::Number(b)) => *a == b,
            (Self::Word(a), Scalar::Word(b)) => a == b,
            _ => false,
        }
    }
}

impl<'de> Deserialize<'de> for TrackerConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ConfigVisitor)
    }
}

struct ConfigVisitor;

impl<'de> Visitor<'de> for ConfigVisitor {
    type Value = TrackerConfig;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table of settings")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<TrackerConfig, A::Error> {
        let mut config = TrackerConfig::default();
        let mut groups = Vec::new();
        // Fields outside of their groups, as version 0.1 has them.
        let mut loose = Vec::new();
        let (mut names_method, mut of_0_1) = (false, false);
        while let Some(name) = map.next_key::<String>()? {
            if config.read_group(&name, &mut map)? {
                groups.push(name);
            } else if let Some(group) = config.read_in_groups(&name, &mut map)? {
                of_0_1 |= group == Method::Patchwise.name();
                loose.push((name, group));
            } else if config.read_field(&name, &mut map)? {
                names_method |= name == "method";
            } else {
                refuse_or_skip(&name, &mut map)?;
                of_0_1 = true;
            }
        }
        if of_0_1 && !names_method {
            config.method = Method::Patchwise;
        }
        // Which of the two counts would depend on their order.
        let twice = loose.iter().find(|(_, group)| groups.iter().any(|given| given == group));
        match twice {
            Some((name, group)) => {
                let reason = format!("`{name}` belongs to the group `{group}`, which is given");
                Err(A::Error::custom(reason))
            }
            None => Ok(config),
        }
    }
}

/// Skips a removed option whose value is what is always done now; refuses all other unknown names.
fn refuse_or_skip<'de, A: MapAccess<'de>>(name: &str, map: &mut A) -> Result<(), A::Error> {
    let Some((_, kept)) = REMOVED.iter().find(|(removed, _)| *removed == name) else {
        return Err(A::Error::custom(format!("unknown setting `{name}`")));
    };
    let given: Given = map.next_value()?;
    match kept {
        Some(kept) if !given.is(*kept) => Err(A::Error::custom(format!(
            "the option `{name}` no longer exists; its value is always `{kept}` now"
        ))),
        _ => Ok(()),
    }
}
