//! Every field of the configuration has an effect, and none accepts a value outside its range.

use crate::sequence::OCCLUDED;
use patchlock::{
    Error, Estimate, FrameView, Method, PARAMETERS, PRESETS, Parameter, Range, Tracker,
    TrackerConfig,
};
use serde::Deserialize;
use serde::de::value::{Error as ValueError, MapDeserializer};
use serde_json::{Map, Value, json};
use std::collections::HashMap;

/// Settings by name, without their groups: names are unique across groups.
type Fields = Map<String, Value>;

fn fields(value: Value) -> Fields {
    value.as_object().unwrap().clone()
}

fn config(given: &Fields) -> TrackerConfig {
    serde_json::from_value(grouped(given)).unwrap()
}

/// The settings sorted into their groups.
fn grouped(given: &Fields) -> Value {
    let mut table = Map::new();
    for (name, value) in given {
        match group(name) {
            "" => drop(table.insert(name.clone(), value.clone())),
            group => {
                let group = table.entry(group).or_insert_with(|| json!({}));
                group[name] = value.clone();
            }
        }
    }
    Value::Object(table)
}

fn group(name: &str) -> &'static str {
    PARAMETERS.iter().find(|parameter| parameter.name == name).map_or("", |found| found.group)
}

fn parse(name: &str, value: Value) -> Result<TrackerConfig, serde_json::Error> {
    serde_json::from_value(grouped(&Fields::from_iter([(name.to_owned(), value)])))
}

fn default_of(parameter: &Parameter) -> Value {
    let default = serde_json::to_value(TrackerConfig::default()).unwrap();
    match parameter.group {
        "" => default[parameter.name].clone(),
        group => default[group][parameter.name].clone(),
    }
}

/// Settings under which a field of this group can have an effect: its method, or the default one for common
/// fields. Few particles and frequent updates let every kind of step occur within a few frames.
fn base(group: &str) -> Fields {
    let mut given = fields(json!({
        "particles": 25, "small_step": 8, "templates": 6,
        "update_interval": 2, "small_update_interval": 3,
    }));
    if group == "robust" {
        // The target is lost and found again while it is half hidden, and any small rotation is believed.
        let easily_lost = json!({
            "search": 4.0, "jump_ratio": 1.0, "sure": 0.95, "lost_below": 0.7, "lost_drop": 0.7,
            "lost_hidden": 0.4, "lost_after": 2,
            "found_above": 0.3, "trial": 2, "colour_weight": 10.0, "colour_contrast": -1.0,
            "rotation_below": 2.0, "rotation_least": 0.02, "rotation_margin": 0.3,
        });
        given.extend(fields(easily_lost));
    }
    if !group.is_empty() {
        given.insert("method".to_owned(), json!(group));
    }
    given
}

/// An estimate, and everything that an observer saw on its frame.
type Seen = (Estimate, String);

/// Tracks to the tree, or with the method `robust`, which can find the target again, past it; a frame at a
/// time, so that a difference is known as soon as it is there.
fn track(given: &Fields) -> impl Iterator<Item = Seen> {
    let mut tracker = OCCLUDED.begin(&config(given), 16);
    let end = if given.get("method") == Some(&json!("robust")) { OCCLUDED.len() } else { 34 };
    (17..end).map(move |k| {
        let mut seen = String::new();
        let mut observer = |view: &FrameView<'_>| seen = format!("{view:?}");
        let estimate = tracker.update_observed(&OCCLUDED.frame(k), &mut observer).unwrap();
        (estimate, seen)
    })
}

/// Whether these settings change anything on any frame.
fn changes(given: &Fields, before: &[Seen]) -> bool {
    track(given).zip(before).any(|(now, before)| now != *before)
}

