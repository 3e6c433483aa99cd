//! Builds reports of made-up trackers on a made-up dataset with frames.

use std::fs;
use std::path::Path;

use image::{Rgb, RgbImage};
use patchlock::Status;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::report::{self, Options, Plot, Report};
use patchlock_bench::score::{self, Pass, Scoreboard};
use patchlock_bench::{Error, results};

const FRAMES: usize = 12;

/// Sequences in the layout of OTB, with small images. `Deer` and `Crossing` have attributes in the
/// table of OTB.
fn dataset(root: &Path) -> Dataset {
    for (k, name) in ["Deer", "Crossing", "Mine"].iter().enumerate() {
        let folder = root.join(name).join("img");
        fs::create_dir_all(&folder).unwrap();
        let mut truth = String::new();
        for frame in 0..FRAMES {
            let picture = RgbImage::from_pixel(64, 48, Rgb([40 * k as u8, 90, 20 * frame as u8]));
            picture.save(folder.join(format!("{:04}.png", frame + 1))).unwrap();
            truth += &format!("{},11,16,12\n", 5 + frame);
        }
        fs::write(root.join(name).join("groundtruth_rect.txt"), truth).unwrap();
    }
    Dataset::open(root).unwrap()
}

/// Writes results that are `behind` pixels off, and lost from frame `lost_from` on.
fn tracker(root: &Path, name: &str, targets: &[&str], behind: usize, lost_from: usize) {
    let folder = root.join(name);
    fs::create_dir_all(&folder).unwrap();
    for target in targets {
        let x = |frame: usize| if frame < lost_from { 5 + frame + behind } else { 45 };
        let lines: String = (0..FRAMES).map(|frame| format!("{},11,16,12\n", x(frame))).collect();
        fs::write(folder.join(format!("{target}.txt")), lines).unwrap();
    }
}

const ALL: [&str; 3] = ["Deer", "Crossing", "Mine"];

/// Scores three trackers: one exact, one that is lost from frame 6 on, and one whose name must be
/// escaped in HTML.
fn scored(folder: &Path, truth: &Dataset) -> Scoreboard {
    tracker(folder, "exact", &ALL, 0, FRAMES);
    tracker(folder, "loser", &ALL, 1, 6);
    tracker(folder, "<b>&co", &ALL, 4, FRAMES);
    let results = results::read_all(&[folder], truth).unwrap();
    score::scoreboard(&results, truth)
}

fn report(board: &Scoreboard, truth: &Dataset, shown: &[&str]) -> Result<Report, Error> {
    let shown = shown.iter().map(|name| name.to_string()).collect();
    report::build(board, truth, &Options { shown, best: 2, ..Options::default() })
}

fn plot<'a>(report: &'a Report, name: &str) -> &'a Plot {
    report.plots.iter().find(|plot| plot.name == name).unwrap_or_else(|| panic!("no plot {name}"))
}

#[test]
fn the_page_is_self_contained_and_complete() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let board = scored(&folder.path().join("results"), &truth);
    let report = report(&board, &truth, &["loser"]).unwrap();
    let html = &report.html;
    // Nothing is loaded from elsewhere. Inline SVG needs no namespace URL either.
    for external in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!html.contains(external), "{external}");
    }
    assert!(!html.contains("<b>&co") && html.contains("&lt;b&gt;&amp;co"), "names are escaped");
    assert!(
        html.contains("<h1>loser") && html.contains("3</b> of 3 by AUC"),
        "the report is about the shown tracker"
    );
    // Lost at frame 6 in all three sequences: one thumbnail each, with both boxes.
    assert_eq!(html.matches("frame 6: lost for 6 frames").count(), 3);
    assert_eq!(html.matches("data:image/jpeg;base64,").count(), 3);
    assert_eq!(
        (html.matches("class=\"tb\"").count(), html.matches("class=\"ob\"").count()),
        (3, 3)
    );
    assert_eq!(html.matches("<article").count(), 3);
    // The legend names the best two and the shown one, which ranks third.
    let success = plot(&report, "success").svg();
    assert!(success.contains(">exact</text>") && success.contains(">loser</text>"));
    assert!(!success.contains("1 more"), "all three are named");
}

