use std::convert::Infallible;

use super::*;

fn window() -> Window {
    let hosts = AllowedHosts { allowed: Vec::new(), advice: "" };
    Window::open(WindowOptions { port: 0, hosts, in_notebook: false }).unwrap()
}

fn grey(level: u8) -> Picture {
    Picture::rgb(64, 48, vec![level; 64 * 48 * 3])
}

/// Asks until this is shown of the frame that is asked about: its number, whether there may be a
/// newer one.
fn until(shared: &WindowState, shown: (usize, bool)) {
    let mut frames = shared.frames.subscribe();
    let is_so = |frame: &Option<Arc<WindowFrame>>| {
        let frame = frame.as_ref();
        frame.is_some_and(|frame| (frame.number, frame.about["newer"] == true) == shown)
    };
    let waited = tokio::runtime::Builder::new_current_thread().build().unwrap();
    waited.block_on(frames.wait_for(is_so)).unwrap();
}

#[test]
fn boxes_are_drawn_on_the_newest_frame_that_was_wanted() {
    let window = window();
    let shared = Arc::clone(&window.shared);
    let told = |said| shared.told(said, &[]).unwrap_or_default();
    let drawn =
        |frame| told(PageMessage::Boxes(DrawnBoxes { frame, boxes: vec![[8.0, 8.0, 20.0, 20.0]] }));
    std::thread::scope(|scope| {
        let asking = scope.spawn(|| {
            let mut shown = (0, Arc::new(grey(0)));
            let mut left = vec![NextFrame::End, NextFrame::Frame(7, grey(7)), NextFrame::NotYet];
            let newer = &mut || Ok::<_, Infallible>(left.pop().unwrap_or(NextFrame::End));
            let Ok(boxes) = window.ask(&mut shown, Some(newer), &|| false);
            (boxes, shown)
        });
        until(&shared, (0, true));
        told(PageMessage::Newer);
        until(&shared, (7, true));
        assert_eq!(drawn(0)["error"], "the boxes are on frame 0, not on frame 7");
        told(PageMessage::Newer);
        until(&shared, (7, false));
        assert_eq!(drawn(7)["taken"], true);
        assert_eq!(drawn(7)["error"], "the boxes were drawn already");
        let (boxes, (number, picture)) = asking.join().unwrap();
        assert_eq!((boxes.len(), number, picture.width), (1, 7, 64));
    });
}

#[test]
fn a_target_is_drawn_again_on_a_frame_that_is_shown() {
    let window = window();
    let shown = |number, redraw| {
        let about = json!({ "redraw": redraw, "targets": [{ "id": 1 }, { "id": 2 }] });
        Some(Arc::new(WindowFrame { number, picture: Arc::new(grey(number as u8)), about }))
    };
    let sent = [shown(3, true), shown(4, false)];
    let redraw = |frame, id, x| {
        let drawn = RestartRequest { frame, id: Some(id), bbox: [x, 8.0, 20.0, 20.0] };
        window.shared.told(PageMessage::Redraw(drawn), &sent).unwrap()
    };
    assert_eq!(redraw(2, 1, 8.0)["error"], "frame 2 is not shown any more");
    assert_eq!(redraw(3, 9, 8.0)["error"], "this target cannot be drawn again");
    assert_eq!(redraw(4, 1, 8.0)["error"], "this target cannot be drawn again");
    assert!(redraw(3, 1, 900.0)["error"].as_str().unwrap().contains("900,8,20,20"));
    assert_eq!(window.redrawn().count(), 0);
    for (id, x) in [(2, 8.0), (1, 9.0), (2, 10.0)] {
        assert_eq!(redraw(3, id, x)["redrawn"], true);
    }
    let redrawn: Vec<_> = window.redrawn().map(|it| (it.id, it.frame, it.bbox.x)).collect();
    assert_eq!(redrawn, [(Some(1), 3, 9.0), (Some(2), 3, 10.0)]);
    assert_eq!(window.redrawn().count(), 0);
}
