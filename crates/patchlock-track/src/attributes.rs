//! Attributes that a label declares: their names, and which values its targets may have. A value is
//! a text, as in the files of annotation tools.

use serde::{Deserialize, Serialize};

/// Longest name, in characters.
pub const NAME: usize = 100;
/// Longest value, in characters.
pub const VALUE: usize = 1000;
/// Most values of a choice.
pub const CHOICES: usize = 200;
/// Most attributes of a label, or of a target.
pub const ATTRIBUTES: usize = 100;
/// Largest number, and smallest with the other sign.
pub const NUMBER: f64 = 1e9;
/// Names under which exports say something else of a box.
pub const RESERVED: [&str; 6] =
    ["keyframe", "occluded", "status", "track_id", "truncated", "visible"];

/// An attribute that a label declares for its targets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Form")]
pub struct Attribute {
    /// Its name, unique in its label.
    pub name: String,
    /// Which values there are.
    #[serde(flatten)]
    pub kind: Kind,
    /// The value where nobody has said another one.
    pub default: String,
    /// Whether it may change from frame to frame; otherwise it has one value in all frames.
    pub mutable: bool,
}

/// The values of an attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Kind {
    /// `true` or `false`.
    Checkbox,
    /// One of these.
    Select {
        /// The values, in the order in which they are offered.
        values: Vec<String>,
    },
    /// `min`, and what is any number of steps above it, up to `max`.
    Number {
        /// The smallest value.
        min: f64,
        /// The largest value.
        max: f64,
        /// The distance of neighbouring values.
        step: f64,
    },
    /// Any text without control characters.
    Text {
        /// Its greatest length, in characters.
        length: usize,
    },
}

impl Kind {
    /// The name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Checkbox => "checkbox",
            Self::Select { .. } => "select",
            Self::Number { .. } => "number",
            Self::Text { .. } => "text",
        }
    }

    /// The value of an attribute of this kind whose declaration has none.
    pub fn first_value(&self) -> String {
        match self {
            Self::Checkbox => "false".to_owned(),
            Self::Select { values } => values.first().cloned().unwrap_or_default(),
            Self::Number { min, .. } => min.to_string(),
            Self::Text { .. } => String::new(),
        }
    }

    fn check(&self) -> Result<(), String> {
        match self {
            Self::Checkbox => Ok(()),
            Self::Select { values } => check_choices(values),
            Self::Number { min, max, step } => check_range(*min, *max, *step),
            Self::Text { length } => match (1..=VALUE).contains(length) {
                true => Ok(()),
                false => Err(format!("its length is {length}; allowed: 1 to {VALUE}")),
            },
        }
    }
}

fn check_choices(values: &[String]) -> Result<(), String> {
    if values.is_empty() || values.len() > CHOICES {
        return Err(format!("it has {} values; allowed: 1 to {CHOICES}", values.len()));
    }
    for (k, value) in values.iter().enumerate() {
        if value.trim() != value || value.is_empty() {
            return Err(format!("its value {value:?} is empty, or has a space at an end"));
        }
        check_text(value, NAME)?;
        if values[..k].contains(value) {
            return Err(format!("its value {value:?} appears twice"));
        }
    }
    Ok(())
}

fn check_range(min: f64, max: f64, step: f64) -> Result<(), String> {
    let is_possible = |value: f64| (-NUMBER..=NUMBER).contains(&value);
    // NaN is not possible, and no step.
    match is_possible(min) && is_possible(max) && min < max && step > 0.0 && step <= max - min {
        true => Ok(()),
        false => Err(format!(
            "its numbers go from {min} to {max} in steps of {step}; the first must be below the second, both \
             within {NUMBER} of 0, and a step above 0 and at most their difference"
        )),
    }
}

fn check_text(text: &str, most: usize) -> Result<(), String> {
    let length = text.chars().count();
    match length > most || text.chars().any(char::is_control) {
        true => Err(format!(
            "{:?} has {length} characters; allowed: at most {most}, no control characters",
            text.chars().take(50).collect::<String>()
        )),
        false => Ok(()),
    }
}

