//! Contenders in figures: each has the same colour in every report, and none hides another.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

mod common;

use afbc_campaign::compare;
use afbc_report::{self as report, flights};
use afbc_scenario::Scenario;
use common::{OWN, boxes, flown, folder, gone_alike, hover, labels, middle, named, number, open, points, svgs, words};
use roxmltree::{Document, Node};
use std::collections::{BTreeSet, HashMap};
use std::fs;

/// Returns stroke and dashes of the line in front of `name` in the legend.
fn legend(svg: &str, name: &str) -> Option<(String, String)> {
    let svg = Document::parse(svg).unwrap();
    let entry = svg.descendants().find(|node| node.has_tag_name("text") && words(*node) == name)?;
    let y = middle(entry);
    let samples = svg.descendants().filter(|node| node.has_tag_name("polyline"));
    let mut near = samples.filter_map(|line| {
        let points = points(line);
        let right = points.last()?.0;
        let [left, right] = [points.first()?.0, right].map(|x| number(entry, "x") - x);
        (points.iter().all(|point| (point.1 - y).abs() < 1.0) && 0.0 < right && left < 150.0).then_some(line)
    });
    let line = near.next_back()?;
    let dashes = line.attribute("stroke-dasharray").unwrap_or("");
    Some((line.attribute("stroke")?.to_owned(), dashes.to_owned()))
}

#[test]
fn a_contender_has_one_color_in_every_report() {
    let known =
        ["afbc", "backstepping", "pid", "geometric", "indi", "l1", "dfbc", "mpc", "afbc-as-printed", "afbc-monitored"];
    let names: Vec<&str> = known.into_iter().chain(OWN).collect();
    let backwards: Vec<&str> = names.iter().rev().copied().collect();
    let mut colors: HashMap<String, BTreeSet<String>> = HashMap::new();
    let title = |name: &str| named(name).title().to_owned();

    // Reports of all contenders together, in another order, and each alone; of a comparison; and of a campaign.
    let mut reports = Vec::new();
    let mut sets: Vec<Vec<&str>> = vec![names.clone(), backwards.clone()];
    sets.extend(names.iter().map(|name| vec![*name]));
    for (i, set) in sets.iter().enumerate() {
        let out = folder(&format!("colors-fly-{i}"));
        flights::write(&open(&out), &flown(&hover(0.2), set), &[]).unwrap();
        reports.push((out, set.clone()));
    }
    let scenario = Scenario { contenders: backwards.iter().map(|name| named(name)).collect(), ..hover(0.2) };
    let out = folder("colors-compare");
    report::compare::write(&open(&out), &compare::fly(vec![scenario], 2, 1, &|| ()).unwrap()).unwrap();
    // Bars have no legend; each has its contender's name next to it.
    let rmse = fs::read_to_string(out.join("rmse.svg")).unwrap();
    let rmse = Document::parse(&rmse).unwrap();
    for name in &names {
        let label = rmse.descendants().find(|n| n.has_tag_name("text") && words(*n) == title(name)).unwrap();
        let at = middle(label);
        let bars = boxes(&rmse);
        let bar = bars.iter().find(|(_, [_, top, _, height])| *top < at && at < top + height);
        colors.entry((*name).into()).or_default().insert(bar.unwrap().0.attribute("fill").unwrap().into());
    }
    reports.push((out, backwards.clone()));
    let out = folder("colors-campaign");
    report::campaign::write(&open(&out), &gone_alike(&names, &["mass_ratio"], 20, |_, _| false)).unwrap();
    reports.push((out, names.clone()));

    for (folder, set) in &reports {
        for (file, svg) in svgs(folder).iter().filter(|(file, _)| *file != "rmse.svg") {
            let mut inks = BTreeSet::new();
            for name in set {
                let ink = legend(svg, &title(name)).or_else(|| legend(svg, name));
                let (color, dashes) = ink.unwrap_or_else(|| panic!("{}/{file}: no {name}", folder.display()));
                assert!(inks.insert((color.clone(), dashes)), "{}/{file}: {name} like another", folder.display());
                colors.entry((*name).into()).or_default().insert(color);
            }
        }
    }
    assert_eq!(colors.len(), names.len());
    for (name, colors) in &colors {
        assert_eq!(colors.len(), 1, "{name}: {colors:?}");
    }
    let known: BTreeSet<_> = known.iter().map(|name| &colors[*name]).collect();
    assert_eq!(known.len(), 10, "{known:?}");
}

/// Returns the position of 100 % in each panel of a figure of shares, from top to bottom.
fn hundreds(svg: &Document<'_>) -> Vec<(f64, f64)> {
    labels(svg).into_iter().filter(|(text, ..)| text == "100").map(|(_, x, y)| (x, y)).collect()
}

