//! No field of the configuration is dead, and none takes a value outside its range.

use crate::film::OCCLUDED;
use patchlock::config::Range;
use patchlock::{BoundingBox, Error, Estimate, PARAMETERS, PRESETS, Tracker, TrackerConfig};
use serde::Deserialize;
use serde::de::value::{Error as ValueError, MapDeserializer};
use serde_json::{Map, Value, json};
use std::collections::HashMap;

/// The fields that a case sets.
type Fields = Map<String, Value>;

fn fields(value: Value) -> Fields {
    value.as_object().unwrap().clone()
}

fn config(given: &Fields) -> TrackerConfig {
    serde_json::from_value(Value::Object(given.clone())).unwrap()
}

/// Small and restless, so that all that the tracker does happens within a few frames.
fn base() -> Fields {
    fields(json!({
        "particles": 25, "small_step": 8, "templates": 6, "update_interval": 2, "small_update_interval": 3,
    }))
}

/// Tracks past the tree; with words on what is outside the frame, from its border on.
fn track(given: &Fields, name: &str) -> Vec<Estimate> {
    let mut tracker = OCCLUDED.begin(&config(given), 16);
    if name == "outside" {
        let bbox = BoundingBox { x: -6.0, y: 60.0, w: 48.0, h: 40.0 };
        tracker.init(&OCCLUDED.frame(16), bbox).unwrap();
    }
    OCCLUDED.go_on(&mut tracker, 17..34)
}

/// For each number another value, and what must be set besides for it to matter.
fn other_numbers() -> Vec<(&'static str, Value, Value)> {
    vec![
        ("seed", json!(1), json!({})),
        ("particles", json!(26), json!({})),
        ("sigma_x", json!(5.0), json!({})),
        ("sigma_y", json!(5.0), json!({})),
        ("sigma_scale", json!(0.03), json!({})),
        ("sigma_rotation", json!(0.01), json!({})),
        ("sigma_aspect", json!(0.01), json!({})),
        ("sigma_skew", json!(0.01), json!({})),
        ("template_side", json!(28), json!({})),
        ("large_patch", json!(12), json!({})),
        ("large_step", json!(16), json!({})),
        ("small_patch", json!(6), json!({})),
        ("small_step", json!(6), json!({})),
        ("atoms", json!(3), json!({})),
        ("min_residual", json!(0.05), json!({})),
        ("stop_energy", json!(0.05), json!({})),
        ("buffer", json!(2), json!({})),
        ("epsilon", json!(0.2), json!({})),
        ("beta", json!(0.2), json!({})),
        ("templates", json!(7), json!({})),
        ("warm_up_frames", json!(4), json!({ "first_templates": "warm_up" })),
        ("update_interval", json!(3), json!({})),
        ("small_update_interval", json!(4), json!({})),
        ("delta", json!(1.0), json!({})),
        ("large_buffer_guard", json!(1.0), json!({})),
        ("small_buffer_guard", json!(1.0), json!({})),
        ("replacement_growth", json!(1.0), json!({})),
        ("forgetting", json!(0.5), json!({})),
        ("subspace_keep", json!(0.3), json!({})),
        ("subspace_vectors", json!(1), json!({})),
        ("lambda", json!(0.1), json!({})),
        ("guided_radius", json!(0), json!({})),
        ("guided_epsilon", json!(1.0), json!({})),
    ]
}

/// Every other value of a field that this test tries, with what is set besides.
fn others(name: &str, range: Range) -> Vec<(Value, Fields)> {
    let default = serde_json::to_value(TrackerConfig::default()).unwrap()[name].clone();
    match range {
        Range::Flag => vec![(json!(!default.as_bool().unwrap()), Fields::new())],
        Range::Words(words) => {
            let others = words.iter().map(|&word| json!(word)).filter(|word| *word != default);
            others.map(|word| (word, Fields::new())).collect()
        }
        Range::Number { .. } => {
            let numbers = other_numbers();
            let row = numbers.into_iter().find(|(field, ..)| *field == name);
            let (_, value, besides) =
                row.unwrap_or_else(|| panic!("the table has no other value for `{name}`"));
            vec![(value, fields(besides))]
        }
    }
}

