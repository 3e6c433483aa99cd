//! The table's machinery: ranges, rows, and the macro that makes structs of them.

use super::Method;
use crate::patch_model::likelihood::{Gamma, Scales};
use std::fmt;

/// The values that a field may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// A number between two bounds, both allowed.
    Number {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// One of these words.
    Words(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Range::Number { min, max } => write!(f, "{min} to {max}"),
            Range::Words(words) => write!(f, "{}", words.join(", ")),
            Range::Flag => write!(f, "true, false"),
        }
    }
}

/// One row of the table: what `patchlock config` says of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The group that it belongs to: empty for the common ones, otherwise the name of a method.
    pub group: &'static str,
    /// The field's name, which no other group has.
    pub name: &'static str,
    /// The values that it may take.
    pub range: Range,
    /// Where its default comes from: a section and equations of the paper, another publication, or our own
    /// choice.
    pub source: &'static str,
    /// What it does.
    pub purpose: &'static str,
}

/// Any number from `min` to `max`.
pub(super) const fn number(min: f64, max: f64) -> Range {
    Range::Number { min, max }
}

/// A type that a field may have.
pub(super) trait Value: fmt::Debug {
    /// Whether it lies in the range. What the type alone ensures is always within.
    fn within(&self, _: Range) -> bool {
        true
    }
}

impl Value for bool {}
impl Value for Method {}
impl Value for Gamma {}
impl Value for Scales {}

macro_rules! number_values {
    ($($ty:ty),*) => {$(
        impl Value for $ty {
            fn within(&self, range: Range) -> bool {
                let value = *self as f64;
                matches!(range, Range::Number { min, max } if (min..=max).contains(&value))
            }
        }
    )*};
}
number_values!(u64, usize, f64);

/// Makes of the rows: [`TrackerConfig`](super::TrackerConfig) with the common fields and a field for each
/// group, the structs of the groups, their defaults, the checks of ranges, and `PARAMETERS`.
macro_rules! parameters {
    (
        common { $($common:tt)* }
        $($(#[doc = $group_doc:literal])+ $group:ident : $group_type:ident { $($rows:tt)* })*
    ) => {
        $crate::config::table::group! {
            /// Every number and choice of the tracker. The default is the preset `robust`.
            ///
            /// Make one with [`TrackerConfig::preset`] or `TrackerConfig::default()`, change fields, and give
            /// it to [`Tracker::new`](crate::Tracker::new), which checks it.
            #[derive(Debug, Clone, PartialEq, Serialize)]
            TrackerConfig ("") { $($common)* }
            $($(#[doc = $group_doc])+ $group : $group_type,)*
        }
        $(
            $crate::config::table::group! {
                $(#[doc = $group_doc])+
                #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
                #[serde(default, deny_unknown_fields)]
                $group_type (stringify!($group)) { $($rows)* }
            }
        )*

        /// The table of all fields: the common ones, then those of each group.
        pub const PARAMETERS: &[Parameter] = {
            const ALL: &[&[Parameter]] = &[TrackerConfig::ROWS, $($group_type::ROWS),*];
            const COUNT: usize = {
                let (mut count, mut k) = (0, 0);
                while k < ALL.len() {
                    count += ALL[k].len();
                    k += 1;
                }
                count
            };
            &$crate::config::table::concat::<COUNT>(ALL)
        };
    };
}

/// One struct of the configuration, with the structs of its groups as further fields.
macro_rules! group {
    (
        $(#[$meta:meta])+
        $name:ident ($title:expr) {
            $($source:literal {
                $($(#[doc = $doc:literal])+ $field:ident : $ty:ty = $default:expr, $range:expr;)*
            })*
        }
        $($(#[doc = $inner_doc:literal])+ $inner:ident : $inner_type:ident,)*
    ) => {
        $(#[$meta])+
        pub struct $name {
            $($(
                $(#[doc = $doc])+
                #[doc = concat!(
                    "\n\nDefault `", stringify!($default), "`; allowed: `", stringify!($range), "`; source: ",
                    $source, "."
                )]
                pub $field: $ty,
            )*)*
            $($(#[doc = $inner_doc])+ pub $inner: $inner_type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($($field: $default,)*)* $($inner: $inner_type::default(),)* }
            }
        }

        impl $name {
            /// The rows of this group.
            const ROWS: &'static [Parameter] = &[$($(
                Parameter {
                    group: $title,
                    name: stringify!($field),
                    range: $range,
                    source: $source,
                    purpose: concat!($($doc),+).trim_ascii(),
                },
            )*)*];

            /// Reads the group of this name, if there is one.
            #[allow(dead_code, unused_variables, reason = "a group has no groups in it")]
            fn read_group<'de, A: serde::de::MapAccess<'de>>(
                &mut self,
                name: &str,
                map: &mut A,
            ) -> Result<bool, A::Error> {
                $(if name == stringify!($inner) {
                    self.$inner = map.next_value()?;
                    return Ok(true);
                })*
                Ok(false)
            }

            /// Reads the field of this name in any of the groups, and returns the group, if there is one.
            #[allow(dead_code, unused_variables, reason = "a group has no groups in it")]
            fn read_in_groups<'de, A: serde::de::MapAccess<'de>>(
                &mut self,
                name: &str,
                map: &mut A,
            ) -> Result<Option<&'static str>, A::Error> {
                $(if self.$inner.read_field(name, map)? {
                    return Ok(Some(stringify!($inner)));
                })*
                Ok(None)
            }

            /// Reads the field of this name, if there is one.
            fn read_field<'de, A: serde::de::MapAccess<'de>>(
                &mut self,
                name: &str,
                map: &mut A,
            ) -> Result<bool, A::Error> {
                match name {
                    $($(stringify!($field) => self.$field = map.next_value()?,)*)*
                    _ => return Ok(false),
                }
                Ok(true)
            }

            fn check_ranges(&self) -> Result<(), Error> {
                $($(
                    if !self.$field.within($range) {
                        return Err(Error::Config {
                            field: stringify!($field),
                            value: format!("{:?}", self.$field),
                            allowed: $range.to_string(),
                        });
                    }
                )*)*
                $(self.$inner.check_ranges()?;)*
                Ok(())
            }
        }
    };
}

/// All rows one after the other.
pub(super) const fn concat<const COUNT: usize>(groups: &[&[Parameter]]) -> [Parameter; COUNT] {
    let mut all = [groups[0][0]; COUNT];
    let (mut group, mut next) = (0, 0);
    while group < groups.len() {
        let mut k = 0;
        while k < groups[group].len() {
            all[next] = groups[group][k];
            next += 1;
            k += 1;
        }
        group += 1;
    }
    all
}

pub(super) use {group, parameters};
