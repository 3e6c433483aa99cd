//! A tracker needs the network of its configuration, and a saved one needs the same network.

use crate::methods::{network, robust, robust_with_network, vittrack};
use crate::sequence::{SIMPLE, bits};
use patchlock::{
    Error, Estimate, FrameView, MultiSnapshot, MultiTracker, Network, NetworkError, Preset,
    Snapshot, Tracker, TrackerConfig,
};

fn network_of(config: &TrackerConfig) -> Network {
    config.network.clone().unwrap()
}

/// The text of a snapshot after three frames, of one target and of many.
fn saved(config: &TrackerConfig) -> [String; 2] {
    let mut one = SIMPLE.begin(config, 0);
    let mut many = MultiTracker::new(config.clone()).unwrap();
    many.add(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
    for k in 1..4 {
        one.update(&SIMPLE.frame(k)).unwrap();
        many.update(&SIMPLE.frame(k)).unwrap();
    }
    [
        serde_json::to_string(&one.snapshot()).unwrap(),
        serde_json::to_string(&many.snapshot()).unwrap(),
    ]
}

fn one(text: &str) -> Snapshot {
    serde_json::from_str(text).unwrap()
}

fn many(text: &str) -> MultiSnapshot {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_tracker_without_a_network_does_not_begin() {
    let wanted = Error::Network(NetworkError::None);
    let begun = Tracker::start(Preset::Network, &SIMPLE.frame(0), SIMPLE.truth(0));
    assert_eq!(begun.unwrap_err(), wanted);
    assert_eq!(MultiTracker::new(Preset::Network).unwrap_err(), wanted);
    let empty = MultiTracker::new(network()).unwrap().snapshot();
    assert_eq!(MultiTracker::restore(empty).unwrap_err(), wanted);
    assert!(wanted.to_string().contains("needs a network"), "{wanted}");
}

#[test]
fn a_saved_tracker_needs_the_same_network() {
    for config in [network(), robust_with_network()] {
        needs_the_same_network(&config);
    }
}

fn needs_the_same_network(config: &TrackerConfig) {
    let other = network_of(&vittrack());
    let [one_text, many_text] = saved(config);
    let needed = network_of(config).hash().to_owned();
    assert!(one_text.contains(&needed) && many_text.contains(&needed));
    for (given, network) in [(None, None), (Some(other.hash().to_owned()), Some(other))] {
        let with = |snapshot: Snapshot| match network.clone() {
            Some(network) => snapshot.with_network(network),
            None => snapshot,
        };
        let with_many = |snapshot: MultiSnapshot| match network.clone() {
            Some(network) => snapshot.with_network(network),
            None => snapshot,
        };
        let wanted = Error::Network(NetworkError::Other { needed: needed.clone(), given });
        assert_eq!(Tracker::restore(with(one(&one_text))).unwrap_err(), wanted);
        assert_eq!(MultiTracker::restore(with_many(many(&many_text))).unwrap_err(), wanted);
        assert!(wanted.to_string().contains(&needed), "{wanted}");
    }
}

#[test]
fn with_the_same_network_it_continues_to_the_same_boxes() {
    for config in [network(), vittrack(), robust_with_network()] {
        let whole = SIMPLE.track(&config, 0..9);
        let [text, many_text] = saved(&config);
        // The same files, loaded again.
        let mut tracker = Tracker::restore(one(&text).with_network(network_of(&config))).unwrap();
        assert_eq!(tracker.config(), &config);
        let rest = SIMPLE.resume(&mut tracker, 4..9);
        assert_eq!(bits(&rest), bits(&whole[3..]));
        assert_eq!(rest, whole[3..]);
        let snapshot = many(&many_text).with_network(network_of(&config));
        let mut tracker = MultiTracker::restore(snapshot).unwrap();
        for (k, whole) in (4..9).zip(&whole[3..]) {
            assert_eq!(tracker.update(&SIMPLE.frame(k)).unwrap()[0].estimate, *whole);
        }
    }
}

/// Nor does it go on with one that it has not seen the target with.
#[test]
fn a_target_that_was_tracked_without_a_network_takes_none() {
    let [text, many_text] = saved(&robust());
    let network = network_of(&network());
    let errors = [
        Tracker::restore(one(&text).with_network(network.clone())).unwrap_err(),
        MultiTracker::restore(many(&many_text).with_network(network)).unwrap_err(),
    ];
    for error in errors {
        assert!(error.to_string().contains("tracked without a network"), "{error}");
    }
}

#[test]
fn a_committee_has_the_members_that_its_configuration_names() {
    let config = robust_with_network();
    let [good, _] = saved(&config);
    let start = good.find(r#",{"network":{"network":"#).unwrap();
    let mut values = serde_json::Deserializer::from_str(&good[start + 1..]).into_iter();
    let _: serde_json::Value = values.next().unwrap().unwrap();
    // As text: the rest has numbers of 128 bits.
    let alone = format!("{}{}", &good[..start], &good[start + 1 + values.byte_offset()..]);
    let error = Tracker::restore(one(&alone).with_network(network_of(&config))).unwrap_err();
    assert!(error.to_string().contains("the members of its committee"), "{error}");
}

#[test]
fn a_committee_has_the_same_boxes_on_any_number_of_threads_and_observed() {
    let config = robust_with_network();
    let boxes = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&SIMPLE.track(&config, 0..20)))
    });
    assert_eq!(boxes[0], boxes[1]);
    let (mut tracker, mut shown) = (SIMPLE.begin(&config, 0), Vec::new());
    let observed = (1..20).map(|k| {
        let mut observer = |view: &FrameView<'_>| {
            shown.push(match view {
                FrameView::Robust(_) => "robust",
                FrameView::Network(_) => "network",
                FrameView::Committee(view) => {
                    assert_eq!(view.members.len(), 2);
                    assert_eq!(view.agrees, view.members.iter().all(|member| member.is_believed));
                    "committee"
                }
                _ => "another",
            });
        };
        tracker.update_observed(&SIMPLE.frame(k), &mut observer).unwrap().clone()
    });
    assert_eq!(bits(&observed.collect::<Vec<_>>()), boxes[0]);
    assert_eq!(shown, ["robust", "network", "committee"].repeat(19));
}

