//! Every field of the configuration has an effect.

use crate::methods::{all, network, quick_of};
use crate::sequence::{OCCLUDED, SIMPLE};
use patchlock::{
    Error, Estimate, FrameView, Kind, Method, MultiTracker, NetworkConfig, NetworkError,
    NetworkUse, PARAMETERS, PaperConfig, Parameter, Preset, Range, RobustConfig, Tracker,
    TrackerConfig, Value,
};
use patchlock_testdata::slow;
use serde_json::{Value as Json, json};
use std::collections::HashMap;

/// The default settings of every method.
pub fn defaults() -> Vec<TrackerConfig> {
    Preset::ALL.map(TrackerConfig::from).into()
}

/// The rows that a method uses.
pub fn rows(method: &Method) -> impl Iterator<Item = &'static Parameter> {
    PARAMETERS.iter().filter(|row| row.is_used_by(method))
}

/// A number as the value of a setting.
fn value_of(row: &Parameter, number: f64) -> Value {
    match row.kind {
        Kind::Whole => Value::from(number as i64),
        Kind::Flag => Value::from(number != 0.0),
        _ => Value::from(number),
    }
}

/// Changes those settings that the method has.
fn set(config: &mut TrackerConfig, settings: &[(&str, f64)]) {
    for &(name, number) in settings {
        let row = Parameter::named(name).unwrap();
        if row.is_used_by(&config.method) {
            config.set(name, value_of(row, number)).unwrap();
        }
    }
}

/// Settings of a method under which a field of this group can have an effect. Few particles and
/// frequent updates let every kind of step occur within a few frames.
fn base(method: &Method, group: &str) -> TrackerConfig {
    let mut config = quick_of(method);
    let often = [
        ("particles", 25.0),
        ("templates", 6.0),
        ("update_interval", 2.0),
        ("small_update_interval", 3.0),
        // No score of a network is certain, so each is between the two settings.
        ("tracked_score", 1.0),
        ("lost_score", 0.0),
    ];
    set(&mut config, &often);
    if group == "robust" {
        // The target is lost and found again while it is half hidden, and any small rotation is
        // believed.
        let easily_lost = [
            ("search", 4.0),
            ("sure", 0.95),
            ("lost_below", 0.7),
            ("lost_drop", 0.7),
            ("lost_after", 2.0),
            ("found_above", 0.3),
            ("trial", 2.0),
            ("colour_weight", 10.0),
            ("colour_contrast", -1.0),
            ("rotation_below", 2.0),
            ("rotation_least", 0.02),
            ("rotation_margin", 0.3),
        ];
        set(&mut config, &easily_lost);
    } else {
        // The patch model learns on all frames, so also while the target is half hidden.
        set(&mut config, &[("first_frames", 100.0), ("lost_below", 0.0), ("rotate", 0.0)]);
    }
    config
}

/// [`base`] for this row.
fn base_of(method: &Method, row: &Parameter) -> TrackerConfig {
    let mut config = base(method, row.group);
    if method.info().network == NetworkUse::Optional && !config.reads(row) {
        config.network = network().network;
    }
    if row.name.starts_with("covered_") {
        // The target counts as covered, with a low score, from the first frame on.
        let covered = [
            ("covered_visible", 9.0),
            ("covered_elsewhere", 0.0),
            ("covered_contrast", 9.0),
            ("covered_below", 9.0),
            ("covered_after", 2.0),
            ("lost_below", 0.0),
        ];
        set(&mut config, &covered);
    }
    let special: &[(&str, f64)] = match row.name {
        // The filter over rotation responds near the limit.
        "rotation_mean_rate" => &[("rotation_clear", 0.9)],
        // All windows of the search are looked at on each frame, and the best place counts.
        "search_overlap" | "search_larger" | "search_smaller" => &[
            ("search_windows", 60.0),
            ("found_promising", 0.0),
            ("search_larger", 3.0),
            ("search_smaller", 0.5),
        ],
        // However sure the memory is.
        "unseen_below" => &[("found_above", 9.0)],
        "unseen_rate" => &[("found_above", 9.0), ("unseen_below", 0.8)],
        // The target is given up.
        "score_lost" => &[("seen_certainty", 9.0), ("gone_below", 9.0)],
        // Around the last place alone.
        "search_windows" => &[("search_windows", 1.0)],
        // Templates are replaced on every frame.
        "guided_epsilon" => {
            &[("epsilon", 0.12), ("update_interval", 1.0), ("small_update_interval", 1.0)]
        }
        // Sizes that the memory knows as well as that of the window.
        "found_larger" | "found_smaller" => &[("found_larger", 1.01), ("found_smaller", 0.99)],
        _ => &[],
    };
    set(&mut config, special);
    config
}

