//! COCO.

use crate::support::*;
use serde_json::Value;

#[test]
fn coco_has_videos_tracks_and_outlines() {
    let all: Value = serde_json::from_str(&exported_text(format_named("coco"))).unwrap();
    assert_eq!(all["categories"][0]["name"], "toy car");
    assert_eq!(all["videos"][0]["name"], "film");
    let ids = |list: &str, field: &str| -> Vec<i64> {
        let values = all[list].as_array().unwrap().iter();
        values.map(|value| value[field].as_i64().unwrap()).collect()
    };
    assert_eq!(ids("tracks", "id"), [1, 3]);
    assert_eq!(ids("images", "frame_id"), [0, 2, 4, 6]);
    assert_eq!(ids("annotations", "image_id"), [1, 2, 2, 3, 4]);
    assert_eq!(ids("annotations", "track_id"), [1, 1, 3, 3, 1]);
    assert_eq!(all["annotations"][3]["attributes"]["track_id"], 3);
    assert_eq!(all["images"][1]["file_name"], "frame_000002.jpg");
    let first = &all["annotations"][0];
    assert_eq!(first["bbox"], serde_json::json!([10.0, 5.0, 20.0, 10.0]));
    assert_eq!(
        first["segmentation"],
        serde_json::json!([[10.0, 5.0, 30.0, 5.0, 30.0, 15.0, 10.0, 15.0]])
    );
    assert_eq!((&first["area"], &first["score"]), (&200.0.into(), &1.0.into()));
    let third = &all["annotations"][2];
    assert_eq!(third["area"], 48.0);
    assert!(third.get("score").is_none() && third.get("segmentation").is_none());
}

#[test]
fn coco_has_the_status_as_an_attribute() {
    let [kept, blank] = lost_exports_with(&with_status("coco", "tracked,uncertain,lost"), |out| {
        let all: Value = serde_json::from_str(&text(out)).unwrap();
        assert_eq!(all["images"].as_array().unwrap().len(), 7);
        let annotations = all["annotations"].as_array().unwrap().iter();
        annotations
            .map(|a| (a["image_id"].as_u64().unwrap(), a["attributes"]["status"].clone()))
            .collect::<Vec<_>>()
    });
    let names = ["tracked", "tracked", "lost", "lost", "uncertain", "tracked", "lost"];
    let named: Vec<(u64, Value)> = (1..).zip(names.map(Value::from)).collect();
    assert_eq!(kept, named);
    let found: Vec<_> = named.into_iter().filter(|(_, status)| status != "lost").collect();
    assert_eq!(blank, found);
}
