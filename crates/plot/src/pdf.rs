//! Writes a figure as PDF: vector graphics without embedded fonts.

use crate::font::{OutlineSegment, outlines};
use afbc_drawing::{Drawing, Rgb, Shape};
use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};

/// Writes a figure on a page of the figure's size.
pub(crate) fn pdf(drawing: &Drawing, title: &str) -> Vec<u8> {
    let [catalog, pages, page, contents, info] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut opacities: Vec<f64> = Vec::new();
    let mut content = Content::new();
    // In PDF, y points up.
    content.transform([1.0, 0.0, 0.0, -1.0, 0.0, drawing.height as f32]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    for shape in &drawing.shapes {
        draw(&mut content, shape, &mut opacities);
    }
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let mut own = pdf.page(page);
    own.media_box(Rect::new(0.0, 0.0, drawing.width as f32, drawing.height as f32));
    own.parent(pages).contents(contents);
    let mut resources = own.resources();
    let mut states = resources.ext_g_states();
    for (index, opacity) in opacities.iter().enumerate() {
        states
            .insert(Name(format!("O{index}").as_bytes()))
            .start::<pdf_writer::writers::ExtGraphicsState<'_>>()
            .stroking_alpha(*opacity as f32)
            .non_stroking_alpha(*opacity as f32);
    }
    states.finish();
    resources.finish();
    own.finish();
    // Level 6 is zlib's default.
    let compressed = compress_to_vec_zlib(&content.finish(), 6);
    pdf.stream(contents, &compressed).filter(Filter::FlateDecode);
    pdf.document_info(info).title(TextStr(title)).creator(TextStr("sitl plot"));
    pdf.finish()
}

fn draw(content: &mut Content, shape: &Shape, opacities: &mut Vec<f64>) {
    // PDF can only remove a clip by restoring a saved state.
    content.save_state();
    match shape {
        Shape::Line { points, stroke, within } => {
            clip(content, within);
            veil(content, stroke.opacity, opacities);
            let [r, g, b] = color(stroke.color);
            content.set_stroke_rgb(r, g, b).set_line_width(stroke.width as f32);
            content.set_dash_pattern(stroke.dashes.iter().map(|length| *length as f32), 0.0);
            path(content, points);
            content.stroke();
        }
        Shape::Area { points, color: rgb, opacity, within } => {
            clip(content, within);
            let [r, g, b] = color(*rgb);
            veil(content, *opacity, opacities);
            content.set_fill_rgb(r, g, b);
            path(content, points);
            content.close_path().fill_nonzero();
        }
        // The font has no bold variant.
        Shape::Text { text, place, size, anchor, color: rgb, upwards, is_bold: _ } => {
            let [r, g, b] = color(*rgb);
            content.set_fill_rgb(r, g, b);
            for stretch in outlines(text, *place, *size, *anchor, *upwards) {
                match stretch {
                    OutlineSegment::Move((x, y)) => content.move_to(x as f32, y as f32),
                    OutlineSegment::Line((x, y)) => content.line_to(x as f32, y as f32),
                    OutlineSegment::Curve(a, b, end) => {
                        content.cubic_to(a.0 as f32, a.1 as f32, b.0 as f32, b.1 as f32, end.0 as f32, end.1 as f32)
                    }
                    OutlineSegment::Close => content.close_path(),
                };
            }
            content.fill_nonzero();
        }
    }
    content.restore_state();
}

/// Sets the opacity of the shapes that are drawn next.
fn veil(content: &mut Content, opacity: f64, opacities: &mut Vec<f64>) {
    if opacity < 1.0 {
        let place = opacities.iter().position(|other| *other == opacity).unwrap_or_else(|| {
            opacities.push(opacity);
            opacities.len() - 1
        });
        content.set_parameters(Name(format!("O{place}").as_bytes()));
    }
}

fn clip(content: &mut Content, within: &Option<[f64; 4]>) {
    if let Some([left, top, right, bottom]) = within {
        content.rect(*left as f32, *top as f32, (right - left) as f32, (bottom - top) as f32).clip_nonzero().end_path();
    }
}

fn path(content: &mut Content, points: &[(f64, f64)]) {
    for (index, (x, y)) in points.iter().enumerate() {
        let (x, y) = (*x as f32, *y as f32);
        if index == 0 {
            content.move_to(x, y)
        } else {
            content.line_to(x, y)
        };
    }
}

fn color(rgb: Rgb) -> [f32; 3] {
    rgb.map(|part| f32::from(part) / 255.0)
}