/// An estimate, and everything that an observer saw on its frame.
type ObservedEstimate = (Estimate, String);

/// Tracks to the tree, or with the method `robust`, which can find the target again, past it; a
/// frame at a time, so that a difference is known as soon as it is there.
fn track(config: &TrackerConfig) -> impl Iterator<Item = ObservedEstimate> {
    let mut tracker = OCCLUDED.begin(config, 16);
    let end = if config.method.name() == "robust" { OCCLUDED.len() } else { 34 };
    (17..end).map(move |k| {
        let mut seen = String::new();
        let mut observer = |view: &FrameView<'_>| seen = format!("{view:?}");
        let estimate = tracker.update_observed(&OCCLUDED.frame(k), &mut observer).unwrap();
        (estimate.clone(), seen)
    })
}

/// Other values of a setting than in these settings, which they fit: every word, the other flag, or
/// numbers, those far away first, as they soon have an effect.
pub fn others(config: &TrackerConfig, row: &Parameter) -> Vec<Value> {
    let now = config.get(row.name).unwrap();
    let number = match now {
        Value::Whole(number) => number as f64,
        Value::Number(number) => number,
        _ => 0.0,
    };
    let tried: Vec<Value> = match row.range {
        Range::Flag => vec![true.into(), false.into()],
        Range::Words(words) => words.iter().map(|&word| word.into()).collect(),
        Range::Number { min, max } => {
            let far = max.min(10.0 * number.abs().max(1.0));
            let all = [min, far, 2.0 * number, number / 2.0, number + 1.0, number - 1.0];
            all.map(|number| value_of(row, number)).into()
        }
    };
    let fits = |value: &Value| {
        let mut changed = config.clone();
        changed.set(row.name, value.clone()).is_ok() && changed.validate().is_ok()
    };
    tried.into_iter().filter(|value| *value != now && fits(value)).collect()
}

/// Under every method that reads it: each word and each flag, and some other number.
#[test]
fn every_field_matters() {
    let step = if slow("every_field_matters", 20) { 1 } else { 10 };
    let mut without_effect = Vec::new();
    for method in all().iter().map(|config| &config.method) {
        let mut tracked: HashMap<String, Vec<ObservedEstimate>> = HashMap::new();
        for parameter in rows(method).filter(|row| base_of(method, row).reads(row)).step_by(step) {
            let base = base_of(method, parameter);
            let before =
                &*tracked.entry(format!("{base:?}")).or_insert_with(|| track(&base).collect());
            let has_effect = |value: &Value| {
                let mut config = base.clone();
                config.set(parameter.name, value.clone()).unwrap();
                track(&config).zip(before).any(|(now, before)| now != *before)
            };
            let (all, name) = (others(&base, parameter), method.name());
            if matches!(parameter.range, Range::Number { .. }) {
                if !all.iter().any(has_effect) {
                    without_effect.push(format!("{} with {name}", parameter.name));
                }
                continue;
            }
            for value in all.iter().filter(|value| !has_effect(value)) {
                without_effect.push(format!("{} = {value} with {name}", parameter.name));
            }
        }
    }
    assert!(without_effect.is_empty(), "these fields have no effect: {without_effect:?}");
}