#[test]
fn every_field_matters() {
    let mut tracked: HashMap<(String, bool), Vec<Estimate>> = HashMap::new();
    let mut dead = Vec::new();
    for parameter in PARAMETERS {
        for (value, besides) in others(parameter.name, parameter.range) {
            let mut given = base();
            given.extend(besides);
            let key = (Value::Object(given.clone()).to_string(), parameter.name == "outside");
            let before =
                tracked.entry(key).or_insert_with(|| track(&given, parameter.name)).clone();
            given.insert(parameter.name.to_owned(), value.clone());
            if track(&given, parameter.name) == before {
                dead.push(format!("{} = {value}", parameter.name));
            }
        }
    }
    assert!(dead.is_empty(), "these change nothing: {dead:?}");
}

#[test]
fn the_table_of_parameters_is_the_configuration() {
    let default = serde_json::to_value(TrackerConfig::default()).unwrap();
    let mut fields: Vec<&str> = default.as_object().unwrap().keys().map(String::as_str).collect();
    let mut names: Vec<&str> = PARAMETERS.iter().map(|parameter| parameter.name).collect();
    fields.sort_unstable();
    names.sort_unstable();
    assert_eq!(fields, names);
    for (name, ..) in other_numbers() {
        assert!(names.contains(&name), "{name} is no field");
    }
}

/// The refusal must name field, value and range.
fn check_refusal(config: TrackerConfig, name: &str, value: &str, range: Range) {
    let error = Tracker::new(config).unwrap_err();
    assert!(matches!(error, Error::Config { field, .. } if field == name), "{name}: {error}");
    let said = error.to_string();
    let parts = [name.to_owned(), value.to_owned(), range.to_string()];
    assert!(parts.iter().all(|part| said.contains(part)), "{name} = {value}: {said}");
}

#[test]
fn a_number_outside_its_range_is_refused() {
    let default = serde_json::to_value(TrackerConfig::default()).unwrap();
    for parameter in PARAMETERS {
        let Range::Number { min, max } = parameter.range else { continue };
        let name = parameter.name;
        let parse =
            |value: Value| serde_json::from_value::<TrackerConfig>(json!({ (name): value }));
        if default[name].is_f64() {
            for value in [min - 1.0, max + 1.0] {
                let config = parse(json!(value)).unwrap();
                check_refusal(config, name, &format!("{value:?}"), parameter.range);
            }
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                // JSON has no word for these.
                let map = MapDeserializer::<_, ValueError>::new([(name, value)].into_iter());
                let config = TrackerConfig::deserialize(map).unwrap();
                check_refusal(config, name, &format!("{value:?}"), parameter.range);
            }
            for value in [min, max] {
                parse(json!(value)).unwrap().validate().unwrap();
            }
        } else {
            assert!(parse(json!(-1)).is_err(), "{name} = -1");
            assert!(parse(json!(1.5)).is_err(), "{name} = 1.5");
            if min >= 1.0 {
                let value = min as u64 - 1;
                let config = parse(json!(value)).unwrap();
                check_refusal(config, name, &value.to_string(), parameter.range);
            }
            if max < u64::MAX as f64 {
                let value = max as u64 + 1;
                let config = parse(json!(value)).unwrap();
                check_refusal(config, name, &value.to_string(), parameter.range);
            }
        }
    }
}

#[test]
fn an_unknown_word_or_field_is_refused() {
    for parameter in PARAMETERS {
        let name = parameter.name;
        let said = |value: Value| {
            serde_json::from_value::<TrackerConfig>(json!({ (name): value }))
                .unwrap_err()
                .to_string()
        };
        match parameter.range {
            Range::Words(words) => {
                let said = said(json!("sideways"));
                assert!(said.contains("sideways"), "{name}: {said}");
                assert!(words.iter().all(|word| said.contains(word)), "{name}: {said}");
            }
            Range::Flag => assert!(said(json!("sideways")).contains("sideways")),
            Range::Number { .. } => assert!(said(json!("sideways")).contains("sideways")),
        }
    }
    let error = serde_json::from_str::<TrackerConfig>(r#"{ "particels": 5 }"#).unwrap_err();
    assert!(error.to_string().contains("particels"), "{error}");
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
    let fast = TrackerConfig::preset("fast").unwrap();
    assert_eq!((fast.particles, fast.small_step), (400, 4));
    assert_eq!(TrackerConfig { particles: 650, small_step: 2, ..fast }, TrackerConfig::default());
    for name in PRESETS {
        Tracker::new(TrackerConfig::preset(name).unwrap()).unwrap();
    }
    let error = TrackerConfig::preset("papper").unwrap_err().to_string();
    assert!(error.contains("papper") && error.contains("paper, fast"), "{error}");
}