/// A different value for each numeric field.
fn other_numbers() -> Vec<(&'static str, Value)> {
    vec![
        ("seed", json!(1)),
        ("particles", json!(26)),
        ("sigma_x", json!(5.0)),
        ("sigma_y", json!(5.0)),
        ("sigma_scale", json!(0.03)),
        ("sigma_rotation", json!(0.01)),
        ("sigma_aspect", json!(0.01)),
        ("sigma_skew", json!(0.01)),
        ("template_side", json!(28)),
        ("large_patch", json!(12)),
        ("large_step", json!(16)),
        ("small_patch", json!(6)),
        ("small_step", json!(6)),
        ("atoms", json!(3)),
        ("min_residual", json!(0.05)),
        ("buffer", json!(2)),
        ("epsilon", json!(0.2)),
        ("beta", json!(0.2)),
        ("templates", json!(7)),
        ("update_interval", json!(3)),
        ("small_update_interval", json!(4)),
        ("delta", json!(1.0)),
        ("large_buffer_guard", json!(1.0)),
        ("small_buffer_guard", json!(1.0)),
        ("replacement_growth", json!(1.0)),
        ("forgetting", json!(0.5)),
        ("subspace_keep", json!(0.3)),
        ("subspace_vectors", json!(1)),
        ("lambda", json!(0.1)),
        ("guided_radius", json!(0)),
        ("guided_epsilon", json!(1e-6)),
        ("search", json!(5.0)),
        ("label_width", json!(0.1)),
        ("temporal", json!(5.0)),
        ("max_patch", json!(160.0)),
        ("min_patch", json!(196.0)),
        ("scale_count", json!(17)),
        ("scale_step", json!(1.03)),
        ("scale_label_width", json!(0.15)),
        ("scale_rate", json!(0.1)),
        ("scale_area", json!(300.0)),
        ("rotation_below", json!(0.1)),
        ("rotation_least", json!(0.3)),
        ("rotation_margin", json!(10.0)),
        ("rotation_rate", json!(0.9)),
        ("penalty", json!(0.5)),
        ("filters", json!(2)),
        ("wide_mask", json!(0.8)),
        ("wide_temporal", json!(2.0)),
        ("wide_penalty", json!(1.0)),
        ("slow_temporal", json!(60.0)),
        ("slow_penalty", json!(0.5)),
        ("colour_weight", json!(1.0)),
        ("colour_contrast", json!(0.9)),
        ("colour_rate", json!(0.5)),
        ("around_rate", json!(0.0)),
        ("memory_rate", json!(0.1)),
        ("sure", json!(2.0)),
        ("jump_ratio", json!(2.5)),
        ("jump_least", json!(5.0)),
        ("lost_below", json!(0.5)),
        ("lost_drop", json!(9.0)),
        ("lost_hidden", json!(9.0)),
        ("first_frames", json!(0)),
        ("lost_after", json!(4)),
        ("covered_share", json!(0.0)),
        ("covered_visible", json!(0.0)),
        ("covered_elsewhere", json!(9.0)),
        ("covered_contrast", json!(0.0)),
        ("covered_below", json!(0.0)),
        ("covered_after", json!(5)),
        ("found_above", json!(0.9)),
        ("trial", json!(9)),
        ("search_windows", json!(40)),
        ("scale_least", json!(1.0)),
        ("visible_step", json!(6)),
        ("score_bias", json!(0.5)),
        ("score_visible", json!(1.0)),
        ("score_elsewhere", json!(-1.0)),
    ]
}

/// The values of a field, other than its default, that this test tries.
fn others(parameter: &Parameter) -> Vec<Value> {
    let default = default_of(parameter);
    match parameter.range {
        Range::Flag => vec![json!(!default.as_bool().unwrap())],
        Range::Words(words) => {
            words.iter().map(|&word| json!(word)).filter(|word| *word != default).collect()
        }
        Range::Number { .. } => {
            let name = parameter.name;
            let row = other_numbers().into_iter().find(|(field, _)| *field == name);
            vec![row.unwrap_or_else(|| panic!("other_numbers() has no value for `{name}`")).1]
        }
    }
}

#[test]
fn every_field_matters() {
    let mut without_effect = Vec::new();
    let mut tracked: HashMap<String, Vec<Seen>> = HashMap::new();
    for parameter in PARAMETERS {
        for value in others(parameter) {
            let mut given = base(parameter.group);
            if parameter.name.starts_with("covered_") {
                // The target counts as covered, with a low score, from the first frame on.
                let covered = json!({
                    "covered_share": 9.0, "covered_below": 9.0, "covered_after": 2, "score_bias": -9.0,
                    "lost_below": 0.0,
                });
                given.extend(fields(covered));
                if ["covered_visible", "covered_elsewhere", "covered_contrast"]
                    .contains(&parameter.name)
                {
                    // Covered by what the patch model half recognises.
                    let half = json!({
                        "covered_share": 0.0, "covered_visible": 9.0, "covered_elsewhere": 0.0,
                        "covered_contrast": 9.0,
                    });
                    given.extend(fields(half));
                }
            }
            let key = Value::Object(given.clone()).to_string();
            let before = tracked.entry(key).or_insert_with(|| track(&given).collect());
            given.insert(parameter.name.to_owned(), value.clone());
            if !changes(&given, before) {
                without_effect.push(format!("{} = {value}", parameter.name));
            }
        }
    }
    assert!(without_effect.is_empty(), "these fields have no effect: {without_effect:?}");
}

