//! The page of the command line in the documentation is the program's own help.

mod support;

use std::fs;
use std::path::Path;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn help(words: &[&str]) -> String {
    let mut command = support::patchlock();
    let output = command.args(words).env_remove("COLUMNS").output().expect("runs");
    assert!(output.status.success(), "{words:?}");
    let text = String::from_utf8(output.stdout).expect("is text");
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// The commands in the order of the overview.
fn commands(overview: &str) -> Vec<&str> {
    let lines = overview.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| !line.is_empty()).filter_map(|line| {
        let name = line.strip_prefix("  ")?;
        name.split_whitespace().next().filter(|_| !name.starts_with(' '))
    });
    names.filter(|name| *name != "help").collect()
}

fn page() -> String {
    let overview = help(&["--help"]);
    let mut page = format!(
        "# The command line\n\nWhat `patchlock --help` prints:\n\n```text\n{overview}```\n"
    );
    for name in commands(&overview) {
        page += &format!("\n## {name}\n\n```text\n{}```\n", help(&[name, "--help"]));
    }
    page
}

#[test]
fn the_page_of_the_command_line_is_the_help() {
    let (page, file) = (page(), Path::new(ROOT).join("docs/command-line.md"));
    assert!(page.matches("\n## ").count() > 10, "{page}");
    let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command-line.md");
    fs::write(&new, &page).expect("writes");
    let written = fs::read_to_string(&file).unwrap_or_default();
    assert!(written == page, "docs/command-line.md is not the help: copy {} there", new.display());
}
