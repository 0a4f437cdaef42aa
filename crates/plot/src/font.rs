//! Widths and outlines of the font's glyphs.

use afbc_drawing::{Point, TextAnchor, parts};
use ttf_parser::{Face, OutlineBuilder};

/// Latin, Greek and mathematical characters of DejaVu Sans 2.37. The licence is in the same folder.
const BYTES: &[u8] = include_bytes!("../font/DejaVuSans-subset.ttf");

/// One segment of an outline \[pt\]; y points down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum OutlineSegment {
    Move(Point),
    Line(Point),
    /// A cubic Bézier curve: two control points and the end.
    Curve(Point, Point, Point),
    Close,
}

/// Returns the font, or `None` if it is damaged; a test makes sure that it is not.
fn face() -> Option<Face<'static>> {
    Face::parse(BYTES, 0).ok()
}

/// Size of a subscript, and distance of its base line below the text's base line; both relative to the font size.
const LOWERED: f64 = 0.75;
const DOWN: f64 = 0.225;

/// Returns the width of a text \[pt\].
pub(crate) fn width_pt(text: &str, size_pt: f64) -> f64 {
    let Some(face) = face() else { return 0.0 };
    let advance = |c: char| face.glyph_index(c).and_then(|glyph| face.glyph_hor_advance(glyph)).unwrap_or_default();
    let width = |(words, is_lowered): (&str, bool)| {
        words.chars().map(|c| f64::from(advance(c))).sum::<f64>() * if is_lowered { LOWERED } else { 1.0 }
    };
    parts(text).into_iter().map(width).sum::<f64>() * size_pt / f64::from(face.units_per_em())
}

/// Returns the outlines of a text whose base line goes through the given point.
pub(crate) fn outlines(
    text: &str,
    (x, y): Point,
    size_pt: f64,
    anchor: TextAnchor,
    upwards: bool,
) -> Vec<OutlineSegment> {
    let Some(face) = face() else { return Vec::new() };
    let full = size_pt / f64::from(face.units_per_em());
    let along = match anchor {
        TextAnchor::Start => 0.0,
        TextAnchor::Middle => -0.5 * width_pt(text, size_pt),
        TextAnchor::End => -width_pt(text, size_pt),
    };
    let mut pen = GlyphPen { x, y, upwards, along, down: 0.0, scale: full, last: (0.0, 0.0), stretches: Vec::new() };
    for (words, is_lowered) in parts(text) {
        (pen.scale, pen.down) = if is_lowered { (LOWERED * full, DOWN * size_pt) } else { (full, 0.0) };
        for c in words.chars() {
            if let Some(glyph) = face.glyph_index(c) {
                // A space has no outline.
                let _ = face.outline_glyph(glyph, &mut pen);
                pen.along += pen.scale * f64::from(face.glyph_hor_advance(glyph).unwrap_or_default());
            }
        }
    }
    pen.stretches
}

/// Transforms glyph outlines from font units to their position in the drawing.
struct GlyphPen {
    x: f64,
    y: f64,
    upwards: bool,
    /// Start of the glyph along the text \[pt\].
    along: f64,
    /// Distance of the glyph's base line below the text's base line \[pt\].
    down: f64,
    scale: f64,
    /// Last point, in font units.
    last: (f32, f32),
    stretches: Vec<OutlineSegment>,
}

impl GlyphPen {
    fn place(&self, x: f32, y: f32) -> Point {
        let (along, up) = (self.along + self.scale * f64::from(x), self.scale * f64::from(y) - self.down);
        if self.upwards { (self.x - up, self.y - along) } else { (self.x + along, self.y - up) }
    }
}

impl OutlineBuilder for GlyphPen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.last = (x, y);
        self.stretches.push(OutlineSegment::Move(self.place(x, y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.last = (x, y);
        self.stretches.push(OutlineSegment::Line(self.place(x, y)));
    }

    /// Converts a quadratic curve to the equal cubic one: both its control points lie two thirds of the way from an end
    /// to the quadratic control point.
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (x0, y0) = self.last;
        let towards = |from: f32, to: f32| from + 2.0 / 3.0 * (to - from);
        self.curve_to(towards(x0, x1), towards(y0, y1), towards(x, x1), towards(y, y1), x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.last = (x, y);
        self.stretches.push(OutlineSegment::Curve(self.place(x1, y1), self.place(x2, y2), self.place(x, y)));
    }

    fn close(&mut self) {
        self.stretches.push(OutlineSegment::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_every_character_of_titles_and_ticks() {
        let face = face();
        for c in "aZ09 [m/s²] µΔψ₁₀ −0.5·10⁻⁰¹²³⁴⁵⁶⁷⁸⁹ ±∞ %°".chars() {
            assert!(face.as_ref().is_some_and(|face| face.glyph_index(c).is_some()), "{c}");
        }
        assert!((width_pt("mm", 10.0) - 2.0 * width_pt("m", 10.0)).abs() < 1e-9);
        assert!((width_pt("10.0", 16.0) - 2.0 * width_pt("10.0", 8.0)).abs() < 1e-9);
    }

    #[test]
    fn what_is_lowered_is_smaller_and_below() {
        assert!((width_pt("x⟨mm⟩", 8.0) - width_pt("x", 8.0) - width_pt("mm", 6.0)).abs() < 1e-9);
        let lowest = |text: &str| {
            let stretches = outlines(text, (0.0, 0.0), 8.0, TextAnchor::Start, false);
            stretches.iter().fold(f64::NEG_INFINITY, |lowest, stretch| match stretch {
                OutlineSegment::Move((_, y)) | OutlineSegment::Line((_, y)) | OutlineSegment::Curve(_, _, (_, y)) => {
                    lowest.max(*y)
                }
                OutlineSegment::Close => lowest,
            })
        };
        assert!((lowest("H⟨H⟩") - lowest("H") - DOWN * 8.0).abs() < 1e-6);
    }

    /// Texts lie where their anchor says, both horizontal and rotated.
    #[test]
    fn outlines_lie_at_their_anchor() {
        for (anchor, from) in [(TextAnchor::Start, 0.0), (TextAnchor::Middle, -0.5), (TextAnchor::End, -1.0)] {
            for upwards in [false, true] {
                let stretches = outlines("HH", (100.0, 50.0), 10.0, anchor, upwards);
                let width = width_pt("HH", 10.0);
                for stretch in &stretches {
                    let (OutlineSegment::Move((x, y)) | OutlineSegment::Line((x, y))) = stretch else { continue };
                    let (along, up) = if upwards { (50.0 - y, 100.0 - x) } else { (x - 100.0, 50.0 - y) };
                    assert!((from * width..=(from + 1.0) * width).contains(&along), "{along}");
                    assert!((0.0..=8.0).contains(&up), "{up}");
                }
                assert_eq!(stretches.iter().filter(|stretch| **stretch == OutlineSegment::Close).count(), 2);
            }
        }
    }
}