/// A setting that another one turns off changes nothing, and neither does the seed where nothing is
/// drawn.
#[test]
fn what_is_not_read_has_no_effect() {
    let step = if slow("what_is_not_read_has_no_effect", 10) { 1 } else { 5 };
    let mut upright = TrackerConfig::default();
    upright.set("rotate", false).unwrap();
    let names = ["rotation_least", "turning_rate"];
    for (config, names) in [(upright, &names[..]), (network(), &["seed"])] {
        let before: Vec<ObservedEstimate> = track(&config).collect();
        let unread = |row: &&Parameter| row.is_used_by(&config.method) && !config.reads(row);
        let unread: Vec<_> = PARAMETERS.iter().filter(unread).collect();
        for name in names {
            assert!(unread.iter().any(|row| row.name == *name), "{name}");
        }
        for row in unread.into_iter().step_by(step) {
            let mut config = config.clone();
            config.set(row.name, others(&config, row).remove(0)).unwrap();
            assert!(track(&config).eq(before.iter().cloned()), "{} has an effect", row.name);
        }
    }
}

/// A method has the settings that it uses, and no others.
#[test]
fn a_setting_is_used_by_the_methods_that_have_it() {
    for mut config in all() {
        let (before, method) = (config.clone(), config.method.name());
        let fields = fields(&before);
        for row in PARAMETERS {
            let used = row.is_used_by(&before.method);
            let held =
                fields.iter().any(|(group, name, _)| (*group, &**name) == (row.group, row.name));
            assert_eq!(held, used, "{} with {method}", row.name);
            if used {
                continue;
            }
            let wanted = Error::UnusedSetting { name: row.name, method, owner: row.group };
            let message = wanted.to_string();
            assert!([row.name, method, row.group].iter().all(|word| message.contains(word)));
            assert_eq!(config.get(row.name), Err(wanted.clone()));
            let owner = defaults().into_iter().find(|config| row.is_used_by(&config.method));
            let other = others(&owner.unwrap(), row).remove(0);
            assert_eq!(config.set(row.name, other), Err(wanted));
            assert_eq!(config, before);
        }
    }
}

/// The serialised settings as group, name and value.
fn fields(config: &TrackerConfig) -> Vec<(&'static str, String, Json)> {
    let (method, table) = (config.method.name(), serde_json::to_value(config).unwrap());
    let mut fields = Vec::new();
    for (name, value) in table.as_object().unwrap() {
        if name != method {
            fields.push(("", name.clone(), value.clone()));
        }
    }
    for (name, value) in table[method].as_object().unwrap() {
        match value.as_object() {
            Some(patches) => {
                assert_eq!(name, "patches");
                let rows =
                    patches.iter().map(|(name, value)| ("patches", name.clone(), value.clone()));
                fields.extend(rows);
            }
            None => fields.push((method, name.clone(), value.clone())),
        }
    }
    fields
}

/// A value of the configuration in JSON.
pub fn json_of(value: &Value) -> Json {
    match value {
        Value::Flag(flag) => json!(flag),
        Value::Whole(number) => json!(number),
        Value::Number(number) => json!(number),
        Value::Word(word) => json!(word),
    }
}

/// A configuration of a method in JSON that has a single setting.
pub fn table(method: &Method, row: &Parameter, value: &Json) -> Json {
    let (method, name) = (method.name(), row.name);
    match row.group {
        "" => json!({ name: value, method: {} }),
        "patches" => json!({ method: { "patches": { name: value } } }),
        _ => json!({ method: { name: value } }),
    }
}

pub fn read(table: Json) -> Result<TrackerConfig, String> {
    serde_json::from_value(table).map_err(|error| error.to_string())
}

#[test]
fn the_table_of_parameters_is_the_configuration() {
    for config in defaults() {
        let mut fields: Vec<(&str, String)> =
            fields(&config).into_iter().map(|(group, name, _)| (group, name)).collect();
        let mut rows: Vec<(&str, String)> =
            rows(&config.method).map(|row| (row.group, row.name.to_owned())).collect();
        fields.sort_unstable();
        rows.sort_unstable();
        assert_eq!(fields, rows);
    }
    for row in PARAMETERS {
        assert!(defaults().iter().any(|config| row.is_used_by(&config.method)), "{}", row.name);
    }
}

