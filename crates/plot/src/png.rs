//! Writes a figure as PNG.

use crate::font::{OutlineSegment, outlines};
use afbc_drawing::{Drawing, Point, Shape};
use tiny_skia::{Color, FillRule, LineJoin, Mask, Paint, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform};

/// Points per inch.
const POINTS: f64 = 72.0;
/// Largest number of pixels along one side.
const LONGEST_PX: f64 = 20_000.0;

/// Draws a figure at `dpi` pixels per inch.
pub(crate) fn png(drawing: &Drawing, dpi: f64) -> Result<Vec<u8>, String> {
    let scale = dpi / POINTS;
    let [width, height] = [drawing.width, drawing.height].map(|length| (length * scale).round().max(1.0));
    if width.max(height) > LONGEST_PX {
        return Err(format!("{width} by {height} pixels are too many; choose a smaller --width or --dpi"));
    }
    let mut pixels = Pixmap::new(width as u32, height as u32).ok_or("the picture has no size")?;
    pixels.fill(Color::WHITE);
    let transform = Transform::from_scale(scale as f32, scale as f32);
    for shape in &drawing.shapes {
        draw(&mut pixels, shape, transform);
    }
    pixels.encode_png().map_err(|error| error.to_string())
}

fn draw(pixels: &mut Pixmap, shape: &Shape, transform: Transform) {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    match shape {
        Shape::Line { points, stroke, within } => {
            let [r, g, b] = stroke.color;
            paint.set_color_rgba8(r, g, b, (255.0 * stroke.opacity).round() as u8);
            let mask = mask(pixels, within, transform);
            let dash = StrokeDash::new(stroke.dashes.iter().map(|length| *length as f32).collect(), 0.0);
            let stroke = Stroke { width: stroke.width as f32, line_join: LineJoin::Round, dash, ..Stroke::default() };
            if let Some(path) = path(points, false).finish() {
                pixels.stroke_path(&path, &paint, &stroke, transform, mask.as_ref());
            }
        }
        Shape::Area { points, color: [r, g, b], opacity, within } => {
            paint.set_color_rgba8(*r, *g, *b, (255.0 * opacity).round() as u8);
            let mask = mask(pixels, within, transform);
            if let Some(path) = path(points, true).finish() {
                pixels.fill_path(&path, &paint, FillRule::Winding, transform, mask.as_ref());
            }
        }
        // The font has no bold variant.
        Shape::Text { text, place, size, anchor, color: [r, g, b], upwards, is_bold: _ } => {
            paint.set_color_rgba8(*r, *g, *b, 255);
            let mut path = PathBuilder::new();
            for stretch in outlines(text, *place, *size, *anchor, *upwards) {
                match stretch {
                    OutlineSegment::Move((x, y)) => path.move_to(x as f32, y as f32),
                    OutlineSegment::Line((x, y)) => path.line_to(x as f32, y as f32),
                    OutlineSegment::Curve(a, b, end) => {
                        path.cubic_to(a.0 as f32, a.1 as f32, b.0 as f32, b.1 as f32, end.0 as f32, end.1 as f32);
                    }
                    OutlineSegment::Close => path.close(),
                }
            }
            if let Some(path) = path.finish() {
                pixels.fill_path(&path, &paint, FillRule::Winding, transform, None);
            }
        }
    }
}

fn path(points: &[Point], closed: bool) -> PathBuilder {
    let mut path = PathBuilder::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let (x, y) = (*x as f32, *y as f32);
        if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path
}

/// Returns a clip mask for a box.
fn mask(pixels: &Pixmap, within: &Option<[f64; 4]>, transform: Transform) -> Option<Mask> {
    let [left, top, right, bottom] = within.as_ref()?.map(|end| end as f32);
    let mut mask = Mask::new(pixels.width(), pixels.height())?;
    let path = PathBuilder::from_rect(Rect::from_ltrb(left, top, right, bottom)?);
    mask.fill_path(&path, FillRule::Winding, true, transform);
    Some(mask)
}
