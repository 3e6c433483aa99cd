//! `patchlock completions` and `patchlock man`: what a shell and `man` need, made from the help.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, Command};
use clap_complete::Shell;

use crate::failure::failed;
use crate::output::printed::print_as_it_is;

const COMPLETIONS: &str = "\
EXAMPLES:
  patchlock completions bash > \\
    ~/.local/share/bash-completion/completions/patchlock
  patchlock completions zsh > ~/.zfunc/_patchlock
      the folder must be in fpath, before compinit
  patchlock completions fish > ~/.config/fish/completions/patchlock.fish";

const MAN: &str = "\
EXAMPLES:
  patchlock man | man -l -
      shows the manual page
  patchlock man --out ~/.local/share/man/man1
      writes one page for the program and one for each command: man
      patchlock-track";

/// Prints command line completions for a shell
#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the manual page, or writes the pages of all commands
#[derive(Debug, Args)]
#[command(after_help = MAN)]
pub struct ManArgs {
    /// Folder for the pages of the program and of each command, made if it is missing; files of the
    /// same names are replaced
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn completions(args: &CompletionsArgs, mut command: Command) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut command, "patchlock", &mut text);
    Ok(print_as_it_is(&String::from_utf8(text)?)?)
}

pub fn man(args: &ManArgs, command: Command) -> Result<()> {
    match &args.out {
        Some(folder) => pages(folder, command),
        None => {
            let mut text = Vec::new();
            clap_mangen::Man::new(command).render(&mut text)?;
            Ok(print_as_it_is(&String::from_utf8(text)?)?)
        }
    }
}

fn pages(folder: &Path, command: Command) -> Result<()> {
    std::fs::create_dir_all(folder)
        .map_err(|error| failed(format!("--out {}: cannot make it: {error}", folder.display())))?;
    clap_mangen::generate_to(command.disable_help_subcommand(true), folder)
        .with_context(|| format!("cannot write to {}", folder.display()))
}