#[test]
fn every_contender_shows_at_100_percent_with_its_interval() {
    for names in [&["afbc", "pid"][..], &OWN[..9], &OWN] {
        let out = folder(&format!("hundred-{}", names.len()));
        report::campaign::write(&open(&out), &gone_alike(names, &["mass_ratio", "wind_m_s"], 200, |_, _| false))
            .unwrap();
        let svgs = svgs(&out);

        let text = &svgs["success.svg"];
        let success = Document::parse(text).unwrap();
        let colors: Vec<String> = names.iter().map(|name| legend(text, name).unwrap().0).collect();
        let marks: Vec<_> = success.descendants().filter(|node| node.has_tag_name("polygon")).collect();
        let lines: Vec<_> = success.descendants().filter(|node| node.has_tag_name("polyline")).collect();
        let hundreds = hundreds(&success);
        assert_eq!(hundreds.len(), 2);
        for (left, top) in hundreds {
            // Every contender flew in each tenth without a loss, so each has ten marks in this row, all at different
            // positions.
            let middle = |node: &Node<'_, '_>| {
                let points = points(*node);
                let extent = |part: fn(&(f64, f64)) -> f64| {
                    let all = || points.iter().map(part);
                    0.5 * (all().fold(f64::INFINITY, f64::min) + all().fold(f64::NEG_INFINITY, f64::max))
                };
                (extent(|p| p.0), extent(|p| p.1))
            };
            let width = if names.len() > 6 { 3600.0 } else { 1700.0 };
            let here = |(x, y): (f64, f64)| (y - top).abs() < 12.0 && left < x && x < left + width;
            let row: Vec<_> = marks.iter().filter(|mark| here(middle(mark))).collect();
            assert_eq!(row.len(), 10 * names.len());
            let mut places: Vec<_> = row.iter().map(|mark| middle(mark).0).collect();
            places.sort_by(f64::total_cmp);
            let apart = places.windows(2).map(|two| two[1] - two[0]).fold(f64::INFINITY, f64::min);
            assert!(apart >= 3.0 * 4.0, "{apart} units, four a pixel, between marks of {}", names.len());
            for color in &colors {
                let fellows = colors.iter().filter(|other| *other == color).count();
                let own = row.iter().filter(|mark| mark.attribute("fill") == Some(color)).count();
                assert_eq!(own, 10 * fellows);
                // Interval bars go down from the marks, to the lower bound for 20 flights without a loss.
                let is_bar = |line: &&Node<'_, '_>| {
                    let points = points(**line);
                    line.attribute("stroke") == Some(color)
                        && points.len() == 2
                        && points[0].0 == points[1].0
                        && here((points[0].0, points[0].1.min(points[1].1)))
                        && (points[0].1 - points[1].1).abs() > 40.0
                };
                assert_eq!(lines.iter().filter(is_bar).count(), 10 * fellows);
            }
        }

        // Equal curves are drawn one inside the other, and each has its own end mark and interval.
        for name in ["position-error.svg", "smoothness.svg"] {
            let figure = Document::parse(&svgs[name]).unwrap();
            let long = |node: &Node<'_, '_>, tag| node.has_tag_name(tag) && points(*node).len() > 50;
            let curves: Vec<_> = figure.descendants().filter(|node| long(node, "polyline")).collect();
            assert_eq!(curves.len(), names.len(), "{name}");
            let widths: Vec<_> = curves.iter().map(|curve| number(*curve, "stroke-width")).collect();
            assert!(widths.windows(2).all(|two| two[0] > two[1] + 4.0), "{name}: {widths:?}");
            let intervals: Vec<_> = figure.descendants().filter(|node| long(node, "polygon")).collect();
            assert_eq!(intervals.len(), names.len(), "{name}");
            for (interval, color) in intervals.iter().zip(&colors) {
                assert_eq!(interval.attribute("fill"), Some(color.as_str()));
                let points = points(*interval);
                let (high, low) = points.split_at(points.len() / 2);
                assert!(high.iter().zip(low.iter().rev()).all(|(high, low)| high.0 == low.0 && high.1 < low.1));
            }
            let (_, top) = self::hundreds(&figure)[0];
            let small = |node: &Node<'_, '_>| {
                node.has_tag_name("polygon")
                    && !long(node, "polygon")
                    && points(*node).iter().all(|p| (p.1 - top).abs() < 30.0)
            };
            let ends: BTreeSet<i64> = figure
                .descendants()
                .filter(small)
                .map(|mark| points(mark).iter().map(|p| p.0).fold(f64::INFINITY, f64::min) as i64 / 16)
                .collect();
            assert!(ends.len() >= names.len(), "{name}: {} of {}", ends.len(), names.len());
        }
    }
}
