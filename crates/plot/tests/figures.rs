//! Figures have the requested size, everything lies within them, and all formats show the same.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)]

use afbc_plot::{FigureFormat, FigurePanel, LogColumns, PanelLine, PaperFigure};
use roxmltree::Document;
use std::fs;
use std::path::{Path, PathBuf};
use tiny_skia::Pixmap;

const RED: [u8; 3] = [0xD0, 0x10, 0x20];

fn sine(label: &str, color: [u8; 3], phase: f64) -> PanelLine {
    let points: Vec<(f64, f64)> =
        (0..=600).map(|i| (f64::from(i) / 10.0, (f64::from(i) / 60.0 + phase).sin())).collect();
    let band = points.iter().map(|(x, y)| (*x, [y - 0.2, y + 0.2])).collect();
    PanelLine { label: label.into(), color, dash: 0, lines: vec![points], band }
}

fn figure(width_mm: f64, panels: usize) -> PaperFigure {
    let panel = |index: usize| FigurePanel {
        y_title: format!("x{index} & y [m]"),
        lines: vec![sine("afbc", RED, 0.0), sine("<pid>", [0, 0, 0xC0], 1.5 + index as f64)],
    };
    PaperFigure {
        width_mm,
        panel_mm: 30.0,
        font_pt: 8.0,
        line_pt: 0.9,
        title: "a & b".into(),
        x_title: "time [s]".into(),
        x_range: None,
        is_logarithmic: false,
        panels: (0..panels).map(panel).collect(),
    }
}

fn svg(figure: &PaperFigure) -> String {
    String::from_utf8(figure.write(FigureFormat::Svg).unwrap()).unwrap()
}

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("figures");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Returns the value of a numeric attribute.
fn number(node: roxmltree::Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).unwrap().trim_end_matches("pt").parse().unwrap()
}

#[test]
fn everything_lies_within_the_width_asked_for() {
    for (width_mm, panels) in [(88.0, 1), (60.0, 3), (181.0, 2)] {
        let text = svg(&figure(width_mm, panels));
        let document = Document::parse(&text).unwrap();
        let root = document.root_element();
        let (width, height) = (number(root, "width"), number(root, "height"));
        assert!((width * 25.4 / 72.0 - width_mm).abs() < 0.01);
        assert!(height * 25.4 / 72.0 > 30.0 * panels as f64);
        let inside = |x: f64, y: f64| (0.0..=width).contains(&x) && (0.0..=height).contains(&y);
        let (mut lines, mut letters) = (0, 0);
        for node in document.descendants().filter(roxmltree::Node::is_element) {
            if let Some(points) = node.attribute("points") {
                for point in points.split(' ') {
                    let (x, y) = point.split_once(',').unwrap();
                    assert!(inside(x.parse().unwrap(), y.parse().unwrap()), "{point}");
                }
                lines += usize::from(node.attribute("clip-path").is_some() && node.tag_name().name() == "polyline");
            }
            if node.tag_name().name() == "text" {
                assert!(inside(number(node, "x"), number(node, "y")));
                letters += 1;
            }
        }
        assert_eq!(lines, 2 * panels);
        assert!(letters > 5 * panels);
        assert!(document.descendants().any(|node| node.text() == Some("<pid>")));
    }
}

/// Constants, values that nearly are constant, and narrow time ranges: each axis has at least two labels, all within
/// the figure.
#[test]
fn every_axis_has_ticks_within_the_figure() {
    for (value, width_mm, [from, to]) in
        [(0.0, 88.0, [0.0, 10.0]), (12.6, 40.0, [3.0, 3.00001]), (-3e-7, 40.0, [0.9, 3.1]), (2e6, 60.0, [1e4, 1.9e4])]
    {
        let lines = vec![vec![(from, value), (to, value)]];
        let constant = PanelLine { lines, band: Vec::new(), ..sine("constant", RED, 0.0) };
        for is_logarithmic in [false, true].into_iter().filter(|is_logarithmic| !is_logarithmic || value > 0.0) {
            let panels = vec![FigurePanel { y_title: "value".into(), lines: vec![constant.clone()] }];
            let text = svg(&PaperFigure { panels, is_logarithmic, ..figure(width_mm, 1) });
            let document = Document::parse(&text).unwrap();
            let width = number(document.root_element(), "width");
            let labels = |anchor: &str| -> Vec<_> {
                let texts = document.descendants().filter(|node| node.tag_name().name() == "text");
                let upright = texts.filter(|node| node.attribute("transform").is_none());
                upright.filter(|node| node.attribute("text-anchor") == Some(anchor)).collect()
            };
            assert!(labels("end").len() >= 2, "{value}: {text}");
            // One of the centred texts is the axis title.
            assert!(labels("middle").len() >= 3, "{from} to {to}: {text}");
            for label in labels("middle") {
                let half = 0.29 * number(label, "font-size") * label.text().unwrap().chars().count() as f64;
                assert!(number(label, "x") + half <= width, "{:?}", label.text());
            }
        }
    }
}

