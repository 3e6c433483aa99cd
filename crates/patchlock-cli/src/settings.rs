//! From `--preset`, `--config` and `--seed` to a checked configuration.

use std::fs;
use std::path::Path;

use anyhow::Result;
use patchlock::{PARAMETERS, PRESETS, Parameter, Range, TrackerConfig};

use crate::complaint::{Complaint, failed, named, usage};

/// The configuration with this name.
pub fn preset(name: &str) -> Result<TrackerConfig, Complaint> {
    TrackerConfig::preset(name).map_err(|_| {
        usage(format!("there is no preset {}", named(name)))
            .hint(format!("the presets are: {}", PRESETS.join(", ")))
    })
}

/// A preset, the changes of a file, and a seed, in this order.
pub fn resolve(name: &str, file: Option<&Path>, seed: Option<u64>) -> Result<TrackerConfig> {
    let mut config = preset(name)?;
    if let Some(file) = file {
        config = with_file(config, file)?;
    }
    if let Some(seed) = seed {
        config.seed = seed;
    }
    config.validate().map_err(|error| out_of_range(error.to_string()))?;
    Ok(config)
}

fn with_file(config: TrackerConfig, file: &Path) -> Result<TrackerConfig> {
    let text = fs::read_to_string(file).map_err(|error| {
        failed(format!("cannot read the configuration {}: {error}", file.display()))
            .hint("patchlock config > my.toml writes one to begin with")
    })?;
    let changes: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        usage(format!("{}, line {line}, is no valid TOML: {}", file.display(), error.message()))
            .hint("a line is: name = value, with words in quotes")
    })?;
    let config = apply(config, changes, file)?;
    config.validate().map_err(|error| out_of_range(format!("{}: {error}", file.display())))?;
    Ok(config)
}

fn out_of_range(message: String) -> Complaint {
    usage(message).hint("patchlock config shows every setting with its range")
}

/// Applies one change after the other, so that a bad one can be named. The settings of a group stand in its table;
/// as no two have the same name, they are also taken without it.
fn apply(config: TrackerConfig, changes: toml::Table, file: &Path) -> Result<TrackerConfig> {
    let mut table = toml::Table::try_from(&config)?;
    for (name, value) in changes {
        let is_group = |parameter: &Parameter| !name.is_empty() && parameter.group == name;
        match value {
            toml::Value::Table(group) if PARAMETERS.iter().any(is_group) => {
                for (field, value) in group {
                    set(&mut table, Some(&name), &field, &value, file)?;
                }
            }
            value => set(&mut table, None, &name, &value, file)?,
        }
    }
    Ok(table.try_into()?)
}

/// Sets one setting in the table of a configuration; `group` is the table that the file has it in.
fn set(
    table: &mut toml::Table,
    group: Option<&str>,
    name: &str,
    value: &toml::Value,
    file: &Path,
) -> Result<(), Complaint> {
    let is_meant = |parameter: &&Parameter| {
        parameter.name == name && group.is_none_or(|group| parameter.group == group)
    };
    let Some(parameter) = PARAMETERS.iter().find(is_meant) else {
        return Err(unknown_field(name, file));
    };
    let slot = match parameter.group {
        "" => table.get_mut(name),
        group => table.get_mut(group).and_then(|group| group.get_mut(name)),
    };
    let before = slot.map(|slot| std::mem::replace(slot, value.clone()));
    let checked: Result<TrackerConfig, _> = table.clone().try_into();
    checked.map_err(|_| not_taken(parameter, value, before.as_ref(), file))?;
    Ok(())
}

/// The complaint about a value that a setting can't have; `before` is one that it can.
fn not_taken(
    parameter: &Parameter,
    value: &toml::Value,
    before: Option<&toml::Value>,
    file: &Path,
) -> Complaint {
    let Parameter { name, range, .. } = parameter;
    let is_number = value.is_integer() || value.is_float();
    let fault = match range {
        Range::Words(_) if value.is_str() => "is none of its words",
        Range::Number { .. } if is_number => "is not among its numbers",
        _ => "is not of the right kind",
    };
    let whole = if before.is_some_and(toml::Value::is_integer) { "a whole number, " } else { "" };
    usage(format!("{}: {name} = {value} {fault}", file.display()))
        .hint(format!("{name} takes: {whole}{range}"))
}

fn unknown_field(name: &str, file: &Path) -> Complaint {
    let near = near_matches(name, PARAMETERS.iter().map(|parameter| parameter.name));
    let hint = if near.is_empty() {
        "patchlock config shows all settings".to_string()
    } else {
        format!("did you mean {}? patchlock config shows all settings", near.join(" or "))
    };
    usage(format!("{}: there is no setting {name}", file.display())).hint(hint)
}

/// Up to three names that could be meant.
pub fn near_matches<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let limit = (name.len() / 3).max(2);
    let mut near: Vec<(usize, &str)> = known
        .map(|other| (distance(name, other), other))
        .filter(|(steps, other)| *steps <= limit || (name.len() > 2 && other.contains(name)))
        .collect();
    near.sort();
    near.into_iter().take(3).map(|(_, other)| other).collect()
}

/// How many letters must be put in, left out or changed.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, &y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        assert_eq!(distance("seed", "sed"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("kitten", "sitting"), 3);
    }

    #[test]
    fn near_names_come_first() {
        let known = ["particles", "particle_spread", "seed"];
        assert_eq!(near_matches("partcles", known.into_iter()), ["particles"]);
        assert_eq!(near_matches("particle", known.into_iter()), ["particles", "particle_spread"]);
        assert!(near_matches("zzzzzz", known.into_iter()).is_empty());
    }
}