/// A parameter that a method does not use changes nothing under that method; one of another group that it
/// uses does.
#[test]
fn a_parameter_is_used_by_the_methods_that_say_so() {
    let mut wrong = Vec::new();
    for method in [Method::Patchwise, Method::Robust] {
        let mut given = base(method.name());
        if method == Method::Robust {
            // The patch model learns on all frames, so also while the target is half hidden.
            given
                .extend(fields(json!({ "first_frames": 100, "lost_below": 0.0, "rotate": false })));
        }
        let before: Vec<Seen> = track(&given).collect();
        for parameter in PARAMETERS.iter().filter(|row| !["", method.name()].contains(&row.group)) {
            let mut given = given.clone();
            given.insert(parameter.name.to_owned(), others(parameter).remove(0));
            if changes(&given, &before) != parameter.is_used_by(method) {
                wrong.push((method, parameter.name));
            }
        }
    }
    assert!(wrong.is_empty(), "is_used_by is wrong for {wrong:?}");
}

#[test]
fn the_table_of_parameters_is_the_configuration() {
    let default = serde_json::to_value(TrackerConfig::default()).unwrap();
    let mut fields: Vec<(String, String)> = Vec::new();
    for (name, value) in default.as_object().unwrap() {
        match value.as_object() {
            Some(group) => fields.extend(group.keys().map(|field| (name.clone(), field.clone()))),
            None => fields.push((String::new(), name.clone())),
        }
    }
    let mut rows: Vec<(String, String)> =
        PARAMETERS.iter().map(|row| (row.group.to_owned(), row.name.to_owned())).collect();
    fields.sort_unstable();
    rows.sort_unstable();
    assert_eq!(fields, rows);
    for (name, _) in other_numbers() {
        assert!(rows.iter().any(|(_, row)| row == name), "{name} is not a field");
    }
}

/// Allows a setting to be named without its group.
#[test]
fn no_two_fields_have_the_same_name() {
    for (k, row) in PARAMETERS.iter().enumerate() {
        assert!(PARAMETERS[..k].iter().all(|other| other.name != row.name), "{}", row.name);
        assert!(!row.source.is_empty() && !row.purpose.is_empty(), "{}", row.name);
    }
}

/// The error must name field, value and range.
fn check_refusal(config: TrackerConfig, name: &str, value: &str, range: Range) {
    let error = Tracker::new(config).unwrap_err();
    assert!(matches!(error, Error::Config { field, .. } if field == name), "{name}: {error}");
    let message = error.to_string();
    let parts = [name.to_owned(), value.to_owned(), range.to_string()];
    assert!(parts.iter().all(|part| message.contains(part)), "{name} = {value}: {message}");
}

#[test]
fn a_number_outside_its_range_is_refused() {
    for parameter in PARAMETERS {
        let Range::Number { min, max } = parameter.range else { continue };
        let name = parameter.name;
        if default_of(parameter).is_f64() {
            for value in [min - 1.0, max + 1.0] {
                let config = parse(name, json!(value)).unwrap();
                check_refusal(config, name, &format!("{value:?}"), parameter.range);
            }
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                // JSON cannot represent these values.
                let map = MapDeserializer::<_, ValueError>::new([(name, value)].into_iter());
                let config = TrackerConfig::deserialize(map).unwrap();
                check_refusal(config, name, &format!("{value:?}"), parameter.range);
            }
            for value in [min, max] {
                parse(name, json!(value)).unwrap().validate().unwrap();
            }
        } else {
            assert!(parse(name, json!(-1)).is_err(), "{name} = -1");
            assert!(parse(name, json!(1.5)).is_err(), "{name} = 1.5");
            if min >= 1.0 {
                let value = min as u64 - 1;
                let config = parse(name, json!(value)).unwrap();
                check_refusal(config, name, &value.to_string(), parameter.range);
            }
            if max < u64::MAX as f64 {
                let value = max as u64 + 1;
                let config = parse(name, json!(value)).unwrap();
                check_refusal(config, name, &value.to_string(), parameter.range);
            }
        }
    }
}

