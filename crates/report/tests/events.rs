//! Events in figures: overlapping events can be told apart.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

mod common;

use afbc_plant::{Environment, PlantParameter, PlantParameterChange};
use afbc_report::flights;
use common::{boxes, eventful, flown, folder, labels, number, open, svgs};
use roxmltree::{Document, Node};
use std::collections::BTreeSet;

#[test]
fn events_that_overlap_are_distinguished_and_each_has_its_label() {
    let out = folder("events");
    flights::write(&open(&out), &flown(&eventful(), &["afbc"]), &[]).unwrap();
    // Each shaded event has a label, a start and an end [s].
    let bands = [
        ("mass +10 %", 1.0, 8.0),
        ("inertia −10 %", 2.0, 9.0),
        ("thrust factor −2 %", 3.0, 4.0),
        ("+0.02 kg", 3.5, 12.0),
        ("rotor 2 at 98 %", 5.0, 12.0),
        ("no state", 4.0, 4.05),
        ("no state", 6.0, 6.05),
        ("Fx", 2.5, 3.5),
        ("wind (0.5, −0.5, 0) m/s", 5.0, 8.0),
        ("wind (0.125, −0.5, 0) m/s", 6.5, 7.5),
    ];
    // Permanent events are marked at their onset.
    let onsets = ["Fy", "wind (0.25, −0.5, 0) m/s"];
    for (name, svg) in svgs(&out).iter().filter(|(name, _)| !name.contains("fig4")) {
        let svg = Document::parse(svg).unwrap();
        let labels = labels(&svg);
        for label in onsets {
            assert_eq!(labels.iter().filter(|(text, ..)| text == label).count(), 1, "{name}: {label}");
        }
        // The plot's scale, read from its time axis.
        let tick = |text: &str| {
            let ticks = labels.iter().filter(|(label, ..)| label == text);
            ticks.max_by(|a, b| a.2.total_cmp(&b.2)).unwrap().1
        };
        let x = |t: f64| tick("0") + (tick("10") - tick("0")) * t / 10.0;
        let (areas, rects): (Vec<_>, Vec<[f64; 4]>) = boxes(&svg).into_iter().unzip();
        let fills: Vec<&str> = areas.iter().map(|area| area.attribute("fill").unwrap()).collect();
        let mut strips: Vec<[f64; 4]> = Vec::new();
        for (label, start_s, end_s) in bands {
            let from_to =
                |rect: &[f64; 4]| (rect[0] - x(start_s)).abs() < 3.0 && (rect[0] + rect[2] - x(end_s)).abs() < 4.0;
            let (index, strip) = rects
                .iter()
                .enumerate()
                .find(|(_, rect)| from_to(rect) && rect[3] < 80.0)
                .unwrap_or_else(|| panic!("{name}: no band of {label} from {start_s} s"));
            // The label is in the band's row, on the band or next to it.
            let beside = |(text, at_x, at_y): &&(String, f64, f64)| {
                text == label && strip[1] < *at_y && *at_y < strip[1] + strip[3] && (at_x - strip[0]).abs() < 2000.0
            };
            assert!(labels.iter().any(|label| beside(&label)), "{name}: {label}");
            // Every panel is shaded in the same tint.
            let shaded = rects
                .iter()
                .zip(&fills)
                .filter(|(rect, fill)| from_to(rect) && rect[3] > 80.0 && **fill == fills[index]);
            let panels = if name.contains("fig6") { 2 } else { 4 };
            assert_eq!(shaded.count(), panels, "{name}: {label}");
            strips.push(*strip);
        }
        // No two bands overlap.
        for (i, [x, y, width, _]) in strips.iter().enumerate() {
            for (other, [other_x, other_y, other_width, _]) in strips[..i].iter().enumerate() {
                let apart = x + width <= *other_x || other_x + other_width <= *x || y != other_y;
                assert!(apart, "{name}: {} on {}", bands[i].0, bands[other].0);
            }
        }
    }
}

#[test]
fn two_of_the_same_that_overlap_are_distinguished() {
    let mut two = eventful();
    two.environment = Environment::new(
        two.vehicle,
        vec![
            PlantParameterChange { quantity: PlantParameter::Mass, factor: 1.1, start_s: 1.0, end_s: 8.0 },
            PlantParameterChange { quantity: PlantParameter::Mass, factor: 1.1, start_s: 2.0, end_s: 9.0 },
        ],
        Vec::new(),
    )
    .unwrap();
    two.outages.clear();
    two.realism.rotors.faults.clear();
    two.realism.wind.gusts.clear();
    let out = folder("two-events");
    flights::write(&open(&out), &flown(&two, &["afbc"]), &[]).unwrap();
    for (name, svg) in &svgs(&out) {
        let svg = Document::parse(svg).unwrap();
        // Bands lie on the time axis. Wide lines follow the reference, one wider than the other.
        let is_band = |node: &Node<'_, '_>| node.has_tag_name("polyline") && number(*node, "stroke-width") > 30.0;
        let boxes = boxes(&svg);
        let rows = boxes.iter().filter(|(_, [.., height])| *height < 80.0).filter_map(|(row, _)| row.attribute("fill"));
        let bands = svg.descendants().filter(is_band);
        if name.contains("fig4") {
            let widths: BTreeSet<_> = bands.clone().filter_map(|band| band.attribute("stroke-width")).collect();
            assert_eq!(widths.len(), 2, "{name}");
        }
        let tints: BTreeSet<_> = rows.chain(bands.filter_map(|band| band.attribute("stroke"))).collect();
        assert_eq!(tints.len(), 2, "{name}: {tints:?}");
    }
}
