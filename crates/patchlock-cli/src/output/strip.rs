//! A picture of selected frames side by side, each with a caption.

use anyhow::{Context, Result};
use patchlock_drawing::canvas::{Area, Canvas};
use patchlock_drawing::text;

const BACKGROUND: [u8; 3] = [18, 22, 28];
const TITLE: [u8; 3] = [236, 240, 244];
const NOTE: [u8; 3] = [158, 168, 180];
const GAP: usize = 14;
const CAPTION: usize = 68;
/// Width of the line around a frame.
const BORDER: usize = 5;

pub struct Panel {
    pub frame: Canvas,
    /// First line of the caption.
    pub title: String,
    /// First word of the second line of the caption, in the colour of the mark.
    pub status: String,
    /// The rest of the second line.
    pub note: String,
    /// Colour of the status, of the mark before the caption and of the line around the frame.
    pub mark: [u8; 3],
}

pub fn draw(panels: &[Panel]) -> Result<Canvas> {
    let size =
        |panel: &Panel| [panel.frame.width(), panel.frame.height()].map(|side| side as usize);
    let width: usize = panels.iter().map(|panel| size(panel)[0] + GAP).sum::<usize>() + GAP;
    let height =
        panels.iter().map(|panel| size(panel)[1]).max().context("the strip has no frames")?;
    let mut strip = Canvas::plain(width, height + 2 * GAP + CAPTION, BACKGROUND)
        .context("the strip has no pixels")?;
    let mut left = GAP;
    for panel in panels {
        let [width, height] = size(panel);
        let (x, border) = (left as f32, BORDER as f32);
        let [w, h] = [width, height].map(|length| (length + 2 * BORDER) as f32);
        let around = Area { x: x - border, y: GAP as f32 - border, w, h };
        strip.fill(around, panel.mark, 1.0);
        strip.paste(&panel.frame, left, GAP);
        let top = (GAP + height) as f32;
        strip.fill_round(Area { x, y: top + 14.0, w: 5.0, h: 52.0 }, 2.0, panel.mark, 1.0);
        strip.text(&panel.title, x + 17.0, top + 26.0, 24.0, TITLE);
        strip.text(&panel.status, x + 17.0, top + 55.0, 22.0, panel.mark);
        let after = x + 17.0 + text::width(&panel.status, 22.0) + 14.0;
        strip.text(&panel.note, after, top + 55.0, 18.0, NOTE);
        left += width + GAP;
    }
    Ok(strip)
}
