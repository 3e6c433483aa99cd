//! The annotated video, read back.

mod support;

#[test]
fn the_annotated_video_has_all_frames_at_the_rate_of_the_source() {
    let bench = support::Bench::new();
    bench.mp4("v.mp4", 6);
    bench.track("v.mp4").args(["--video", "out.mp4"]).assert().success();
    bench.track("v.mp4").args(["--video", "half.mp4", "--stride", "2"]).assert().success();
    let look = |name: &str| {
        let video = patchlock_media::open(bench.path(name).to_str().unwrap(), false).unwrap();
        (video.length(), video.rate().map(|rate| f64::from(rate.frames) / f64::from(rate.seconds)))
    };
    assert_eq!(look("out.mp4"), (Some(6), Some(25.0)));
    assert_eq!(look("half.mp4"), (Some(3), Some(12.5)));
}
