//! MOT.

use crate::support::*;

#[test]
fn mot_counts_from_one() {
    assert_eq!(
        exported_text(format_named("mot")),
        "1,1,11.0000,6.0000,20.0000,10.0000,1.0000,-1,-1,-1\n\
         3,1,12.0000,6.0000,20.0000,10.0000,0.2500,-1,-1,-1\n\
         3,3,31.0000,21.0000,8.0000,6.0000,1.0000,-1,-1,-1\n\
         5,3,-3.0000,28.0000,8.0000,6.1235,0.5000,-1,-1,-1\n\
         7,1,15.0000,6.0000,20.0000,10.0000,0.7500,-1,-1,-1\n"
    );
}

#[test]
fn mot_has_confidence_0_or_no_line_for_a_lost_target() {
    let [kept, blank] = lost_exports(format_named("mot"), |out| text(out));
    let line = |frame: usize, left: u32, confidence: &str| {
        format!("{frame},1,{left}.0000,6.0000,20.0000,10.0000,{confidence},-1,-1,-1\n")
    };
    let found = [(1, 11), (2, 12), (5, 15), (6, 16)].map(|(k, left)| line(k, left, "0.7500"));
    assert_eq!(blank, found.concat());
    let lost = [(3, 12), (4, 12), (7, 16)].map(|(k, left)| line(k, left, "0.0000"));
    let [a, b, c, d] = found;
    let [e, f, g] = lost;
    assert_eq!(kept, [a, b, e, f, c, d, g].concat());
}