#[test]
fn every_plot_has_svg_png_and_csv_with_the_scores() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let board = scored(&folder.path().join("results"), &truth);
    let report = report(&board, &truth, &[]).unwrap();
    let names: Vec<&str> = report.plots.iter().map(|plot| plot.name.as_str()).collect();
    for name in ["precision", "success", "normalised_precision", "precision_BC", "overlap_Mine"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    for plot in &report.plots {
        assert!(plot.svg().starts_with("<svg xmlns"), "{}", plot.name);
        let picture = image::load_from_memory(&plot.png().unwrap()).unwrap().to_rgb8();
        let drawn = picture.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
        assert!(drawn > 1000, "{} is empty", plot.name);
        assert!(plot.csv().lines().count() > 1, "{}", plot.name);
    }
    for tracker in &board.trackers {
        let column = plot(&report, "precision").table[0]
            .iter()
            .position(|name| *name == tracker.name)
            .unwrap();
        let dp: f64 = plot(&report, "precision").table[21][column].parse().unwrap();
        assert!((dp - tracker.overall.dp20.mean).abs() < 1e-6, "{}", tracker.name);
    }
    // Deer and Crossing have a cluttered background; only Deer has motion blur, which then has no
    // plot.
    let loser = &board.trackers.iter().find(|t| t.name == "loser").unwrap().targets;
    let both = loser.iter().filter(|target| target.target != "Mine");
    let both: Vec<f64> = both.map(|target| target.seeds[0].curves.success50()).collect();
    let of_clutter = plot(&report, "success_BC");
    let column = of_clutter.table[0].iter().position(|name| name == "loser").unwrap();
    let half: f64 = of_clutter.table[11][column].parse().unwrap();
    assert!((half - both.iter().sum::<f64>() / 2.0).abs() < 1e-6);
    assert!(of_clutter.title.ends_with("(2)"), "{}", of_clutter.title);
    assert!(!names.contains(&"success_MB") && !names.contains(&"precision_DEF"));
    let attributes = &report.tables.iter().find(|(name, _)| name == "attributes").unwrap().1;
    assert!(attributes.iter().any(|row| row[1] == "MB"), "the table has all of them");
}

/// Names come from folders and files of strangers.
#[test]
fn names_inject_nothing_into_page_pictures_tables_and_paths() {
    let folder = tempfile::tempdir().unwrap();
    let mut truth = dataset(&folder.path().join("data"));
    scored(&folder.path().join("results"), &truth);
    let mut results = results::read_all(&[folder.path().join("results")], &truth).unwrap();
    let long = "n".repeat(300);
    let trackers = ["=HYPERLINK(\"x\")", "<img src=1 onerror=alert(1)>\u{1b}[31m", &long];
    for (results, name) in results.iter_mut().zip(trackers) {
        results.name = name.to_string();
    }
    let targets = ["</text><script>alert(1)</script>", "../../\u{7}\nup", &format!("{long}2")];
    for (old, new) in ALL.iter().zip(targets) {
        let sequence = truth.sequences.iter_mut().find(|sequence| sequence.name == *old).unwrap();
        sequence.name = new.to_string();
        sequence.attributes = vec!["@SUM(A1)<b>".to_string()];
        let runs = results.iter_mut().flat_map(|results| &mut results.runs);
        runs.filter(|run| run.target == *old).for_each(|run| run.target = new.to_string());
    }
    let board = score::scoreboard(&results, &truth);
    let report = report(&board, &truth, &[]).unwrap();
    for markup in ["<img", "<script>alert", "(A1)<b>", "\u{1b}", "\u{7}"] {
        assert!(!report.html.contains(markup), "{markup}");
    }
    assert!(report.html.contains("&lt;img src=1 onerror"));
    for plot in &report.plots {
        let usual = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        assert!(plot.name.chars().all(usual) && plot.name.len() <= 100, "{}", plot.name);
        assert!(!plot.name.starts_with('.'), "{}", plot.name);
        plot.png().unwrap_or_else(|error| panic!("{}: {error}", plot.name));
    }
    let names: std::collections::BTreeSet<&str> =
        report.plots.iter().map(|plot| plot.name.as_str()).collect();
    assert_eq!(names.len(), report.plots.len(), "each plot has files of its own");
    let tables = report.tables.iter().map(|(_, table)| report::csv(table));
    for table in tables.chain(report.plots.iter().map(Plot::csv)) {
        for cell in table.split([',', '\n']).map(|cell| cell.trim_start_matches('"')) {
            let is_text = !cell.is_empty() && cell.parse::<f64>().is_err();
            assert!(!(is_text && cell.starts_with(['=', '+', '-', '@'])), "{cell}");
        }
    }
}