/// The line's maximum lies at the top of the panel, and a quarter of the range lies a quarter of the way up.
#[test]
fn values_lie_where_the_axis_says() {
    let points = vec![(0.0, 0.0), (5.0, 1.0), (10.0, 0.25)];
    let line = PanelLine { label: "a".into(), color: RED, dash: 1, lines: vec![points], band: Vec::new() };
    let panels = vec![FigurePanel { y_title: "y".into(), lines: vec![line] }];
    let text = svg(&PaperFigure { panels, ..figure(88.0, 0) });
    let document = Document::parse(&text).unwrap();
    let drawn = document.descendants().find(|node| node.attribute("stroke-dasharray").is_some()).unwrap();
    let places: Vec<[f64; 2]> = drawn
        .attribute("points")
        .unwrap()
        .split(' ')
        .map(|point| point.split_once(',').unwrap())
        .map(|(x, y)| [x.parse().unwrap(), y.parse().unwrap()])
        .collect();
    let [first, top, last] = places.try_into().unwrap();
    assert!((top[0] - 0.5 * (first[0] + last[0])).abs() < 0.02);
    let share = (first[1] - last[1]) / (first[1] - top[1]);
    assert!((share - 0.25).abs() < 1e-3, "{share}");
    // The axis has a margin of 5 % on both sides, and the panel is 30 mm high.
    let height = (first[1] - top[1]) * 1.1;
    assert!((height * 25.4 / 72.0 - 30.0).abs() < 0.02, "{height}");
}

#[test]
fn a_pdf_has_its_size_and_no_fonts_to_embed() {
    let bytes = figure(88.0, 2).write(FigureFormat::Pdf).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    assert!(text.starts_with("%PDF-1.") && text.trim_end().ends_with("%%EOF"));
    let page = text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap();
    let ends: Vec<f64> = page.split_whitespace().map(|end| end.parse().unwrap()).collect();
    assert!((ends[2] * 25.4 / 72.0 - 88.0).abs() < 0.01, "{page}");
    assert!(!text.contains("/Font"));
    // Each object is at the offset that the cross-reference table says.
    let table = text.rsplit("xref\n").nth(1).unwrap();
    let places = table.lines().filter(|line| line.ends_with(" n") || line.ends_with(" n "));
    let objects = places.map(|line| line.split(' ').next().unwrap().parse::<usize>().unwrap());
    let mut found = 0;
    for (index, place) in objects.enumerate() {
        let head = format!("{} 0 obj", index + 1);
        assert!(bytes[place..].starts_with(head.as_bytes()), "{head}");
        found += 1;
    }
    assert_eq!(found, 5);
    assert_eq!(figure(88.0, 2).write(FigureFormat::Pdf).unwrap(), bytes);
}

