//! The help: that it is complete, and how it is laid out. The documentation has it as a page, which
//! `tools/python/command_line.py` makes.

/// The help on a terminal of that many columns.
fn help(words: &[&str], columns: usize) -> String {
    let mut command = crate::support::patchlock();
    let output = command.args(words).env("COLUMNS", columns.to_string()).output().expect("runs");
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

/// Arguments and options in a help, and the first line of what it says about each.
fn rows(help: &str) -> Vec<(&str, &str)> {
    let head = help.split("EXAMPLES:").next().expect("has a part");
    let lines: Vec<&str> = head.lines().collect();
    let starts = |line: &str| {
        let indent = line.len() - line.trim_start().len();
        matches!(indent, 2 | 6) && line.trim_start().starts_with(['-', '<', '['])
    };
    let is_row = |(k, line): (usize, &&str)| starts(line).then_some(k);
    let found = lines.iter().enumerate().filter_map(is_row);
    let split = |k: usize| match lines[k].trim_start().split_once("  ") {
        Some((name, text)) => (name, text.trim()),
        None => (lines[k].trim(), lines.get(k + 1).map_or("", |next| next.trim())),
    };
    found.map(split).collect()
}

#[test]
fn every_command_argument_and_option_has_help() {
    let overview = help(&["--help"], 80);
    let commands = commands(&overview);
    assert!(commands.len() > 10, "{commands:?}");
    let mut count = 0;
    for name in commands {
        let text = help(&[name, "--help"], 80);
        assert!(text.starts_with(|c: char| c.is_uppercase()), "{name} has no help: {text}");
        for (row, said) in rows(&text) {
            assert!(said.starts_with(char::is_alphanumeric), "{name} {row} has no help: {said:?}");
            count += 1;
        }
    }
    assert!(count > 100, "{count}");
}

#[test]
fn the_help_of_track_begins_with_the_options_of_a_first_track() {
    for words in [["track", "-h"], ["track", "--help"]] {
        let text = help(&words, 80);
        let headings: Vec<&str> =
            text.lines().filter(|line| line.ends_with(':') && !line.starts_with(' ')).collect();
        let groups = ["More ways to give targets:", "Frames:", "Tracker:", "Tables and page:"];
        assert_eq!(headings[..3], ["Arguments:", "Options:", "Pictures:"], "{words:?}");
        assert!(groups.iter().all(|group| headings.contains(group)), "{headings:?}");
        let first =
            text.split("\nOptions:\n").nth(1).and_then(|rest| rest.split("\nPictures:").next());
        let names: Vec<&str> = first
            .unwrap_or_default()
            .lines()
            .filter_map(|line| line.trim().trim_start_matches("-h, ").split_whitespace().next())
            .filter(|word| word.starts_with("--"))
            .collect();
        let expected =
            ["--box", "--select", "--save", "--overwrite", "--preview", "--video", "--help"];
        assert_eq!(names, expected, "{words:?}");
    }
    // In the short help, an option is a line or two.
    let lines =
        |words: &[&str]| help(words, 110).split("EXAMPLES:").next().unwrap().lines().count();
    assert!(2 * lines(&["track", "-h"]) < lines(&["track", "--help"]));
}

/// A line that is wider than such a terminal.
fn too_long(text: &str) -> Option<&str> {
    text.lines().find(|line| line.chars().count() > 80)
}

#[test]
fn help_and_usage_errors_are_whole_on_a_terminal_of_80_columns() {
    let overview = help(&["--help"], 80);
    let examples = |text: &str| text.split_once("EXAMPLES:").map(|(_, rest)| rest.to_owned());
    let check = |words: &[&str]| {
        let (narrow, wide) = (help(words, 80), help(words, 110));
        assert_eq!(too_long(&narrow), None, "{words:?}");
        // Examples and tables are laid out by hand, and broken in odd places where they are wider.
        assert!(examples(&narrow).is_some() && examples(&narrow) == examples(&wide), "{words:?}");
    };
    check(&["-h"]);
    check(&["--help"]);
    for name in commands(&overview) {
        check(&[name, "-h"]);
        check(&[name, "--help"]);
    }
    for name in ["track", "export", "score", "report", "no-such-command"] {
        let output =
            crate::support::patchlock().arg(name).env("COLUMNS", "80").output().expect("runs");
        let said = String::from_utf8(output.stderr).expect("is text");
        assert!(output.status.code() == Some(2) && too_long(&said).is_none(), "{said}");
    }
}
