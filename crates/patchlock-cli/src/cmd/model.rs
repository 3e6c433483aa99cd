//! `patchlock model`: says what the files of a network are.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use anyhow::Result;
use clap::Args;
use patchlock::{KNOWN_MODELS, ModelFile, Network, NetworkError};
use patchlock_track::{Error, models};

use crate::failure::Failure;
use crate::output::printed::{print, quoted, wrapped};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock model nanotrack-v3/
      says what each file in the folder is, and whether they make a network
  patchlock model vitTracker.onnx
      the same for the only file of a network
  patchlock model patchnet
      the same for the network that is part of Patchlock
  patchlock track video.mp4 --box 120,80,64,48 \\
    --model nanotrack-v3/ --save boxes.csv
      follows a target with the help of the network

A network is recognised by its inputs and outputs, so other weights for the same
structure can be used, too. Published files are recognised by their SHA-256.
Patchlock downloads none. These are known:
";

static HELP: LazyLock<String> = LazyLock::new(|| EXAMPLES.to_owned() + &published());

/// The column in which the descriptions begin.
const INDENT: usize = 13;
const WIDTH: usize = 90;

/// Says what the ONNX files of a tracking network are, whose they are, and whether they can be used
///
/// For each file: the family of networks that it belongs to, its size, its SHA-256, and, if it is a
/// known published one, where it comes from, which licence its publisher states, and what it was
/// trained on. Nothing in the files is run, except to check that they fit together. The preset
/// network, of track, bench, studio and trax, follows a target with a network.
#[derive(Debug, Args)]
#[command(after_help = HELP.as_str())]
pub struct ModelArgs {
    /// A folder with the ONNX files of one network, a file, or patchnet
    #[arg(value_name = "DIR|FILE")]
    path: PathBuf,
}

pub fn run(args: &ModelArgs) -> Result<()> {
    let mut text = String::new();
    let described = describe(&args.path, &mut text);
    // What was found before an error helps to understand it.
    print(&text)?;
    Ok(described.map_err(Failure::from)?)
}

fn describe(path: &Path, text: &mut String) -> Result<(), Error> {
    for (file, bytes) in models::contents(path)? {
        let found = ModelFile::examine(&bytes);
        let found = found.map_err(|error| Error::Model(file.clone(), error))?;
        *text += &of_file(&file, bytes.len(), &found);
        text.push('\n');
    }
    match models::load(path, None) {
        Ok(network) => *text += &of_network(path, &network),
        Err(Error::Model(_, NetworkError::Incomplete { family, missing, .. }))
            if !path.is_dir() =>
        {
            *text += &format!(
                "This is a part of a network: {family} also needs the {missing}. Put both files \
                 into a folder.\n"
            );
        }
        Err(error) => return Err(error),
    }
    Ok(())
}

fn of_file(file: &Path, bytes: usize, found: &ModelFile) -> String {
    let ModelFile { family, part, values, operators, parameters, sha256, known, .. } = found;
    let mut text = format!("{}\n", file.display());
    let mut line = |name: &str, value: &str| text += &row(name, value);
    line("family", &format!("{family}, {part}"));
    line("size", &format!("{bytes} bytes, {operators} operators, {parameters} weights"));
    line("values", values);
    line("SHA-256", sha256);
    match known {
        Some(known) => {
            line("known as", &format!("{} of {}", known.file, known.name));
            line("origin", known.origin);
            line("licence", &format!("{}, as its publisher states", known.licence));
            line("training", known.training);
        }
        None => {
            line("known as", "nothing: it is no published file that Patchlock knows");
            line("licence", "unknown to Patchlock: ask whoever made the file");
            line("training", "unknown to Patchlock: ask whoever made the file");
        }
    }
    text
}

fn of_network(path: &Path, network: &Network) -> String {
    format!(
        "{}\n{}{}",
        network.name(),
        row("SHA-256", network.hash()),
        row("use", &format!("--model {}", quoted(path))),
    )
}

/// A name and its value, which goes on in further lines where it is long.
fn row(name: &str, value: &str) -> String {
    let value = wrapped(value, WIDTH - INDENT, &" ".repeat(INDENT));
    format!("  {name:<width$}{value}\n", width = INDENT - 2)
}

/// The known networks, with their files and where these are published.
fn published() -> String {
    let mut text = String::new();
    for network in KNOWN_MODELS.chunk_by(|a, b| a.name == b.name) {
        let files: Vec<_> = network.iter().map(|model| model.file).collect();
        let _ = writeln!(text, "  {}: {}", network[0].name, files.join(" and "));
        let _ = writeln!(text, "    {}", network[0].origin);
    }
    text + "The guide, docs/networks.md, has their licences and SHA-256."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_values_go_on_in_the_same_column() {
        assert_eq!(row("size", "5 bytes"), "  size       5 bytes\n");
        let long = row("training", &"words and ".repeat(20));
        let lines: Vec<&str> = long.lines().collect();
        assert!(lines.len() == 3 && lines.iter().all(|line| line.len() <= WIDTH), "{long}");
        assert!(lines[1].starts_with("             and words"), "{long}");
    }
}
