//! `patchlock config`: prints all settings as commented TOML.

use anyhow::Result;
use clap::Args;
use patchlock::{PARAMETERS, Parameter, TrackerConfig};
use patchlock_track::settings;

use super::PRESETS_SHOWN;
use crate::failure::Failure;
use crate::output::printed::print;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock config
      shows every setting with its meaning, range and source
  patchlock config > my.toml
  patchlock track video.mp4 --box 120,80,64,48 --config my.toml
      changes settings; a file may also contain only the settings that differ
      from the preset";

/// Width of comment lines.
const LINE: usize = 100;

/// Prints all settings as TOML, with a comment for each
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ConfigArgs {
    #[arg(long, value_name = "NAME", default_value = "robust", help = PRESETS_SHOWN)]
    preset: String,
}

/// Prints the configuration.
pub fn run(args: &ConfigArgs) -> Result<()> {
    let config = settings::preset(&args.preset).map_err(Failure::from)?;
    let text = commented(&config, &args.preset)?;
    Ok(print(&text)?)
}

/// The configuration as commented TOML, which parses back to the same configuration.
pub fn commented(config: &TrackerConfig, preset: &str) -> Result<String> {
    let table = toml::Table::try_from(config)?;
    let mut text = format!("# Patchlock {}: the preset \"{preset}\".\n", env!("CARGO_PKG_VERSION"));
    text += "# Change values in this file and use it with: patchlock track ... --config FILE\n";
    let (mut group, mut source) = ("", "");
    for parameter in PARAMETERS {
        let Some(value) = value_of(parameter, &table) else { continue };
        if parameter.group != group {
            group = parameter.group;
            text += &format!("\n[{group}]\n");
        }
        if parameter.source != source {
            source = parameter.source;
            text += &format!("\n# ---- {source} ----\n");
        }
        text += &comment(&format!("{} Range: {}.", sentence(parameter.purpose), parameter.range));
        text += &format!("{} = {value}\n", parameter.name);
    }
    Ok(text)
}

/// The value of a setting in the table of a configuration.
fn value_of<'a>(parameter: &Parameter, table: &'a toml::Table) -> Option<&'a toml::Value> {
    match parameter.group {
        "" => table.get(parameter.name),
        group => table.get(group)?.get(parameter.name),
    }
}

fn sentence(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.ends_with('.') { text } else { text + "." }
}

/// Wraps a comment to [`LINE`] columns.
fn comment(text: &str) -> String {
    let mut lines = String::from("\n#");
    let mut length = 1;
    for word in text.split_whitespace() {
        if length + 1 + word.len() > LINE {
            lines += "\n#";
            length = 1;
        }
        lines += " ";
        lines += word;
        length += 1 + word.len();
    }
    lines + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_presets_parse_back_to_the_same_configuration() {
        for name in patchlock::PRESETS {
            let config = settings::preset(name).expect("a known preset");
            let text = commented(&config, name).expect("prints");
            let back: TrackerConfig = toml::from_str(&text).expect("reads");
            assert_eq!(back, config);
            let table = toml::Table::try_from(&config).expect("a table");
            let fields = |table: &toml::Table| table.values().filter(|v| !v.is_table()).count();
            let groups = table.values().filter_map(toml::Value::as_table).map(fields);
            let count = fields(&table) + groups.sum::<usize>();
            assert_eq!(PARAMETERS.len(), count, "every field has a comment");
            assert!(text.lines().all(|line| line.len() <= LINE + 20), "{text}");
        }
    }
}