/// What each member of a committee is to say alone does not depend on the other.
#[test]
fn the_members_of_a_committee_are_the_trackers_alone() {
    let mut plain = network();
    plain.network = robust_with_network().network;
    let alone = [SIMPLE.track(&robust(), 0..20), SIMPLE.track(&plain, 0..20)];
    let mut config = robust_with_network();
    config.set("network_fit", 0.0).unwrap();
    let mut tracker = SIMPLE.begin(&config, 0);
    for k in 1..20 {
        let mut observer = |view: &FrameView<'_>| {
            let FrameView::Committee(view) = view else { return };
            for (member, alone) in view.members.iter().zip(&alone) {
                let alone = Estimate { visibility: None, ..alone[k - 1].clone() };
                assert_eq!(member.estimate, alone, "{} on frame {k}", member.name);
            }
        };
        tracker.update_observed(&SIMPLE.frame(k), &mut observer).unwrap();
    }
}

/// Our own network learns what the target looks like; a saved target goes on with that.
#[test]
fn patchnet_learns_from_each_frame() {
    let mut config = TrackerConfig::from(Preset::Network);
    config.network = Some(Network::patchnet());
    let mut tracker = SIMPLE.begin(&config, 0);
    let state = |tracker: &Tracker| {
        let snapshot = serde_json::to_value(tracker.snapshot()).unwrap();
        let target = &snapshot["track"]["target"]["network"];
        let template = &target["template"];
        [&template["first"], &template["current"], &target["classifier"]].map(Clone::clone)
    };
    let begun = state(&tracker);
    assert_eq!(begun[0], begun[1]);
    for k in 1..6 {
        tracker.update(&SIMPLE.frame(k)).unwrap();
    }
    let learnt = state(&tracker);
    assert_eq!(begun[0], learnt[0]);
    assert!((1..3).all(|k| begun[k] != learnt[k]));
    let with_patchnet =
        |snapshot: Snapshot| Tracker::restore(snapshot.with_network(Network::patchnet()));
    let mut value = serde_json::to_value(tracker.snapshot()).unwrap();
    let mut restored = with_patchnet(tracker.snapshot()).unwrap();
    for k in 6..12 {
        let frame = SIMPLE.frame(k);
        assert_eq!(tracker.update(&frame).unwrap(), restored.update(&frame).unwrap(), "frame {k}");
    }
    let classifier = &mut value["track"]["target"]["network"]["classifier"];
    classifier.as_array_mut().unwrap().pop();
    let damaged = with_patchnet(serde_json::from_value(value.clone()).unwrap());
    value["track"]["target"]["network"]["classifier"] = serde_json::Value::Null;
    for damaged in [damaged, with_patchnet(serde_json::from_value(value).unwrap())] {
        let message = damaged.unwrap_err().to_string();
        assert!(message.contains("its classifier does not fit"), "{message}");
    }
}

/// Whether an ONNX file is the backbone or the head is seen in it, not in the order of the files.
#[test]
fn a_network_is_its_files_in_any_order() {
    let backbone: &[u8] = include_bytes!("../golden/network/nanotrack_backbone.onnx");
    let head: &[u8] = include_bytes!("../golden/network/nanotrack_head.onnx");
    let turned = Network::from_bytes(&[head, backbone]).unwrap();
    assert_eq!(turned, network_of(&network()));
    assert_eq!((turned.name(), turned.hash().len()), ("NanoTrack v3", 64));
    assert_ne!(turned, network_of(&vittrack()));
}

#[test]
fn a_saved_target_with_bad_numbers_is_refused() {
    let config = network();
    let [good, _] = saved(&config);
    let value: serde_json::Value = serde_json::from_str(&good).unwrap();
    type Damage = fn(&mut serde_json::Value);
    let damages: [(&str, Damage); 7] = [
        ("a number of its target", |target| target["place"]["size"][0] = 0.0.into()),
        ("a number of its target", |target| target["place"]["size"][1] = (-5.0).into()),
        ("a number of its target", |target| target["place"]["size"][1] = 1e300.into()),
        ("a number of its target", |target| target["factor"][0] = 9.0.into()),
        ("another length", |target| target["template"]["first"] = vec![0.5; 7].into()),
        ("another length", |target| target["template"]["current"] = vec![0.5; 7].into()),
        ("null", |target| target["border"][2] = serde_json::Value::Null),
    ];
    for (words, damage) in damages {
        let mut damaged = value.clone();
        damage(&mut damaged["track"]["target"]["network"]);
        assert_ne!(damaged, value);
        let read = serde_json::from_value::<Snapshot>(damaged);
        let message = match read {
            Ok(read) => {
                Tracker::restore(read.with_network(network_of(&config))).unwrap_err().to_string()
            }
            Err(error) => error.to_string(),
        };
        assert!(message.contains(words), "{message}");
    }
}

/// VitTrack computes other operators: attention, a layer norm.
#[test]
fn a_vittrack_gives_the_same_boxes_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| SIMPLE.track(&vittrack(), 0..8))
    };
    let one = on(1);
    for threads in [2, 3, 5] {
        assert_eq!(bits(&one), bits(&on(threads)), "{threads} threads");
    }
}
