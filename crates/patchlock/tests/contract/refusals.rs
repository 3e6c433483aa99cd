//! No field of the configuration accepts a value of another kind or outside its range.

use crate::fields::{defaults, json_of, read, rows, table};
use crate::methods::{robust, with};
use crate::sequence::SIMPLE;
use patchlock::{
    Error, Kind, Method, MultiTracker, PaperConfig, Parameter, Preset, Range, RobustConfig,
    Tracker, TrackerConfig, Value,
};
use serde::Deserialize;
use serde::de::value::{Error as ValueError, MapDeserializer};
use serde_json::json;

/// A whole number is a number, too.
#[test]
fn a_value_of_another_kind_is_refused() {
    let values = [Value::from(true), 7.into(), 7.5.into(), "7".into()];
    for default in defaults() {
        for row in rows(&default.method) {
            let accepted = match row.kind {
                Kind::Flag => vec![&values[0]],
                Kind::Whole => vec![&values[1]],
                Kind::Number => vec![&values[1], &values[2]],
                _ => vec![&values[3]],
            };
            for value in values.iter().filter(|value| !accepted.contains(value)) {
                let mut config = default.clone();
                let wanted =
                    Error::SettingKind { name: row.name, value: value.to_string(), kind: row.kind };
                let message = wanted.to_string();
                let words = [row.name, &value.to_string(), &row.kind.to_string()];
                assert!(words.iter().all(|word| message.contains(word)), "{message}");
                assert_eq!(config.set(row.name, value.clone()), Err(wanted));
                assert_eq!(config, default);
                let error = read(table(&default.method, row, &json_of(value))).unwrap_err();
                assert!(error.contains(&message), "{error}");
            }
            let Range::Number { min, max } = row.range else { continue };
            let whole = (min.ceil() as i64).max(i64::from(max >= 1.0));
            if whole as f64 > max {
                continue;
            }
            let mut config = default.clone();
            config.set(row.name, whole).unwrap();
            let same = match row.kind {
                Kind::Number => Value::Number(whole as f64),
                _ => Value::Whole(whole),
            };
            assert_eq!(config.get(row.name).unwrap(), same);
            assert_eq!(read(table(&default.method, row, &json!(whole))).unwrap(), config);
        }
    }
}

/// The error must name field, value and range, and nothing has changed.
fn check_refusal(default: &TrackerConfig, row: &Parameter, value: &Value) {
    let mut config = default.clone();
    let error = config.set(row.name, value.clone()).unwrap_err();
    assert!(
        matches!(error, Error::Config { field, .. } if field == row.name),
        "{}: {error}",
        row.name
    );
    assert_eq!(config, *default);
    let message = error.to_string();
    let parts = [row.name.to_owned(), value.to_string(), row.range.to_string()];
    assert!(parts.iter().all(|part| message.contains(part)), "{} = {value}: {message}", row.name);
    // JSON has no numbers that are not finite.
    if !matches!(value, Value::Number(number) if !number.is_finite()) {
        let error = read(table(&default.method, row, &json_of(value))).unwrap_err();
        assert!(error.contains(&message), "{error}");
    }
}

#[test]
fn a_number_outside_its_range_is_refused() {
    for default in defaults() {
        for row in rows(&default.method) {
            let Range::Number { min, max } = row.range else { continue };
            let refuse = |value: Value| check_refusal(&default, row, &value);
            let bounds: [Value; 2] = if row.kind == Kind::Number {
                let outside = [min - 1.0, max + 1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
                outside.into_iter().for_each(|number| refuse(number.into()));
                [min.into(), max.into()]
            } else {
                [-1, i64::MIN, min as i64 - 1, max as i64 + 1, i64::MAX]
                    .into_iter()
                    .for_each(|number| refuse(number.into()));
                [(min as i64).into(), (max as i64).into()]
            };
            for value in bounds {
                let mut config = default.clone();
                config.set(row.name, value.clone()).unwrap();
                assert_eq!(config.get(row.name).unwrap(), value);
            }
        }
    }
}

/// Formats such as TOML have numbers that are not finite.
#[test]
fn a_number_that_is_not_finite_is_refused_when_it_is_read() {
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let settings = MapDeserializer::<_, ValueError>::new([("search", number)].into_iter());
        let table = MapDeserializer::new([("robust", settings)].into_iter());
        let error = TrackerConfig::deserialize(table).unwrap_err().to_string();
        let wanted = format!("the setting `search` is {number:?}; allowed: 1.5 to 20");
        assert_eq!(error, wanted);
    }
}

