//! A figure as SVG, its text as text.

use crate::shape::{Drawing, Rgb, Shape, TextAnchor};
use core::fmt::Write;

/// Writes a figure; `title` is for those who do not see it.
pub(crate) fn svg(drawing: &Drawing, title: &str) -> String {
    let Drawing { width_pt, height_pt, shapes } = drawing;
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_pt:.3}pt\" height=\"{height_pt:.3}pt\" \
         viewBox=\"0 0 {width_pt:.3} {height_pt:.3}\" role=\"img\" fill=\"none\" stroke-linejoin=\"round\" \
         font-family=\"DejaVu Sans, Verdana, sans-serif\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>",
        escaped(title)
    );
    // Before all else, since shapes refer to their clip by its number.
    let mut boxes: Vec<[f64; 4]> = Vec::new();
    for shape in shapes {
        if let Shape::Line { within: Some(within), .. } | Shape::Area { within: Some(within), .. } = shape
            && !boxes.contains(within)
        {
            let [left, top, right, bottom] = within;
            let (width, height) = (right - left, bottom - top);
            let _ = writeln!(
                svg,
                "<clipPath id=\"panel{}\"><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" \
                 height=\"{height:.2}\"/></clipPath>",
                boxes.len()
            );
            boxes.push(*within);
        }
    }
    for shape in shapes {
        let _ = writeln!(svg, "{}", element(shape, &boxes));
    }
    svg + "</svg>\n"
}

fn element(shape: &Shape, boxes: &[[f64; 4]]) -> String {
    let clip = |within: &Option<[f64; 4]>| {
        let place = within.and_then(|within| boxes.iter().position(|other| *other == within));
        place.map_or(String::new(), |place| format!(" clip-path=\"url(#panel{place})\""))
    };
    let path = |points: &[(f64, f64)]| points.iter().map(|(x, y)| format!("{x:.2},{y:.2} ")).collect::<String>();
    match shape {
        Shape::Line { points, stroke, within } => {
            let dashes: Vec<String> = stroke.dashes.iter().map(f64::to_string).collect();
            let dashes =
                if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{}\"", dashes.join(" ")) };
            format!(
                "<polyline points=\"{}\" stroke=\"{}\" stroke-width=\"{}\"{dashes}{}/>",
                path(points).trim_end(),
                hex(stroke.color),
                stroke.width_pt,
                clip(within)
            )
        }
        Shape::Area { points, color, opacity, within } => format!(
            "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"{opacity}\"{}/>",
            path(points).trim_end(),
            hex(*color),
            clip(within)
        ),
        Shape::Text { text, place: (x, y), size_pt, anchor, color, upwards } => {
            let anchor = match anchor {
                TextAnchor::Start => "start",
                TextAnchor::Middle => "middle",
                TextAnchor::End => "end",
            };
            let turned = if *upwards { format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"") } else { String::new() };
            format!(
                "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size_pt}\" text-anchor=\"{anchor}\" \
                 fill=\"{}\"{turned}>{}</text>",
                hex(*color),
                escaped(text)
            )
        }
    }
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