#[test]
fn status_and_score_are_shown_where_they_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let silent = scored(&folder.path().join("results"), &truth);
    let without = report(&silent, &truth, &["loser"]).unwrap();
    assert!(!without.html.contains("Status and score") && !without.html.contains(">status</text>"));
    assert!(!without.plots.iter().any(|plot| plot.name == "reliability"));

    // Lost from frame 6 on, and said so from frame 7 on.
    let mut results = results::read_all(&[folder.path().join("results")], &truth).unwrap();
    let loser = results.iter_mut().find(|results| results.name == "loser").unwrap();
    for run in &mut loser.runs {
        let status = |frame| if frame < 7 { Status::Tracked } else { Status::Lost };
        run.statuses = Some((0..FRAMES).map(status).collect());
        run.scores = Some((0..FRAMES).map(|frame| if frame < 6 { 0.9 } else { 0.1 }).collect());
    }
    let board = score::scoreboard(&results, &truth);
    let report = report(&board, &truth, &["loser"]).unwrap();
    assert!(report.html.contains("<h2>Status and score</h2>"));
    assert_eq!(report.html.matches(">status</text>").count(), 3, "one strip for each target");
    let status = &report.tables.iter().find(|(name, _)| name == "status").unwrap().1;
    let of_loser = |mean: &str, counts: [&str; 2]| {
        let shares = ["1.000000", "0.833333", "0.000000", "7.000000"];
        let row = [&["loser", mean], &shares[..], &counts, &["0.100000", "1.000000"]].concat();
        row.iter().map(|cell| cell.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(status[1], of_loser("targets", ["1.000000", "0.000000"]));
    assert_eq!(status[2], of_loser("pooled", ["3", "0"]));
    assert_eq!(status.len(), 3, "the other trackers say nothing");
    let reliability = plot(&report, "reliability");
    assert_eq!(reliability.table[2][1..], ["0.1", "0.2", "18", "0.100000", "0.000000"]);
    assert_eq!(reliability.table[10][1..], ["0.9", "1.0", "15", "0.900000", "1.000000"]);
}

#[test]
fn differences_need_enough_targets() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("truth");
    fs::create_dir_all(&root).unwrap();
    let names = ["a", "b", "c", "d", "e", "f"];
    let rows: String = (0..FRAMES).map(|frame| format!("{},11,16,12\n", 5 + frame)).collect();
    for count in [5, 6] {
        names[..count]
            .iter()
            .for_each(|name| fs::write(root.join(format!("{name}.txt")), &rows).unwrap());
        let folder_of_results = folder.path().join(format!("results{count}"));
        tracker(&folder_of_results, "near", &names[..count], 1, FRAMES);
        tracker(&folder_of_results, "far", &names[..count], 9, FRAMES);
        let truth = Dataset::open(&root).unwrap();
        let results = results::read_all(&[&folder_of_results], &truth).unwrap();
        let board = score::scoreboard(&results, &truth);
        let report = report(&board, &truth, &[]).unwrap();
        let pairs = &report.tables.iter().find(|(name, _)| name == "pairs").unwrap().1;
        let drawn = report.plots.iter().any(|plot| plot.name == "differences");
        assert_eq!((drawn, pairs.len()), (count == 6, if count == 6 { 2 } else { 1 }));
        assert_eq!(report.html.contains("too few to assess the differences"), count == 5);
    }
}