/// Fields can be changed without [`TrackerConfig::set`]; then the tracker checks them.
#[test]
fn a_field_out_of_range_is_refused_by_the_tracker() {
    let of_paper = |change: fn(&mut PaperConfig)| {
        let mut paper = PaperConfig::default();
        change(&mut paper);
        TrackerConfig::from(paper)
    };
    let of_robust = |change: fn(&mut RobustConfig)| {
        let mut robust = RobustConfig::default();
        change(&mut robust);
        TrackerConfig::from(robust)
    };
    let mut seed = robust();
    seed.seed = 1 << 53;
    let cases = [
        (seed, "seed", "9007199254740992"),
        (of_paper(|paper| paper.particles = 0), "particles", "0"),
        (of_paper(|paper| paper.beta = f64::NAN), "beta", "NaN"),
        (of_paper(|paper| paper.patches.epsilon = -1.0), "epsilon", "-1.0"),
        (of_robust(|robust| robust.search = f64::INFINITY), "search", "inf"),
        (of_robust(|robust| robust.scale_count = 101), "scale_count", "101"),
        (of_robust(|robust| robust.patches.templates = 1), "templates", "1"),
    ];
    for (config, name, value) in cases {
        let range = Parameter::named(name).unwrap().range;
        let message = refused(&config, name).to_string();
        let parts = [name, value, &range.to_string()];
        assert!(parts.iter().all(|part| message.contains(part)), "{name} = {value}: {message}");
    }
}

/// The error of every way to begin with these settings.
fn refused(config: &TrackerConfig, name: &str) -> Error {
    let error = config.validate().unwrap_err();
    assert!(matches!(error, Error::Config { field, .. } if field == name), "{error}");
    let begun = Tracker::start(config.clone(), &SIMPLE.frame(0), SIMPLE.truth(0));
    assert_eq!(format!("{:?}", begun.unwrap_err()), format!("{error:?}"));
    let many = MultiTracker::new(config.clone());
    assert_eq!(format!("{:?}", many.unwrap_err()), format!("{error:?}"));
    error
}

#[test]
fn an_unknown_word_is_refused() {
    for default in defaults() {
        for row in rows(&default.method) {
            let error = read(table(&default.method, row, &json!("sideways"))).unwrap_err();
            assert!(error.contains("sideways") && error.contains(row.name), "{error}");
            if let Range::Words(words) = row.range {
                assert!(words.iter().all(|word| error.contains(word)), "{}: {error}", row.name);
                check_refusal(&default, row, &"sideways".into());
            }
        }
    }
}

#[test]
fn an_unknown_setting_or_group_is_refused() {
    for mut config in defaults() {
        let wanted = Error::UnknownSetting { name: "particels".to_owned() };
        assert_eq!(config.get("particels"), Err(wanted.clone()));
        assert_eq!(config.set("particels", 5), Err(wanted));
        // Groups are no settings.
        for group in Method::NAMES.into_iter().chain(["patches", ""]) {
            assert!(config.get(group).is_err() && config.set(group, 5).is_err(), "{group}");
        }
    }
    let unknown = json!({ "particels": 5 });
    let of_methods = Method::NAMES.map(|method| json!({ method: unknown }));
    let of_others = [unknown.clone(), json!({ "paper": { "patches": unknown } })];
    for table in of_methods.into_iter().chain(of_others) {
        let error = read(table).unwrap_err();
        assert!(error.contains("unknown setting `particels`"), "{error}");
    }
    for (table, group) in [
        (json!({ "patchwise": {} }), "patchwise"),
        (json!({ "patches": { "epsilon": 0.1 } }), "patches"),
        (json!({ "paper": { "robust": {} } }), "robust"),
        (json!({ "paper": { "patches": { "patches": {} } } }), "patches"),
    ] {
        let error = read(table).unwrap_err();
        assert!(error.contains(group), "{error}");
    }
}

/// A configuration has one method.
#[test]
fn settings_of_two_methods_are_refused() {
    for table in [
        json!({ "paper": {}, "robust": {} }),
        json!({ "paper": { "beta": 1.0 }, "robust": { "search": 4.0 } }),
    ] {
        let error = read(table).unwrap_err();
        assert!(error.contains("`robust`"), "{error}");
    }
    let error = read(json!({ "robust": { "beta": 1.0 } })).unwrap_err();
    assert!(error.contains("`beta`") && error.contains("`paper`"), "{error}");
    let error = read(json!({ "paper": { "search": 4.0 } })).unwrap_err();
    assert!(error.contains("`search`") && error.contains("`robust`"), "{error}");
}

#[test]
fn fields_that_do_not_fit_each_other_are_refused() {
    let patches = [
        (&[("template_side", 15)][..], "large_patch", "template_side = 15"),
        (&[("template_side", 8), ("large_patch", 8), ("small_patch", 9)], "small_patch", "8"),
        (&[("small_step", 1), ("small_patch", 2)], "small_step", "8192"),
        (&[("large_step", 1), ("large_patch", 2), ("templates", 40)], "large_step", "8192"),
    ];
    let has_patches = |preset: &Preset| TrackerConfig::from(*preset).method.patches().is_some();
    for preset in Preset::ALL.into_iter().filter(has_patches) {
        for (given, name, part) in patches {
            let message = refused(&with(preset, given), name).to_string();
            assert!(message.contains(part), "{message}");
        }
    }
    let message = refused(&with(Preset::Robust, &[("scale_count", 32)]), "scale_count").to_string();
    assert!(message.contains("32") && message.contains("odd"), "{message}");
}