impl Attribute {
    /// Checks the declaration.
    ///
    /// # Errors
    /// What is wrong with it, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let Self { name, kind, default, .. } = self;
        if name.trim() != name || name.is_empty() {
            return Err(format!(
                "the name {name:?} of an attribute is empty, or has a space at an end"
            ));
        }
        check_text(name, NAME).map_err(|reason| format!("the name of an attribute: {reason}"))?;
        if RESERVED.contains(&name.as_str()) {
            return Err(format!(
                "an attribute cannot have the name {name:?}; {} are in exports already",
                RESERVED.join(", ")
            ));
        }
        let of_it = |reason: String| format!("the attribute {name:?}: {reason}");
        kind.check().map_err(of_it)?;
        self.allows(default).map_err(|reason| format!("the default of {reason}"))
    }

    /// Checks a value.
    ///
    /// # Errors
    /// What is wrong with it, and what is allowed.
    pub fn allows(&self, value: &str) -> Result<(), String> {
        let allowed = match &self.kind {
            Kind::Checkbox if matches!(value, "true" | "false") => return Ok(()),
            Kind::Checkbox => "true, false".to_owned(),
            Kind::Select { values } if values.iter().any(|known| known == value) => return Ok(()),
            Kind::Select { values } => {
                values.iter().take(20).cloned().collect::<Vec<_>>().join(", ")
            }
            Kind::Number { min, max, step } => {
                let number = value.parse::<f64>().ok().filter(|number| {
                    let steps = (number - min) / step;
                    (*min..=*max).contains(number) && (steps - steps.round()).abs() < 1e-6
                });
                match number {
                    Some(_) => return Ok(()),
                    None => format!("{min} to {max} in steps of {step}"),
                }
            }
            Kind::Text { length } => {
                return check_text(value, *length).map_err(|reason| {
                    format!("the attribute {:?}: the value {reason}", self.name)
                });
            }
        };
        Err(format!(
            "the attribute {:?} is {:?}; allowed: {allowed}",
            self.name,
            value.chars().take(50).collect::<String>()
        ))
    }

    /// A value of it in JSON: a truth value, a number or a text.
    pub fn json(&self, value: &str) -> serde_json::Value {
        match &self.kind {
            Kind::Checkbox => serde_json::Value::Bool(value == "true"),
            Kind::Number { .. } => match value.parse::<f64>() {
                Ok(number) if number.fract() == 0.0 => (number as i64).into(),
                Ok(number) => number.into(),
                Err(_) => value.into(),
            },
            Kind::Select { .. } | Kind::Text { .. } => value.into(),
        }
    }
}

/// Checks the attributes of a label.
///
/// # Errors
/// As [`Attribute::check`]; if there are too many, or two have the same name.
pub fn check(attributes: &[Attribute]) -> Result<(), String> {
    if attributes.len() > ATTRIBUTES {
        let count = attributes.len();
        return Err(format!("there are {count} attributes; at most {ATTRIBUTES} are allowed"));
    }
    for (k, attribute) in attributes.iter().enumerate() {
        attribute.check()?;
        if attributes[..k].iter().any(|other| other.name == attribute.name) {
            return Err(format!("the attribute {:?} appears twice", attribute.name));
        }
    }
    Ok(())
}

/// An attribute as JSON has it. Members that belong to another kind are refused.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Form {
    name: String,
    kind: KindName,
    values: Option<Vec<String>>,
    min: Option<f64>,
    max: Option<f64>,
    step: Option<f64>,
    length: Option<usize>,
    default: Option<String>,
    #[serde(default)]
    mutable: bool,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KindName {
    Checkbox,
    Select,
    Number,
    Text,
}

impl TryFrom<Form> for Attribute {
    type Error = String;

