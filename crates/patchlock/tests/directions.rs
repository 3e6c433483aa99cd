//! Which modules of the library and which crates may depend on which, checked on the source text.
//! ARCHITECTURE.md gives the reasons.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A module of the library, and the modules that it may use.
type Rule = (&'static str, &'static [&'static str]);

/// Every module below the library's root; each may also use itself. A module may use only modules
/// listed before it, so there are no cycles.
const MAY_USE: &[Rule] = &[
    ("value", &[]),
    ("network_error", &[]),
    ("error", &["network_error", "value"]),
    ("numeric", &["error"]),
    ("vision", &["error", "numeric"]),
    ("patch_model", &["numeric", "vision"]),
    ("correlation", &["numeric", "vision"]),
    ("network", &["network_error", "numeric", "vision"]),
    ("config", &["error", "patch_model", "value", "vision"]),
    ("estimate", &["error", "patch_model", "vision"]),
    ("target_tracker", &["config", "error", "estimate", "network", "network_error", "vision"]),
    // The trackers: none knows another.
    (
        "paper",
        &[
            "config",
            "error",
            "estimate",
            "network",
            "network_error",
            "numeric",
            "patch_model",
            "target_tracker",
            "vision",
        ],
    ),
    (
        "robust",
        &[
            "config",
            "correlation",
            "error",
            "estimate",
            "network",
            "network_error",
            "numeric",
            "patch_model",
            "target_tracker",
            "vision",
        ],
    ),
    (
        "network_loop",
        &[
            "config",
            "error",
            "estimate",
            "network",
            "network_error",
            "numeric",
            "target_tracker",
            "vision",
        ],
    ),
    // The list of trackers, which its macro names.
    (
        "methods",
        &[
            "config",
            "error",
            "estimate",
            "network",
            "network_error",
            "target_tracker",
            "value",
            "vision",
        ],
    ),
    (
        "committee",
        &["estimate", "methods", "network_error", "numeric", "robust", "target_tracker", "vision"],
    ),
    // The tracker that a configuration asks for.
    (
        "target",
        &[
            "committee",
            "error",
            "estimate",
            "methods",
            "network",
            "network_loop",
            "robust",
            "target_tracker",
            "vision",
        ],
    ),
    ("target_id", &[]),
    ("snapshot", &["error", "estimate", "methods", "network", "target_id", "vision"]),
    (
        "multi",
        &[
            "error",
            "estimate",
            "methods",
            "numeric",
            "snapshot",
            "target",
            "target_id",
            "target_tracker",
            "vision",
        ],
    ),
    (
        "tracker",
        &[
            "error",
            "estimate",
            "methods",
            "numeric",
            "snapshot",
            "target",
            "target_tracker",
            "vision",
        ],
    ),
];

/// What a tracker may use that has no rule of its own.
const TRACKER_MAY_USE: &[&str] = &[
    "config",
    "correlation",
    "error",
    "estimate",
    "network",
    "network_error",
    "numeric",
    "patch_model",
    "target_tracker",
    "value",
    "vision",
];

/// Re-exports of `lib.rs` that other modules use, with the modules where they are defined.
const RE_EXPORTS: &[(&str, &str)] =
    &[("Error", "error"), ("Tracker", "tracker"), ("MultiTracker", "multi")];

/// Parts of the standard library that the tracker must not use: files, the terminal, the network,
/// processes and the clock.
const FORBIDDEN_STD: &[&str] = &["fs", "io", "env", "net", "process", "time", "os"];
/// An environment variable selects the instructions; it affects nothing else. The number of the
/// process says whether it is a fork, which has none of its parent's threads.
const EXCEPTIONS: &[(&str, &str)] = &[("instructions.rs", "env"), ("built_in.rs", "process")];
const FORBIDDEN_WORDS: &[&str] =
    &["println!", "eprintln!", "print!", "eprint!", "dbg!", "Instant", "SystemTime"];

/// Each crate of the workspace, the workspace crates that it may depend on, and those that only its
/// tests may depend on.
const CRATES: &[(&str, &[&str], &[&str])] = &[
    ("patchlock-scene", &[], &[]),
    // Finds the real sequences for tests.
    ("patchlock-testdata", &[], &[]),
    // The transforms of its filters.
    ("patchlock-fft", &[], &[]),
    ("patchlock", &["patchlock-fft"], &["patchlock", "patchlock-scene", "patchlock-testdata"]),
    // Without threads, files and the clock.
    ("patchlock-web", &["patchlock"], &[]),
    ("patchlock-drawing", &["patchlock"], &[]),
    ("patchlock-media", &["patchlock"], &["patchlock-scene"]),
    ("patchlock-track", &["patchlock", "patchlock-media"], &[]),
    (
        "patchlock-bench",
        &["patchlock", "patchlock-media", "patchlock-track"],
        &["patchlock-scene", "patchlock-testdata"],
    ),
    (
        "patchlock-studio",
        &["patchlock", "patchlock-drawing", "patchlock-media", "patchlock-track"],
        &["patchlock-scene"],
    ),
    (
        "patchlock-cli",
        &[
            "patchlock",
            "patchlock-drawing",
            "patchlock-media",
            "patchlock-track",
            "patchlock-bench",
            "patchlock-studio",
            "patchlock-scene",
        ],
        &["patchlock-testdata"],
    ),
    (
        "patchlock-py",
        &[
            "patchlock",
            "patchlock-drawing",
            "patchlock-media",
            "patchlock-track",
            "patchlock-bench",
            "patchlock-studio",
            "patchlock-cli",
            "patchlock-scene",
        ],
        &[],
    ),
    (
        "patchlock-fuzz",
        &[
            "patchlock",
            "patchlock-media",
            "patchlock-track",
            "patchlock-bench",
            "patchlock-studio",
            "patchlock-cli",
        ],
        &["patchlock-testdata"],
    ),
];

fn library() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All Rust files in a folder and its subfolders.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// As `rust_files`, without unit tests in files of their own.
fn files_without_tests(folder: &Path) -> Vec<PathBuf> {
    rust_files(folder).into_iter().filter(|file| !file.ends_with("tests.rs")).collect()
}

/// The source without comments, because docs may name anything.
fn code(file: &Path) -> String {
    let text = fs::read_to_string(file).unwrap();
    text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// The names that follow `root::` in the code, including each name of a group `root::{..}`.
fn names_behind(code: &str, root: &str) -> BTreeSet<String> {
    let start = format!("{root}::");
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut names = BTreeSet::new();
    for (index, _) in code.match_indices(&start) {
        if code[..index].ends_with(is_word) {
            continue;
        }
        let rest = &code[index + start.len()..];
        let first =
            |text: &str| text.trim_start().split(|c| !is_word(c)).next().unwrap().to_owned();
        match rest.strip_prefix('{') {
            Some(group) => names.extend(top_level(group).iter().map(|part| first(part))),
            None => drop(names.insert(first(rest))),
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

/// The parts of a group up to its closing brace, split at commas outside nested groups.
fn top_level(group: &str) -> Vec<String> {
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in group.chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        parts.last_mut().unwrap().push(c);
    }
    parts
}

/// The number of `super`s in the longest chain `super::super::..` of the code.
fn longest_super_chain(code: &str) -> usize {
    (1..).take_while(|&steps| code.contains(&"super::".repeat(steps))).last().unwrap_or(0)
}

/// Whether a module is the folder of a tracker.
fn is_tracker(module: &str) -> bool {
    let root = library().join(module).join("mod.rs");
    root.is_file() && code(&root).contains("impl TargetTracker for")
}

#[test]
fn modules_use_only_what_they_may() {
    let mut wrong = Vec::new();
    for file in rust_files(&library()) {
        let inside = file.strip_prefix(library()).unwrap();
        let module = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        if module == "lib" {
            continue;
        }
        let rule = MAY_USE.iter().find(|(name, _)| *name == module).map(|(_, may)| *may);
        let Some(may) = rule.or_else(|| is_tracker(module).then_some(TRACKER_MAY_USE)) else {
            wrong.push(format!("{}: no rule in this test for `{module}`", inside.display()));
            continue;
        };
        let code = code(&file);
        for name in names_behind(&code, "crate") {
            let home = RE_EXPORTS.iter().find(|(export, _)| *export == name);
            let home = home.map_or(name.as_str(), |(_, home)| home);
            if home != module && !may.contains(&home) {
                wrong.push(format!("{} uses crate::{name}", inside.display()));
            }
        }
        // `super` must not lead out of the module. Only `crate::` may, which the rule above checks.
        let is_root = inside.file_name().is_some_and(|name| name == "mod.rs");
        let depth = inside.iter().count() - 1 - usize::from(is_root);
        let allowed = depth.max(1); // for the tests at the end of a file, which begin with `use super::*`
        if longest_super_chain(&code) > allowed {
            wrong.push(format!("{} leaves its module with super::", inside.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn there_are_no_cycles() {
    for (k, (name, may)) in MAY_USE.iter().enumerate() {
        for other in *may {
            let earlier = MAY_USE[..k].iter().any(|(earlier, _)| earlier == other);
            assert!(earlier, "{name} may use {other}, which is not listed before it");
        }
    }
}

#[test]
fn the_modules_of_the_rules_exist() {
    for (module, _) in MAY_USE {
        let path = library().join(module);
        assert!(path.is_dir() || path.with_extension("rs").is_file(), "{module}");
    }
}

#[test]
fn the_library_touches_no_files_terminal_or_clock() {
    let mut wrong = Vec::new();
    for file in files_without_tests(&library()) {
        let code = code(&file);
        // Tests are at the end of a file.
        let code = code.split("#[cfg(test)]").next().unwrap();
        let path = file.strip_prefix(library()).unwrap().display();
        for word in FORBIDDEN_WORDS {
            if code.contains(word) {
                wrong.push(format!("{path} contains {word}"));
            }
        }
        for name in names_behind(code, "std") {
            let allowed =
                EXCEPTIONS.contains(&(file.file_name().unwrap().to_str().unwrap(), &name));
            if FORBIDDEN_STD.contains(&name.as_str()) && !allowed {
                wrong.push(format!("{path} uses std::{name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The crates of this workspace that a manifest lists below a heading such as `dependencies`.
fn ours(manifest: &str, heading: &str) -> BTreeSet<String> {
    let mut below = false;
    let mut names = BTreeSet::new();
    for line in manifest.lines().map(str::trim) {
        if let Some(section) = line.strip_prefix('[') {
            let section = section.trim_end_matches(']');
            below = section.rsplit('.').next() == Some(heading);
            // A table for one dependency: `[dependencies.name]`.
            if let Some((_, name)) = section.split_once(&format!("{heading}.")) {
                names.insert(name.to_owned());
            }
        } else if below {
            names.insert(line.split(['.', '=', ' ']).next().unwrap_or("").to_owned());
        }
    }
    names.retain(|name| name.starts_with("patchlock"));
    names
}

#[test]
fn crates_depend_in_one_direction() {
    let crates = library().join("../..");
    for entry in fs::read_dir(&crates).unwrap() {
        let folder = entry.unwrap().path();
        if !folder.join("Cargo.toml").is_file() {
            continue;
        }
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        let rule = CRATES.iter().find(|(known, ..)| *known == name);
        let (_, may, tests_may) = rule.unwrap_or_else(|| panic!("no rule in this test for {name}"));
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        for dependency in ours(&manifest, "dependencies") {
            assert!(may.contains(&dependency.as_str()), "{name} depends on {dependency}");
        }
        for dependency in ours(&manifest, "dev-dependencies") {
            let known =
                may.contains(&dependency.as_str()) || tests_may.contains(&dependency.as_str());
            assert!(known, "the tests of {name} depend on {dependency}");
        }
        assert!(ours(&manifest, "build-dependencies").is_empty(), "{name}");
    }
}

#[test]
fn metrics_see_boxes_statuses_and_a_protocol() {
    let metrics = library().join("../../patchlock-bench/src/metrics");
    for file in rust_files(&metrics) {
        let code = code(&file);
        let own: BTreeSet<_> = names_behind(&code, "crate");
        assert!(own.iter().all(|name| name == "protocol"), "{}: {own:?}", file.display());
        let tracker: BTreeSet<_> = names_behind(&code, "patchlock");
        assert!(
            tracker.iter().all(|name| matches!(name.as_str(), "BoundingBox" | "Status")),
            "{}: {tracker:?}",
            file.display()
        );
        assert!(
            longest_super_chain(&code) <= 1,
            "{} leaves its module with super::",
            file.display()
        );
    }
}

#[test]
fn nothing_prints_and_only_sessions_and_runs_have_a_clock() {
    for name in ["patchlock-track", "patchlock-bench"] {
        let source = library().join("../..").join(name).join("src");
        for file in files_without_tests(&source) {
            let code = code(&file);
            let code = code.split("#[cfg(test)]").next().unwrap();
            let path = file.strip_prefix(&source).unwrap();
            let runs = name == "patchlock-bench" && path.starts_with("bench");
            let has_clock = runs || path == Path::new("session.rs");
            for word in FORBIDDEN_WORDS {
                let is_clock = matches!(*word, "Instant" | "SystemTime");
                let allowed = has_clock && is_clock;
                assert!(!code.contains(word) || allowed, "{} has {word}", path.display());
            }
            let starts_programs = names_behind(code, "std").contains("process");
            assert!(!starts_programs || runs, "{} starts programs", path.display());
        }
    }
}

/// The text of each string literal in the code of a file, without that in comments.
fn literals(text: &str) -> Vec<String> {
    let (mut literals, mut rest) = (Vec::new(), text);
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let tail = &rest[at..];
        if tail.starts_with("//") {
            rest = tail.split_once('\n').map_or("", |(_, after)| after);
        } else if let Some(end) = ["'\"'", "'\\\"'"].iter().find(|quote| tail.starts_with(**quote))
        {
            rest = &tail[end.len()..];
        } else if let Some(body) = tail.strip_prefix('"') {
            let mut escaped = false;
            let ends = |c: char| {
                let is_end = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                is_end
            };
            let end = body.find(ends).unwrap_or(body.len());
            literals.push(body[..end].to_owned());
            rest = body.get(end + 1..).unwrap_or("");
        } else {
            rest = &tail[1..];
        }
    }
    literals
}

/// Whether a text names an option of a program, such as `--start`.
fn names_an_option(text: &str) -> bool {
    text.split("--").skip(1).any(|after| after.starts_with(|c: char| c.is_ascii_lowercase()))
}

#[test]
fn libraries_name_no_options_of_the_program() {
    let mut wrong = Vec::new();
    for name in
        ["patchlock", "patchlock-media", "patchlock-track", "patchlock-bench", "patchlock-studio"]
    {
        let source = library().join("../..").join(name).join("src");
        for file in files_without_tests(&source) {
            let text = fs::read_to_string(&file).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap();
            for literal in literals(text).iter().filter(|literal| names_an_option(literal)) {
                wrong.push(format!("{}: {literal}", file.strip_prefix(&source).unwrap().display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn literals_are_found_and_comments_are_not() {
    let code = r#"let a = "x \" --start"; // "--end"
        let b = ('"', '\"', "-v --no", 'c');"#;
    assert_eq!(literals(code), [r#"x \" --start"#, "-v --no"]);
    assert!(names_an_option("x --start 3") && !names_an_option("a -- b") && !names_an_option("-v"));
}

#[test]
fn the_parser_handles_groups_and_manifests() {
    let code = "use crate::{Error, config::{A, B},\n vision::frame};\n\
        let x = crate::sparse::f(); mycrate::no";
    let names: Vec<_> = names_behind(code, "crate").into_iter().collect();
    assert_eq!(names, ["Error", "config", "sparse", "vision"]);
    assert_eq!(longest_super_chain("use super::super::a; use super::b;"), 2);
    let manifest = "[dependencies]\nserde = \"1\"\npatchlock-a.workspace = true\n\
        [dev-dependencies]\npatchlock-b = { path = \"x\" }\n\
        [dependencies.patchlock-c]\n";
    assert_eq!(
        ours(manifest, "dependencies").into_iter().collect::<Vec<_>>(),
        ["patchlock-a", "patchlock-c"]
    );
    assert_eq!(ours(manifest, "dev-dependencies").into_iter().collect::<Vec<_>>(), ["patchlock-b"]);
}