#[test]
fn the_same_input_gives_the_same_report() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let board = scored(&folder.path().join("results"), &truth);
    assert_eq!(report(&board, &truth, &[]).unwrap(), report(&board, &truth, &[]).unwrap());
}

#[test]
fn trackers_are_compared_on_their_common_targets() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let folder_of_results = folder.path().join("results");
    tracker(&folder_of_results, "half", &ALL[..2], 0, FRAMES);
    let board = scored(&folder_of_results, &truth);
    let report = report(&board, &truth, &[]).unwrap();
    let note = "Compared on the 2 targets that all trackers have. Left out, because there are no \
                results from half: Mine.";
    assert!(report.html.contains(note));
    assert!(plot(&report, "success").title.contains("2 targets"));
    assert!(!report.plots.iter().any(|plot| plot.name == "overlap_Mine"));
    let trackers = &report.tables.iter().find(|(name, _)| name == "trackers").unwrap().1;
    assert!(trackers[1..].iter().all(|row| row[1] == "2"), "{trackers:?}");
}

#[test]
fn runs_of_different_protocols_are_not_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let mut board = scored(&folder.path().join("results"), &truth);
    let of = |board: &Scoreboard, name: &str| {
        board.trackers.iter().position(|tracker| tracker.name == name).unwrap()
    };
    let folder_of_results = of(&board, "loser");
    for target in &mut board.trackers[folder_of_results].targets {
        let later = Pass { variant: 1, first: 3, ..target.seeds[0].passes[0].clone() };
        target.seeds[0].passes.push(later);
    }
    let one_pass = report(&board, &truth, &[]).unwrap();
    assert!(
        one_pass.html.contains("loser is left out: its runs are TRE, this report compares OPE.")
    );
    assert_eq!(plot(&one_pass, "success").title, "Success plots of OPE, 3 targets");
    let several = report(&board, &truth, &["loser"]).unwrap();
    assert_eq!(plot(&several, "success").title, "Success plots of TRE, 3 targets");
    assert_eq!(plot(&several, "success").table[0], ["threshold", "loser"]);
    assert!(!several.plots.iter().any(|plot| plot.name == "differences"), "there is no other");
}

#[test]
fn trackers_without_common_targets_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let folder_of_results = folder.path().join("results");
    tracker(&folder_of_results, "a", &["Deer"], 0, FRAMES);
    tracker(&folder_of_results, "b", &["Mine"], 0, FRAMES);
    let results = results::read_all(&[&folder_of_results], &truth).unwrap();
    let board = score::scoreboard(&results, &truth);
    let error = |result: Result<Report, Error>| result.unwrap_err().to_string();
    assert!(
        error(report(&board, &truth, &[])).contains("no target has results from all 2 trackers")
    );
    assert!(
        error(report(&board, &truth, &["c"]))
            .contains("there is no tracker c; the trackers are a, b")
    );
    assert!(
        error(report(&Scoreboard::default(), &truth, &[])).contains("no tracker could be scored")
    );
}

#[test]
fn an_unreadable_frame_is_noted_and_the_others_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let truth = dataset(&folder.path().join("data"));
    let board = scored(&folder.path().join("results"), &truth);
    fs::write(folder.path().join("data/Deer/img/0007.png"), "not an image").unwrap();
    let report = report(&board, &truth, &["loser"]).unwrap();
    assert!(report.html.contains("A frame cannot be shown: ") && report.html.contains("0007.png"));
    assert_eq!(report.html.matches("data:image/jpeg;base64,").count(), 2);
}
