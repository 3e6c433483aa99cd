//! Settings: TOML, JSON, and assignments on the command line.

use patchlock::{Preset, TrackerConfig};
use patchlock_cli::failure::Failure;
use patchlock_track::settings::{Overrides, resolve};

use crate::check::{accepted, said, through_text};
use crate::scratch::Scratch;
use crate::{choice, parts};

/// The first byte chooses the preset and the form: a settings file (with tables or without),
/// lines of `--set`, both as two parts, or a configuration as JSON.
pub fn settings(data: &[u8]) {
    let (first, rest) = choice(data);
    let preset = Preset::ALL[usize::from(first / 4) % Preset::ALL.len()].name();
    let mut files = parts(rest);
    let mut next = || String::from_utf8_lossy(files.next().unwrap_or_default()).into_owned();
    let (file, set) = match first % 4 {
        0 => (Some(rest.to_vec()), String::new()),
        1 => (None, String::from_utf8_lossy(rest).into_owned()),
        2 => (Some(next().into_bytes()), next()),
        _ => return json(rest),
    };
    let scratch = Scratch::new();
    let file = file.map(|content| scratch.file("settings.toml", &content));
    let set: Vec<String> = set.lines().map(str::to_owned).collect();
    let options = Overrides { set: &set, ..Overrides::default() };
    match resolve(preset, file.as_deref(), options) {
        Ok((config, _)) => {
            config.validate().expect("what was resolved is valid");
            let text = toml::to_string(&config).expect("a configuration can be written");
            let file = scratch.file("again.toml", text.as_bytes());
            let again = resolve(preset, Some(&file), Overrides::default());
            assert_eq!(again.expect("what was written can be read").0, config);
        }
        Err(error) => {
            let failure = Failure::from(error);
            said(&failure);
            failure.advice().into_iter().for_each(|advice| drop(said(advice)));
        }
    }
}

fn json(text: &[u8]) {
    let read: Result<TrackerConfig, _> = serde_json::from_slice(text);
    let Some(config) = accepted(read) else { return };
    if accepted(config.validate()).is_some() {
        through_text(&config);
    }
}
