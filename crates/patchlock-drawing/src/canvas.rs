//! A thin layer over the drawing library: RGB in and out, lines that stay visible on any
//! background.

use std::io::{self, Write};

use tiny_skia::{
    Color, FillRule, FilterQuality, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Rect,
    Stroke, StrokeDash, Transform,
};

/// A picture to draw on.
pub struct Canvas {
    pixmap: Pixmap,
}

/// A rectangle by its upper left corner and its size, in pixels; pixel k reaches from k to k + 1.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// Left side.
    pub x: f32,
    /// Upper side.
    pub y: f32,
    /// Width.
    pub w: f32,
    /// Height.
    pub h: f32,
}

/// How an outline is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Width in pixels.
    pub width: f32,
    /// Colour.
    pub colour: [u8; 3],
    /// Whether it consists of dashes.
    pub dashed: bool,
}

impl Canvas {
    /// A canvas of one colour; `None` if it has no pixels or more than can be drawn on.
    pub fn plain(width: usize, height: usize, colour: [u8; 3]) -> Option<Self> {
        let mut pixmap = Pixmap::new(u32::try_from(width).ok()?, u32::try_from(height).ok()?)?;
        pixmap.fill(opaque(colour));
        Some(Self { pixmap })
    }

    /// A canvas with a picture; `None` if the size is 0 or does not match the picture.
    pub fn from_rgb(width: usize, height: usize, rgb: &[u8]) -> Option<Self> {
        let mut pixmap = Pixmap::new(u32::try_from(width).ok()?, u32::try_from(height).ok()?)?;
        if rgb.len() != width * height * 3 {
            return None;
        }
        for (to, from) in pixmap.data_mut().chunks_exact_mut(4).zip(rgb.chunks_exact(3)) {
            to.copy_from_slice(&[from[0], from[1], from[2], 255]);
        }
        Some(Self { pixmap })
    }

    /// A square part of the picture, resampled to this many pixels per side; black outside the
    /// picture. `None` if the part or the result has no pixels.
    pub fn part(&self, area: Area, pixels: usize) -> Option<Self> {
        let mut part = Self::plain(pixels, pixels, [0; 3])?;
        if !(area.w > 0.0 && area.h > 0.0) {
            return None;
        }
        let scale = pixels as f32 / area.w;
        let place = Transform::from_translate(-area.x, -area.y).post_scale(scale, scale);
        let paint = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
        part.pixmap.draw_pixmap(0, 0, self.pixmap.as_ref(), &paint, place, None);
        Some(part)
    }

    /// The picture as RGB bytes.
    pub fn to_rgb(&self) -> Vec<u8> {
        let rgba = self.pixmap.data();
        let mut rgb = vec![0; rgba.len() / 4 * 3];
        for (to, from) in rgb.chunks_exact_mut(3).zip(rgba.chunks_exact(4)) {
            to.copy_from_slice(&from[..3]);
        }
        rgb
    }

    /// The picture as bytes of red, green, blue and 255.
    pub fn rgba(&self) -> &[u8] {
        self.pixmap.data()
    }

    /// Writes the picture as PNG.
    pub fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let png = self.pixmap.encode_png().map_err(io::Error::other)?;
        out.write_all(&png)
    }

    /// Width in pixels.
    pub fn width(&self) -> f32 {
        self.pixmap.width() as f32
    }

    /// Height in pixels.
    pub fn height(&self) -> f32 {
        self.pixmap.height() as f32
    }

    /// Fills a rectangle; `opacity` 0 to 1.
    pub fn fill(&mut self, area: Area, colour: [u8; 3], opacity: f32) {
        if let Some(rect) = Rect::from_xywh(area.x, area.y, area.w, area.h) {
            self.pixmap.fill_rect(rect, &paint(colour, opacity), Transform::identity(), None);
        }
    }

    /// Fills a rectangle with round corners.
    pub fn fill_round(&mut self, area: Area, radius: f32, colour: [u8; 3], opacity: f32) {
        if let Some(path) = round_rectangle(area, radius) {
            let ink = paint(colour, opacity);
            self.pixmap.fill_path(&path, &ink, FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Draws a closed outline with a dark border, which keeps it visible on bright and on dark
    /// backgrounds.
    pub fn outline(&mut self, corners: &[[f32; 2]], line: Line) {
        let Some(path) = polygon(corners) else { return };
        let Line { width, colour, dashed } = line;
        let dashes = || StrokeDash::new(vec![4.0 + 3.0 * width, 3.0 + 2.0 * width], 0.0);
        let dash = if dashed { dashes() } else { None };
        for (width, colour, opacity) in [(width + 2.0, [0, 0, 0], 0.45), (width, colour, 1.0)] {
            let (line_join, dash) = (LineJoin::Round, dash.clone());
            let stroke = Stroke { width, line_join, dash, ..Stroke::default() };
            self.pixmap.stroke_path(
                &path,
                &paint(colour, opacity),
                &stroke,
                Transform::identity(),
                None,
            );
        }
    }

    /// Draws text that starts at `left`, with its capitals centred vertically at `middle`.
    pub fn text(&mut self, text: &str, left: f32, middle: f32, size: f32, colour: [u8; 3]) {
        super::text::draw(&mut self.pixmap, text, left, middle, size, colour);
    }

    /// Puts another picture on this one.
    pub fn paste(&mut self, other: &Canvas, left: usize, top: usize) {
        let place = Transform::identity();
        self.pixmap.draw_pixmap(
            left as i32,
            top as i32,
            other.pixmap.as_ref(),
            &PixmapPaint::default(),
            place,
            None,
        );
    }
}

fn opaque([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

fn paint([r, g, b]: [u8; 3], opacity: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (opacity.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

fn polygon(corners: &[[f32; 2]]) -> Option<Path> {
    let mut path = PathBuilder::new();
    let (first, rest) = corners.split_first()?;
    path.move_to(first[0], first[1]);
    rest.iter().for_each(|corner| path.line_to(corner[0], corner[1]));
    path.close();
    path.finish()
}

fn round_rectangle(area: Area, radius: f32) -> Option<Path> {
    let Area { x, y, w, h } = area;
    let r = radius.min(w / 2.0).min(h / 2.0);
    let mut path = PathBuilder::new();
    path.move_to(x + r, y);
    path.line_to(x + w - r, y);
    path.quad_to(x + w, y, x + w, y + r);
    path.line_to(x + w, y + h - r);
    path.quad_to(x + w, y + h, x + w - r, y + h);
    path.line_to(x + r, y + h);
    path.quad_to(x, y + h, x, y + h - r);
    path.line_to(x, y + r);
    path.quad_to(x, y, x + r, y);
    path.close();
    path.finish()
}