/// [`TrackerConfig::get`] and [`TrackerConfig::set`] are what is serialised and read.
#[test]
fn a_setting_by_name_is_the_field() {
    for default in defaults() {
        let method = &default.method;
        assert_eq!(read(json!({ method.name(): {} })).unwrap(), default);
        for row in rows(method) {
            let before = base_of(method, row);
            for value in others(&before, row) {
                let mut config = before.clone();
                config.set(row.name, value.clone()).unwrap();
                assert_ne!(config, before, "{}", row.name);
                assert_eq!(config.get(row.name).unwrap(), value, "{}", row.name);
                let written = fields(&config);
                let field = written.iter().find(|(_, name, _)| name == row.name).unwrap();
                assert_eq!(field.2, json_of(&value), "{}", row.name);
                // Nothing else has changed.
                let differ = written.iter().zip(&fields(&before)).filter(|(a, b)| a != b).count();
                assert_eq!(differ, 1, "{}", row.name);
                // The network is not written.
                let mut read_back = read(serde_json::to_value(&config).unwrap()).unwrap();
                read_back.network.clone_from(&config.network);
                assert_eq!(read_back, config);
                let mut alone = default.clone();
                alone.set(row.name, value.clone()).unwrap();
                let read_alone = read(table(method, row, &json_of(&value))).unwrap();
                assert_eq!(read_alone, alone, "{}", row.name);
            }
        }
    }
}

/// Allows a setting to be named without its group.
#[test]
fn no_two_fields_have_the_same_name() {
    for (k, row) in PARAMETERS.iter().enumerate() {
        assert!(PARAMETERS[..k].iter().all(|other| other.name != row.name), "{}", row.name);
        assert!(!row.source.is_empty() && !row.purpose.is_empty(), "{}", row.name);
        assert_eq!(Parameter::named(row.name), Some(row));
    }
    assert_eq!(Parameter::named("particels"), None);
}

#[test]
fn a_value_has_the_kind_of_its_row() {
    for config in defaults() {
        for row in rows(&config.method) {
            let kind = match config.get(row.name).unwrap() {
                Value::Flag(_) => Kind::Flag,
                Value::Whole(_) => Kind::Whole,
                Value::Number(_) => Kind::Number,
                Value::Word(_) => Kind::Word,
            };
            assert_eq!(kind, row.kind, "{}", row.name);
            let fits = match row.range {
                Range::Flag => kind == Kind::Flag,
                Range::Words(_) => kind == Kind::Word,
                Range::Number { .. } => matches!(kind, Kind::Whole | Kind::Number),
            };
            assert!(fits, "{}: {kind:?} of {:?}", row.name, row.range);
        }
    }
}

#[test]
fn the_form_of_a_configuration() {
    for config in all() {
        let (method, table) = (config.method.name(), serde_json::to_value(&config).unwrap());
        let keys: Vec<&str> = table.as_object().unwrap().keys().map(String::as_str).collect();
        let mut wanted = ["seed", method];
        wanted.sort_unstable();
        assert_eq!(keys, wanted);
        assert_eq!(table[method]["patches"].is_object(), config.method.patches().is_some());
    }
    assert_eq!(read(json!({})).unwrap(), TrackerConfig::default());
    assert_eq!(read(json!({ "seed": 3 })).unwrap().seed, 3);
}

#[test]
fn presets_have_names() {
    assert_eq!(TrackerConfig::from(Preset::Robust), RobustConfig::default().into());
    assert_eq!(TrackerConfig::from(Preset::Paper), PaperConfig::default().into());
    assert_eq!(TrackerConfig::from(Preset::Network), NetworkConfig::default().into());
    assert_eq!(TrackerConfig::from(Preset::default()), TrackerConfig::default());
    assert_eq!(Preset::ALL[0], Preset::default());
    for preset in Preset::ALL {
        assert_eq!(preset.name().parse(), Ok(preset));
        assert_eq!(preset.to_string(), preset.name());
        let begun = Tracker::start(preset, &SIMPLE.frame(0), SIMPLE.truth(0)).map(drop);
        // A network has to be given.
        let wanted = match preset.info().network {
            NetworkUse::Required => Err(NetworkError::None.into()),
            NetworkUse::Optional | NetworkUse::Unused => Ok(()),
        };
        assert_eq!((begun, MultiTracker::new(preset).map(drop)), (wanted.clone(), wanted));
    }
    let error = "papper".parse::<Preset>().unwrap_err().to_string();
    assert!(error.contains("papper") && error.contains("robust, paper, network"), "{error}");
}