#[test]
fn a_png_has_its_pixels_and_shows_the_line() {
    let bytes = figure(88.0, 1).write(FigureFormat::Png { dpi: 300.0 }).unwrap();
    let pixels = Pixmap::decode_png(&bytes).unwrap();
    assert_eq!(pixels.width(), 1039);
    let share = |is: &dyn Fn([u8; 3]) -> bool| {
        let all = pixels.pixels();
        let seen = all.iter().filter(|pixel| is([pixel.red(), pixel.green(), pixel.blue()])).count();
        seen as f64 / all.len() as f64
    };
    let red = share(&|pixel| pixel == RED);
    assert!((0.002..0.05).contains(&red), "{red}");
    assert!(share(&|pixel| pixel == [255; 3]) > 0.4, "paper");
    // The band has a fifth of the line's colour on white.
    let band = RED.map(|part| (255.0 + 0.2 * (f64::from(part) - 255.0)).round());
    let near = |pixel: [u8; 3]| pixel.iter().zip(band).all(|(part, band)| (f64::from(*part) - band).abs() < 3.0);
    assert!(share(&near) > 0.02);
    let large = figure(2000.0, 1).write(FigureFormat::Png { dpi: 2400.0 }).unwrap_err();
    assert!(large.contains("too many"), "{large}");
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let empty = PaperFigure { panels: Vec::new(), ..figure(88.0, 0) };
    assert_eq!(empty.write(FigureFormat::Svg).unwrap_err(), "there are no numbers to draw");
    let narrow = figure(5.0, 1).write(FigureFormat::Svg).unwrap_err();
    assert!(narrow.contains("--width"), "{narrow}");
    let beyond = PaperFigure { x_range: Some([100.0, 200.0]), ..figure(88.0, 1) };
    assert!(beyond.write(FigureFormat::Svg).unwrap_err().contains("no numbers"));
    let mut negative = PaperFigure { is_logarithmic: true, ..figure(88.0, 1) };
    negative.panels[0].lines.iter_mut().for_each(|line| {
        line.band.clear();
        line.lines.iter_mut().flatten().for_each(|(_, y)| *y = -1.0);
    });
    assert!(negative.write(FigureFormat::Svg).unwrap_err().contains("positive"));
}

/// Semicolons with decimal commas, as spreadsheets write them in some countries, and tabs.
#[test]
fn a_log_may_be_separated_otherwise() {
    let folder = folder();
    let read = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        LogColumns::read(&path).unwrap().points("time_s", "x_m").unwrap()
    };
    let expected = read("commas.csv", "time_s,x_m,y_m\n0,1.5,2\n0.25,-3e-1,2\n");
    assert_eq!(expected[&None], [(0.0, 1.5), (0.25, -0.3)]);
    assert_eq!(read("semicolons.csv", "time_s;x_m;y_m\n0;1,5;2\n0,25;-3e-1;2\n"), expected);
    assert_eq!(read("dots.csv", "time_s;x_m;y_m\n0;1.5;2\n0.25;-3e-1;2\n"), expected);
    assert_eq!(read("tabs.csv", "time_s\tx_m\ty_m\n0\t1.5\t2\n0.25\t-0.3\t2\n"), expected);
}

#[test]
fn columns_are_found_by_name_or_refused_in_one_line() {
    let folder = folder();
    let path = folder.join("log.csv");
    fs::write(&path, "time_s,x_m,contender\n0,1,a\n1,2,b\n2,,a\n3,4,a\n").unwrap();
    let log = LogColumns::read(&path).unwrap();
    assert_eq!(log.names(), ["time_s", "x_m"]);
    assert_eq!(log.usual_x("x_m").unwrap(), "time_s");
    let points = log.points("time_s", "x_m").unwrap();
    assert_eq!(points[&Some("a".into())], [(0.0, 1.0), (3.0, 4.0)]);
    assert_eq!(points[&Some("b".into())], [(1.0, 2.0)]);
    let error = log.points("time_s", "xm").unwrap_err().to_string();
    assert!(error.ends_with("no column xm; did you mean x_m?"), "{error}");
    for (text, expected) in [
        ("a,b\n", "has no rows of numbers"),
        ("a,b\n1,2\n3\n", "line 3: this is not a CSV file"),
        ("PAR1nothing", "cannot be read as Parquet"),
        ("ULog\u{1}", "not"),
        ("", "has no rows"),
    ] {
        fs::write(&path, text).unwrap();
        let error = LogColumns::read(&path).unwrap_err().to_string();
        assert!(error.contains(expected) && error.lines().count() == 1, "{text:?}: {error}");
    }
    let mcap = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n', 1, 2, 3];
    fs::write(&path, mcap).unwrap();
    let error = LogColumns::read(&path).unwrap_err().to_string();
    assert!(error.contains("ends within a record") && error.lines().count() == 1, "{error}");
    assert!(LogColumns::read(&folder.join("nothing")).unwrap_err().to_string().contains("cannot be read"));
}