#[test]
fn an_unknown_word_or_field_is_refused() {
    for parameter in PARAMETERS {
        let message = parse(parameter.name, json!("sideways")).unwrap_err().to_string();
        assert!(message.contains("sideways"), "{}: {message}", parameter.name);
        if let Range::Words(words) = parameter.range {
            assert!(
                words.iter().all(|word| message.contains(word)),
                "{}: {message}",
                parameter.name
            );
        }
    }
    for unknown in [json!({ "particels": 5 }), json!({ "patchwise": { "particels": 5 } })] {
        let error = serde_json::from_value::<TrackerConfig>(unknown).unwrap_err();
        assert!(error.to_string().contains("particels"), "{error}");
    }
}

#[test]
fn fields_that_do_not_fit_each_other_are_refused() {
    let cases = [
        (json!({ "template_side": 15 }), "large_patch", "template_side = 15"),
        (json!({ "template_side": 8, "large_patch": 8, "small_patch": 9 }), "small_patch", "8"),
        (json!({ "small_step": 1, "small_patch": 2 }), "small_step", "8192"),
        (json!({ "large_step": 1, "large_patch": 2, "templates": 40 }), "large_step", "8192"),
    ];
    for (given, name, part) in cases {
        let error = Tracker::new(config(&fields(given))).unwrap_err();
        assert!(matches!(error, Error::Config { field, .. } if field == name), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn presets_have_names() {
    let mut fast = TrackerConfig::preset("fast").unwrap();
    assert_eq!((fast.robust.filters, fast.robust.max_patch, fast.robust.rotate), (1, 150.0, false));
    (fast.robust.filters, fast.robust.max_patch, fast.robust.rotate) = (3, 200.0, true);
    assert_eq!(fast, TrackerConfig::preset("robust").unwrap());
    assert_eq!(TrackerConfig::preset("paper").unwrap().method, Method::Patchwise);
    let robust = TrackerConfig::preset("robust").unwrap();
    assert_eq!((&robust, robust.method), (&TrackerConfig::default(), Method::Robust));
    assert_eq!(PRESETS[0], "robust");
    for name in PRESETS {
        Tracker::new(TrackerConfig::preset(name).unwrap()).unwrap();
    }
    let error = TrackerConfig::preset("papper").unwrap_err().to_string();
    assert!(error.contains("papper") && error.contains("robust, fast, paper"), "{error}");
}

/// Settings of version 0.1 have no groups and may contain options that no longer exist.
#[test]
fn settings_of_version_0_1_are_read() {
    let read = |value: Value| serde_json::from_value::<TrackerConfig>(value);
    let old = json!({
        "particles": 77, "seed": 3, "outside": "zero", "divide": true, "stop_energy": 0.0,
        "warm_up_frames": 9,
    });
    let config = read(old).unwrap();
    assert_eq!((config.patchwise.particles, config.seed), (77, 3));
    // They mean the only method that there was, unless they name one.
    assert_eq!(config.method, Method::Patchwise);
    assert_eq!(read(json!({ "outside": "zero" })).unwrap().method, Method::Patchwise);
    for given in [
        json!({ "particles": 77, "method": "robust" }),
        json!({ "patchwise": { "particles": 77 } }),
        json!({ "search": 4.0 }),
        json!({ "seed": 3 }),
    ] {
        assert_eq!(read(given.clone()).unwrap().method, Method::Robust, "{given}");
    }
    let removed = [
        ("outside", json!("reject")),
        ("divide", json!(false)),
        ("stop_energy", json!(0.1)),
        ("first_templates", json!("nearest")),
        ("scale_motion", json!("relative")),
        ("selection", json!("textbook")),
        ("coefficients", json!("positive")),
    ];
    for (name, value) in removed {
        let error = read(json!({ name: value })).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("no longer exists"), "{error}");
    }
    let twice = json!({ "particles": 77, "patchwise": { "particles": 78 } });
    let error = read(twice).unwrap_err().to_string();
    assert!(error.contains("`particles` belongs to the group `patchwise`"), "{error}");
}
