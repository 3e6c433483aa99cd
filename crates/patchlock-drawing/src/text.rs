//! Draws text on pictures with an embedded font.

use ab_glyph::{Font, FontRef, Glyph, ScaleFont, point};
use epaint_default_fonts::HACK_REGULAR as FONT;
use tiny_skia::{ColorU8, Pixmap};

/// The font; `None` if its data is invalid, which a test rules out.
fn font() -> Option<FontRef<'static>> {
    FontRef::try_from_slice(FONT).ok()
}

/// Width of a text in pixels.
pub fn width(text: &str, size: f32) -> f32 {
    let Some(font) = font() else { return 0.0 };
    let font = font.as_scaled(size);
    text.chars().map(|c| font.h_advance(font.glyph_id(c))).sum()
}

/// Draws text that starts at `left`, with its capitals centred vertically at `middle`.
pub fn draw(pixmap: &mut Pixmap, text: &str, left: f32, middle: f32, size: f32, colour: [u8; 3]) {
    let Some(font) = font() else { return };
    let scaled = font.as_scaled(size);
    let baseline = middle + size * 0.29; // capitals of this font are 0.58 of its size high
    let mut x = left;
    for c in text.chars() {
        let id = scaled.glyph_id(c);
        let glyph: Glyph = id.with_scale_and_position(size, point(x, baseline));
        x += scaled.h_advance(id);
        if let Some(outline) = font.outline_glyph(glyph) {
            let bounds = outline.px_bounds();
            outline.draw(|dx, dy, coverage| {
                blend(
                    pixmap,
                    bounds.min.x as i64 + i64::from(dx),
                    bounds.min.y as i64 + i64::from(dy),
                    coverage,
                    colour,
                );
            });
        }
    }
}

fn blend(pixmap: &mut Pixmap, x: i64, y: i64, coverage: f32, colour: [u8; 3]) {
    let (width, height) = (i64::from(pixmap.width()), i64::from(pixmap.height()));
    if x < 0 || y < 0 || x >= width || y >= height {
        return;
    }
    let at = (y * width + x) as usize;
    let under = pixmap.pixels()[at].demultiply();
    let share = coverage.clamp(0.0, 1.0);
    let mix = |over: u8, under: u8| {
        (f32::from(over) * share + f32::from(under) * (1.0 - share)).round() as u8
    };
    let [r, g, b] = colour;
    let mixed =
        ColorU8::from_rgba(mix(r, under.red()), mix(g, under.green()), mix(b, under.blue()), 255);
    pixmap.pixels_mut()[at] = mixed.premultiply();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_is_valid_and_draws() {
        assert!(width("score", 16.0) > 30.0);
        let mut pixmap = Pixmap::new(60, 20).expect("a size");
        draw(&mut pixmap, "Ag0", 2.0, 10.0, 16.0, [255, 255, 255]);
        assert!(pixmap.pixels().iter().filter(|p| p.red() > 128).count() > 40);
        draw(&mut pixmap, "out", -500.0, 900.0, 16.0, [255, 255, 255]);
    }
}
