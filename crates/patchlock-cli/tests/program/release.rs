//! `cargo binstall` makes the address of a release's file of templates in `Cargo.toml`; another
//! place names the file. Both must agree for each system that has a program.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use toml::{Table, Value};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn read(name: &str) -> String {
    fs::read_to_string(Path::new(ROOT).join(name)).expect(name)
}

fn table(name: &str) -> Table {
    read(name).parse().expect(name)
}

fn at<'a>(mut table: &'a Table, path: &[&str]) -> &'a Table {
    for key in path {
        table = table[*key].as_table().expect(key);
    }
    table
}

/// What `{ name }` in a template stands for.
fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let text = values.iter().fold(template.to_owned(), |text, (name, value)| {
        text.replace(&format!("{{ {name} }}"), value)
    });
    assert!(!text.contains('{'), "{template} has a name that is not known: {text}");
    text
}

/// The systems for which the workflow builds the program.
fn targets(workflow: &str) -> BTreeSet<&str> {
    let (_, job) = workflow.split_once("\n  program:\n").expect("the job `program`");
    let (job, _) = job.split_once("\n  wheel:\n").expect("the job after it");
    let names = job.split("target: ").skip(1).filter_map(|rest| rest.split(" }").next());
    names.filter(|name| name.matches('-').count() >= 2 && !name.contains('$')).collect()
}

#[test]
fn binstall_finds_the_files_of_a_release() {
    let workspace = table("Cargo.toml");
    let package = at(&workspace, &["workspace", "package"]);
    let text = |key: &str| package[key].as_str().expect(key);
    let (repository, version) = (text("repository"), text("version"));
    let cli = table("crates/patchlock-cli/Cargo.toml");
    let metadata = at(&cli, &["package", "metadata", "binstall"]);

    // The names of program.sh, which are shell's.
    let script = read("tools/release/program.sh");
    for line in [
        "\nname=patchlock-$version-$target\n",
        "\n    *-windows-*)\n",
        "files+=(\"$name.zip\")",
        "files+=(\"$name.tar.gz\")",
        "cp \"$program\" README.md",
    ] {
        assert!(script.contains(line), "program.sh names its files otherwise, without {line:?}");
    }
    let workflow = read(".github/workflows/release.yml");
    assert!(workflow.contains("tags: [\"v*\"]"), "the tag is not v and the version");
    let targets = targets(&workflow);
    assert!(targets.len() >= 6, "{targets:?}");
    for target in targets {
        let windows = target.contains("-windows-");
        let own = metadata["overrides"].get(target).and_then(Value::as_table);
        let format = own.and_then(|own| own.get("pkg-fmt")).unwrap_or(&metadata["pkg-fmt"]);
        let suffix = match format.as_str() {
            Some("tgz") => ".tar.gz",
            Some("zip") => ".zip",
            other => panic!("{target}: {other:?}"),
        };
        let values = [
            ("repo", repository),
            ("version", version),
            ("target", target),
            ("archive-suffix", suffix),
            ("bin", "patchlock"),
            ("binary-ext", if windows { ".exe" } else { "" }),
        ];
        let template = |key: &str| filled(metadata[key].as_str().expect(key), &values);
        let name = format!("patchlock-{version}-{target}");
        let archive = format!("{name}{}", if windows { ".zip" } else { ".tar.gz" });
        let address = format!("{repository}/releases/download/v{version}/{archive}");
        assert_eq!(template("pkg-url"), address);
        let program = if windows { "patchlock.exe" } else { "patchlock" };
        assert_eq!(template("bin-dir"), format!("{name}/{program}"));
    }
}
