//! `patchlock config`: prints the settings as commented TOML.

use anyhow::Result;
use clap::Args;
use patchlock::{PARAMETERS, Parameter, TrackerConfig};
use patchlock_track::settings::{self, Overrides};

use super::presets_shown;
use crate::failure::Failure;
use crate::output::printed::{print, wrapped};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock config
      shows the settings with their meaning, range and source
  patchlock config > my.toml
  patchlock track video.mp4 --box 120,80,64,48 --config my.toml
      changes settings; a file may also contain only the settings that differ
      from the preset
  patchlock config --preset network > net.toml
      the file can also name the network, so that --model is not needed";

/// The network, which is not among the settings of the library.
const NETWORK: &str = "
# The network: patchnet, none, a folder with ONNX files, or the only file. A relative path is
# relative to this file. --model takes precedence.
# model = \"patchnet\"

# The library of onnxruntime that runs the network. Without it, the built-in runtime does.
# runtime = \"libonnxruntime.so\"
";

const LINE: usize = 100;

/// Prints the settings as TOML, with a comment for each
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ConfigArgs {
    #[arg(long, value_name = "NAME", default_value = "robust", help = presets_shown())]
    preset: String,

    /// Also print the numbers of research, which change without notice from one version to the next
    #[arg(long)]
    research: bool,
}

pub fn run(args: &ConfigArgs) -> Result<()> {
    let resolved = settings::resolve(&args.preset, None, Overrides::default());
    let (config, _) = resolved.map_err(Failure::from)?;
    let text = commented(&config, &args.preset, args.research)?;
    Ok(print(&text)?)
}

/// The configuration as commented TOML: the settings that it reads, and those of research if they are
/// asked for. The text of a preset reads back to the same configuration.
fn commented(config: &TrackerConfig, preset: &str, research: bool) -> Result<String> {
    let mut text = format!("# Patchlock {}: the preset \"{preset}\".\n", env!("CARGO_PKG_VERSION"));
    text += "# Change values in this file and use it with: patchlock track ... --config FILE\n";
    if config.network.is_some() {
        text += NETWORK;
    }
    let (mut group, mut source) = ("", "");
    let is_listed =
        |row: &&Parameter| config.reads(row) && (research || row.is_stable_for(&config.method));
    for parameter in PARAMETERS.iter().filter(is_listed) {
        if parameter.group != group {
            group = parameter.group;
            let method = config.method.name();
            let table = if group == method { group } else { &format!("{method}.{group}") };
            text += &format!("\n[{table}]\n");
        }
        if parameter.source != source {
            source = parameter.source;
            text += &format!("\n# ---- {source} ----\n");
        }
        text += &comment(&format!("{} Range: {}.", parameter.purpose, parameter.range));
        let value = toml::Value::try_from(config.get(parameter.name)?)?;
        text += &format!("{} = {value}\n", parameter.name);
    }
    Ok(text)
}

/// A comment in lines of at most [`LINE`] columns.
fn comment(text: &str) -> String {
    format!("\n# {}\n", wrapped(text, LINE - 2, "# "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use patchlock::Preset;

    #[test]
    fn printed_presets_parse_back_to_the_same_configuration() {
        for (preset, research) in
            Preset::ALL.into_iter().flat_map(|preset| [(preset, false), (preset, true)])
        {
            let (config, _) = settings::resolve(preset.name(), None, Overrides::default()).unwrap();
            let text = commented(&config, preset.name(), research).expect("prints");
            let mut back: TrackerConfig = toml::from_str(&text).expect("reads");
            back.network.clone_from(&config.network);
            assert_eq!(back, config);
            let settings = text.lines().filter(|line| !line.starts_with(['#', '[']));
            let settings = settings.filter(|line| !line.is_empty()).count();
            let used = |row: &&Parameter| {
                config.reads(row) && (research || row.is_stable_for(&config.method))
            };
            let used = PARAMETERS.iter().filter(used).count();
            assert_eq!(settings, used, "every setting that is read is there, and no other");
            assert!(research || preset != Preset::Robust || used <= 25, "{used}");
            assert!(text.lines().all(|line| line.len() <= LINE + 20), "{text}");
        }
    }

    #[test]
    fn every_purpose_is_one_sentence() {
        for Parameter { name, purpose, .. } in PARAMETERS {
            assert!(purpose.starts_with(char::is_uppercase) || purpose.starts_with('`'), "{name}");
            assert!(purpose.ends_with('.'), "{name}");
        }
    }
}
