//! The table's machinery: ranges, rows, and the macro that makes structs of them.

use crate::Error;
use crate::patch_model::likelihood::{Gamma, Scales};
use crate::value::{Kind, Value};
use std::fmt;

/// The values that a setting may take.
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

impl Range {
    fn contains(self, number: f64) -> bool {
        matches!(self, Self::Number { min, max } if (min..=max).contains(&number))
    }
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

/// A row of the table: one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Parameter {
    /// The group: empty for a setting of all methods, the name of a method, or `patches` for the
    /// patch model, which `robust` and `paper` use.
    pub group: &'static str,
    /// The name, which no other setting has.
    pub name: &'static str,
    /// The kind of value that it takes.
    pub kind: Kind,
    /// The values that it may take.
    pub range: Range,
    /// Where its default comes from: a section and equations of the paper, another publication, or
    /// our own choice.
    pub source: &'static str,
    /// What it does, in one sentence.
    pub purpose: &'static str,
    /// Whether it is stable for the method `robust`.
    pub(crate) is_stable: bool,
}

/// Marks a row of `robust`: a setting that a user has a reason to change. The other ones are for
/// research: they change without notice.
pub(crate) const STABLE: bool = true;

/// Any number from `min` to `max`.
pub(crate) const fn number(min: f64, max: f64) -> Range {
    Range::Number { min, max }
}

/// The type of a setting.
pub(crate) trait Setting: Sized {
    const KIND: Kind;

    fn value(&self) -> Value;

    /// The setting with this value; `None` if the value is of another kind. A whole number is a
    /// number, too.
    fn of(value: &Value) -> Option<Self>;

    /// Whether it lies in the range. What the type alone ensures is always within.
    fn within(&self, _: Range) -> bool {
        true
    }
}

impl Setting for bool {
    const KIND: Kind = Kind::Flag;

    fn value(&self) -> Value {
        Value::Flag(*self)
    }

    fn of(value: &Value) -> Option<Self> {
        match value {
            Value::Flag(flag) => Some(*flag),
            _ => None,
        }
    }
}

impl Setting for f64 {
    const KIND: Kind = Kind::Number;

    fn value(&self) -> Value {
        Value::Number(*self)
    }

    fn of(value: &Value) -> Option<Self> {
        match value {
            Value::Number(number) => Some(*number),
            Value::Whole(number) => Some(*number as f64),
            _ => None,
        }
    }

    fn within(&self, range: Range) -> bool {
        range.contains(*self)
    }
}

macro_rules! whole_settings {
    ($($ty:ty),*) => {$(
        impl Setting for $ty {
            const KIND: Kind = Kind::Whole;

            fn value(&self) -> Value {
                Value::from(*self)
            }

            fn of(value: &Value) -> Option<Self> {
                match value {
                    Value::Whole(number) => Self::try_from(*number).ok(),
                    _ => None,
                }
            }

            fn within(&self, range: Range) -> bool {
                range.contains(*self as f64)
            }
        }
    )*};
}
whole_settings!(u64, usize);

macro_rules! word_settings {
    ($($ty:ty),*) => {$(
        impl Setting for $ty {
            const KIND: Kind = Kind::Word;

            fn value(&self) -> Value {
                Value::from(Self::WORDS[*self as usize])
            }

            fn of(value: &Value) -> Option<Self> {
                let Value::Word(word) = value else { return None };
                Self::ALL.into_iter().find(|choice| Self::WORDS[*choice as usize] == word)
            }
        }
    )*};
}
word_settings!(Gamma, Scales);

/// The setting with this value.
///
/// # Errors
/// [`Error::SettingKind`] for a value of another kind; [`Error::Config`] for one out of range.
pub(crate) fn checked<T: Setting>(parameter: &Parameter, value: &Value) -> Result<T, Error> {
    let Parameter { name, kind, range, .. } = *parameter;
    let outside =
        || Error::Config { field: name, value: value.to_string(), allowed: range.to_string() };
    match (T::of(value), kind, value) {
        (Some(setting), ..) if setting.within(range) => Ok(setting),
        (Some(_), ..)
        | (None, Kind::Word, Value::Word(_))
        | (None, Kind::Whole, Value::Whole(_)) => Err(outside()),
        _ => Err(Error::SettingKind { name, value: value.to_string(), kind }),
    }
}

/// Makes a struct of the rows of a group, with its default, its rows as a table, and access by
/// name. A group may hold another one as a field.
macro_rules! group {
    (
        $(#[$meta:meta])+
        $name:ident ($title:literal) { $($inner:ident : $inner_type:ident = $inner_default:expr)? }
        $($source:literal {
            $($(#[doc = $doc:literal])+ $field:ident : $ty:ty = $default:expr, $range:expr $(, $stable:expr)?;)*
        })*
    ) => {
        $(#[$meta])+
        #[derive(Debug, Clone, PartialEq, serde::Serialize)]
        #[non_exhaustive]
        pub struct $name {
            $($(
                $(#[doc = $doc])+
                #[doc = concat!(
                    "\n\nDefault `", stringify!($default), "`; allowed: `", stringify!($range), "`; source: ",
                    $source, "."
                )]
                pub $field: $ty,
            )*)*
            $(
                /// The patch model.
                pub $inner: $inner_type,
            )?
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($($field: $default,)*)* $($inner: $inner_default,)? }
            }
        }

        impl $name {
            /// The name of this group.
            pub(crate) const NAME: &'static str = $title;

            /// The rows of this group.
            pub(crate) const ROWS: &'static [$crate::config::Parameter] = &[$($(
                $crate::config::Parameter {
                    group: Self::NAME,
                    name: stringify!($field),
                    kind: <$ty as $crate::config::Setting>::KIND,
                    range: $range,
                    source: $source,
                    purpose: concat!($($doc),+).trim_ascii(),
                    is_stable: false $(|| $stable)?,
                },
            )*)*];
        }

        impl $crate::config::SettingsGroup for $name {
            fn get(&self, name: &str) -> Option<$crate::value::Value> {
                match name {
                    $($(stringify!($field) => {
                        Some($crate::config::Setting::value(&self.$field))
                    })*)*
                    _ => None $(.or_else(|| $crate::config::SettingsGroup::get(&self.$inner, name)))?,
                }
            }

            fn set(
                &mut self,
                parameter: &$crate::config::Parameter,
                value: &$crate::value::Value,
            ) -> Result<(), $crate::Error> {
                match parameter.name {
                    $($(stringify!($field) => {
                        self.$field = $crate::config::checked(parameter, value)?;
                    })*)*
                    _ => { $($crate::config::SettingsGroup::set(&mut self.$inner, parameter, value)?;)? }
                }
                Ok(())
            }

            fn check_ranges(&self) -> Result<(), $crate::Error> {
                $($(
                    if !$crate::config::Setting::within(&self.$field, $range) {
                        return Err($crate::Error::Config {
                            field: stringify!($field),
                            value: $crate::config::Setting::value(&self.$field).to_string(),
                            allowed: $range.to_string(),
                        });
                    }
                )*)*
                $($crate::config::SettingsGroup::check_ranges(&self.$inner)?;)?
                Ok(())
            }
        }
    };
}

/// All rows one after the other.
pub(crate) const fn concat<const COUNT: usize>(groups: &[&[Parameter]]) -> [Parameter; COUNT] {
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

pub(crate) use group;