    fn try_from(form: Form) -> Result<Self, String> {
        let Form { name, kind, values, min, max, step, length, default, mutable } = form;
        let foreign = [
            ("values", values.is_some(), matches!(kind, KindName::Select)),
            ("min", min.is_some(), matches!(kind, KindName::Number)),
            ("max", max.is_some(), matches!(kind, KindName::Number)),
            ("step", step.is_some(), matches!(kind, KindName::Number)),
            ("length", length.is_some(), matches!(kind, KindName::Text)),
        ];
        if let Some((member, ..)) = foreign.iter().find(|(_, is_there, fits)| *is_there && !fits) {
            return Err(format!(
                "the attribute {name:?} has {member}, which attributes of its kind have not; select has \
                 values, number has min, max and step, text has length"
            ));
        }
        let missing = |member| format!("the attribute {name:?} has no {member}");
        let kind = match kind {
            KindName::Checkbox => Kind::Checkbox,
            KindName::Select => Kind::Select { values: values.ok_or_else(|| missing("values"))? },
            KindName::Number => Kind::Number {
                min: min.ok_or_else(|| missing("min"))?,
                max: max.ok_or_else(|| missing("max"))?,
                step: step.unwrap_or(1.0),
            },
            KindName::Text => Kind::Text { length: length.unwrap_or(VALUE) },
        };
        let default = default.unwrap_or_else(|| kind.first_value());
        Ok(Self { name, kind, default, mutable })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Attribute, String> {
        let read: Result<Attribute, _> = serde_json::from_str(text);
        let attribute = read.map_err(|error| error.to_string())?;
        attribute.check().map(|()| attribute)
    }

    #[test]
    fn an_attribute_allows_the_values_of_its_kind() {
        for (text, good, bad) in [
            (r#"{"name": "a", "kind": "checkbox"}"#, vec!["true", "false"], vec!["", "yes", "1"]),
            (
                r#"{"name": "a", "kind": "select", "values": ["red", "dark blue"]}"#,
                vec!["red", "dark blue"],
                vec!["", "blue", "Red"],
            ),
            (
                r#"{"name": "a", "kind": "number", "min": -1, "max": 2, "step": 0.1}"#,
                vec!["-1", "0.3", "2", "1.9"],
                vec!["", "2.1", "0.35", "NaN", "inf", "-2", "one"],
            ),
            (r#"{"name": "a", "kind": "text", "length": 3}"#, vec!["", "äöü"], vec!["abcd", "a\n"]),
        ] {
            let attribute = read(text).expect(text);
            for value in good {
                assert_eq!(attribute.allows(value), Ok(()), "{text} {value}");
            }
            for value in bad {
                let error = attribute.allows(value).expect_err(value);
                assert!(error.contains("\"a\"") && error.contains("allowed: "), "{error}");
            }
            let again = serde_json::to_string(&attribute).expect("is text");
            assert_eq!(read(&again), Ok(attribute), "{again}");
        }
    }

    #[test]
    fn a_declaration_that_is_wrong_says_what_is_allowed() {
        let long = format!(r#"{{"name": "{}", "kind": "checkbox"}}"#, "x".repeat(101));
        let many: Vec<String> = (0..201).map(|k| format!("\"{k}\"")).collect();
        let many = format!(r#"{{"name": "a", "kind": "select", "values": [{}]}}"#, many.join(", "));
        for (text, words) in [
            (r#"{"name": "", "kind": "checkbox"}"#, "is empty"),
            (r#"{"name": "truncated", "kind": "checkbox"}"#, "are in exports already"),
            (long.as_str(), "101 characters; allowed: at most 100"),
            (many.as_str(), "201 values; allowed: 1 to 200"),
            (r#"{"name": "a", "kind": "slider"}"#, "unknown variant `slider`"),
            (r#"{"name": "a", "kind": "select"}"#, "has no values"),
            (r#"{"name": "a", "kind": "select", "values": []}"#, "0 values; allowed: 1"),
            (r#"{"name": "a", "kind": "select", "values": ["b", "b"]}"#, "\"b\" appears twice"),
            (r#"{"name": "a", "kind": "number", "min": 1}"#, "has no max"),
            (r#"{"name": "a", "kind": "number", "min": 1, "max": 1}"#, "must be below the second"),
            (r#"{"name": "a", "kind": "number", "min": 0, "max": 1, "step": 0}"#, "steps of 0"),
            (r#"{"name": "a", "kind": "text", "length": 1001}"#, "1001; allowed: 1 to 1000"),
            (r#"{"name": "a", "kind": "text", "values": ["b"]}"#, "select has values"),
            (r#"{"name": "a", "kind": "checkbox", "default": "no"}"#, "allowed: true, false"),
            (r#"{"name": "a", "kind": "checkbox", "colour": "red"}"#, "unknown field `colour`"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
        let one = read(r#"{"name": "a", "kind": "checkbox"}"#).expect("is right");
        assert!(check(&[one.clone(), one.clone()]).expect_err("twice").contains("appears twice"));
        let all: Vec<Attribute> =
            (0..101).map(|k| Attribute { name: k.to_string(), ..one.clone() }).collect();
        assert!(check(&all).expect_err("too many").contains("at most 100"));
    }
}
