//! Contents of figures and pages, read back from the SVG and HTML as written.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

use afbc_campaign::compare;
use afbc_campaign::{self as campaign, Drawn, FIGURES, Manifest, QUANTITIES, Row, Shard, Summary};
use afbc_files::Folder;
use afbc_plant::{CosineGust, Environment, Gust, GustKind, ParameterChange, Payload, Quantity, RotorFault};
use afbc_report::{self as report, flights};
use afbc_sim::contender::{Contender, ControllerKind};
use afbc_sim::flown::Flown;
use afbc_sim::run::Run;
use afbc_sim::scenario::{Outage, Scenario, built_in};
use nalgebra::Vector3;
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

/// Names, some with escapes or spaces; two share a colour, since there are fewer colours than names.
const OWN: [&str; 14] =
    ["soft", "stiff", "no limits", "a", "b", "c", "d", "e", "f", "g", "pid-tuned", "AFBC 2", "<&> δ", "mine (storm)"];

/// A separate empty folder for each test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("figures").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

/// Opens it as a command's own.
fn open(folder: &Path) -> Folder {
    Folder::open(folder, "test", "it", false).unwrap()
}

/// Returns every SVG in `folder`, by name.
fn svgs(folder: &Path) -> BTreeMap<String, String> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let svgs = paths.filter(|path| path.extension().is_some_and(|ending| ending == "svg"));
    svgs.map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read_to_string(&path).unwrap()))
        .collect()
}

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).unwrap()
}

/// Returns the caption of each figure.
fn captions(folder: &Path) -> Vec<String> {
    let page = page(folder);
    page.split("<figcaption>").skip(1).map(|rest| rest.split("</figcaption>").next().unwrap().to_owned()).collect()
}

fn hover(duration_s: f64) -> Scenario {
    Scenario { duration_s, ..built_in("hover").unwrap().read().unwrap() }
}

fn named(name: &str) -> Contender {
    Contender { name: name.into(), ..Contender::of(ControllerKind::Backstepping, afbc::Profile::Paper) }
}

/// Flies `scenario` under contenders of these names.
fn flown(scenario: &Scenario, names: &[&str]) -> Vec<Flown> {
    let contenders: Vec<_> = names.iter().map(|name| named(name)).collect();
    let scenario = Scenario { contenders, ..scenario.clone() };
    let fly = |contender| Flown { run: Run::fly(&scenario, contender, 10).unwrap(), scenario: scenario.clone() };
    scenario.contenders.iter().map(fly).collect()
}

/// A campaign of `flights` in which those for which `lost` holds were lost; all others have equal results.
fn gone_alike(names: &[&str], drawn: &[&str], flights: u64, lost: impl Fn(&str, u64) -> bool) -> Summary {
    let drawn = drawn.iter().map(|name| {
        let quantity = QUANTITIES.iter().find(|quantity| quantity.range.name == *name).unwrap();
        Drawn { name: (*name).into(), meaning: quantity.meaning.into(), ends: [0.5, 1.5] }
    });
    let any = campaign::built_in("robustness").unwrap().read().unwrap();
    let manifest = Manifest {
        name: "trial".into(),
        flights,
        contenders: names.iter().map(|name| (*name).to_owned()).collect(),
        trajectories: vec!["hover".into()],
        drawn: drawn.collect(),
        ..Manifest::new(&any, Shard::WHOLE)
    };
    let mut summary = Summary::new(&manifest);
    for flight in 0..flights {
        for name in names {
            let draws = manifest.drawn.iter().map(|_| 0.5 + (flight as f64 + 0.5) / flights as f64);
            let lost = lost(name, flight);
            let figures = FIGURES.iter().map(|figure| match figure.name {
                "lost_at_s" | "tripped_at_s" => lost.then_some(1.0),
                _ => Some(0.01 * (1.0 + flight as f64)),
            });
            summary.add(&Row {
                flight,
                seed: flight,
                contender: (*name).into(),
                trajectory: "hover".into(),
                lost_reason: lost.then(|| "fell".into()),
                trip_reason: None,
                numbers: draws.map(Some).chain(figures).collect(),
            });
        }
    }
    summary.finish()
}

fn words(node: Node<'_, '_>) -> String {
    node.descendants()
        .filter_map(|child| child.text().filter(|_| child.is_text()))
        .collect::<String>()
        .trim()
        .to_owned()
}

/// Returns all text in a figure with its position.
fn labels(svg: &Document<'_>) -> Vec<(String, f64, f64)> {
    let texts = svg.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|text| (words(text), number(text, "x"), number(text, "y"))).collect()
}

fn number(node: Node<'_, '_>, attribute: &str) -> f64 {
    node.attribute(attribute).unwrap().parse().unwrap()
}

/// Returns stroke and dashes of the line before `name` in the legend.
fn legend(svg: &str, name: &str) -> Option<(String, String)> {
    let svg = Document::parse(svg).unwrap();
    let entry = svg.descendants().find(|node| node.has_tag_name("text") && words(*node) == name)?;
    let y = number(entry, "y");
    let samples = svg.descendants().filter(|node| node.has_tag_name("polyline"));
    let mut near = samples.filter_map(|line| {
        let points = points(line);
        let right = points.last()?.0;
        let [left, right] = [points.first()?.0, right].map(|x| number(entry, "x") - x);
        (points.iter().all(|point| point.1 == y) && 0.0 < right && left < 150.0).then_some(line)
    });
    let line = near.next_back()?;
    let dashes = line.attribute("stroke-dasharray").unwrap_or("");
    Some((line.attribute("stroke")?.to_owned(), dashes.to_owned()))
}

fn points(node: Node<'_, '_>) -> Vec<(f64, f64)> {
    let pair = |text: &str| text.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap();
    node.attribute("points").unwrap().split_whitespace().map(pair).collect()
}

#[test]
fn a_contender_has_one_color_in_every_report() {
    let known = ["afbc", "backstepping", "pid", "geometric", "indi", "l1", "dfbc", "afbc-as-printed", "afbc-monitored"];
    let names: Vec<&str> = known.into_iter().chain(OWN).collect();
    let backwards: Vec<&str> = names.iter().rev().copied().collect();
    let mut colors: HashMap<String, BTreeSet<String>> = HashMap::new();
    let title = |name: &str| named(name).title().to_owned();

    // All together, in another order, and each alone; in a comparison; in a campaign.
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
    // Bars have no legend: the name is next to them.
    let rmse = fs::read_to_string(out.join("rmse.svg")).unwrap();
    let rmse = Document::parse(&rmse).unwrap();
    for name in &names {
        let label = rmse.descendants().find(|n| n.has_tag_name("text") && words(*n) == title(name)).unwrap();
        let middle = number(label, "y");
        let bars = rmse.descendants().filter(|node| node.has_tag_name("rect") && number(*node, "height") < 200.0);
        let bar = bars.clone().find(|bar| {
            let top = number(*bar, "y");
            top < middle && middle < top + number(*bar, "height")
        });
        colors.entry((*name).into()).or_default().insert(bar.unwrap().attribute("fill").unwrap().into());
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
    assert_eq!(known.len(), 9, "{known:?}");
}

/// Returns the position of 100 % in each panel of a figure of shares, top to bottom.
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
            // Every contender flew in each tenth without a loss: that many marks in a row, at different places.
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
                // Interval bars extend down from the marks, to the lower bound for 20 flights without a loss.
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

        // Equal curves lie within one another, and each ends in a mark of its own over its interval.
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

#[test]
fn panels_of_a_campaign_have_words_with_units() {
    let keys: Vec<&str> = QUANTITIES.iter().map(|quantity| quantity.range.name).collect();
    let out = folder("words");
    report::campaign::write(&open(&out), &gone_alike(&["afbc", "pid"], &keys, 30, |_, _| false)).unwrap();
    let svgs = svgs(&out);
    let success = Document::parse(&svgs["success.svg"]).unwrap();
    let labels: Vec<String> = labels(&success).into_iter().map(|(text, ..)| text).collect();
    let (_, drawn) = page(&out).split_once("<h3>Drawn").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    let units = [
        ("_m_s", "[m/s]"),
        ("_below_m", "[m]"),
        ("_x_m", "[m]"),
        ("_y_m", "[m]"),
        ("_z_m", "[m]"),
        ("_kg", "[kg]"),
        ("_rad", "[rad]"),
        ("_hz", "[Hz]"),
        ("_s", "[s]"),
    ];
    assert!(labels.iter().all(|label| !label.contains('_')), "{labels:?}");
    let rows: Vec<&str> = drawn.split("<tr>").skip(2).collect();
    assert_eq!(rows.len(), keys.len());
    let mut seen = BTreeSet::new();
    for (key, row) in keys.iter().zip(rows) {
        let row = row.replace("&lt;", "<");
        let label = row.split_once("scope=\"row\">").unwrap().1.split('<').next().unwrap();
        assert!(label.contains(' ') && labels.iter().any(|other| other == label), "{key}: {label}");
        if let Some((_, unit)) = units.iter().find(|(ending, _)| key.ends_with(ending)) {
            assert!(label.ends_with(unit), "{key}: {label}");
        }
        assert!(seen.insert(label.to_owned()), "{label} twice");
    }
    for svg in svgs.values() {
        assert!(!svg.contains("rmse_") && !svg.contains("mean_abs"));
    }
}

/// A scenario with every kind of event, many at the same time.
fn eventful() -> Scenario {
    let calm = hover(12.0);
    let gust = |axis, start_s, end_s| Gust { axis, kind: GustKind::Force, size: 0.01, start_s, end_s };
    let change = |quantity, factor, start_s, end_s| ParameterChange { quantity, factor, start_s, end_s };
    let environment = Environment::new(
        calm.vehicle,
        vec![
            change(Quantity::Mass, 1.1, 1.0, 8.0),
            change(Quantity::Inertia, 0.9, 2.0, 9.0),
            change(Quantity::ThrustFactor, 0.98, 3.0, 4.0),
        ],
        vec![gust(afbc_types::Axis::X, 2.5, 3.5), gust(afbc_types::Axis::Y, 3.0, f64::INFINITY)],
    );
    let payload =
        Payload { mass_kg: 0.02, below_m: 0.0, ahead_m: 0.0, left_m: 0.0, start_s: 3.5, end_s: f64::INFINITY };
    let mut scenario = Scenario {
        environment: environment.unwrap().with_payloads(vec![payload]).unwrap(),
        outages: vec![Outage { start_s: 4.0, end_s: 4.05 }, Outage { start_s: 6.0, end_s: 6.05 }],
        ..calm
    };
    scenario.realism.rotors.faults = vec![RotorFault { rotor: 2, efficiency: 0.98, start_s: 5.0 }];
    let wind =
        |x, start_s, hold_s| CosineGust { velocity_m_s: Vector3::new(x, -0.5, 0.0), start_s, rise_s: 0.5, hold_s };
    scenario.realism.wind.gusts = vec![wind(0.5, 5.0, 2.0), wind(0.25, 6.0, f64::INFINITY), wind(0.125, 6.5, 0.0)];
    scenario
}

#[test]
fn events_that_overlap_are_told_apart_and_each_has_its_label() {
    let out = folder("events");
    flights::write(&open(&out), &flown(&eventful(), &["afbc"]), &[]).unwrap();
    // Start and end of each shaded event, in seconds.
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
        // The plot's scale, from its time axis.
        let tick = |text: &str| {
            let ticks = labels.iter().filter(|(label, ..)| label == text);
            ticks.max_by(|a, b| a.2.total_cmp(&b.2)).unwrap().1
        };
        let x = |t: f64| tick("0") + (tick("10") - tick("0")) * t / 10.0;
        let rects: Vec<[f64; 4]> = svg
            .descendants()
            .filter(|node| node.has_tag_name("rect") && node.attribute("fill") != Some("none"))
            .map(|rect| ["x", "y", "width", "height"].map(|part| number(rect, part)))
            .collect();
        let fills: Vec<&str> = svg
            .descendants()
            .filter(|node| node.has_tag_name("rect") && node.attribute("fill") != Some("none"))
            .map(|rect| rect.attribute("fill").unwrap())
            .collect();
        let mut strips: Vec<[f64; 4]> = Vec::new();
        for (label, start_s, end_s) in bands {
            let from_to =
                |rect: &[f64; 4]| (rect[0] - x(start_s)).abs() < 3.0 && (rect[0] + rect[2] - x(end_s)).abs() < 4.0;
            let (index, strip) = rects
                .iter()
                .enumerate()
                .find(|(_, rect)| from_to(rect) && rect[3] < 80.0)
                .unwrap_or_else(|| panic!("{name}: no band of {label} from {start_s} s"));
            // Its label is in its row, on it or beside it.
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
fn two_of_the_same_that_overlap_are_told_apart() {
    let mut two = eventful();
    two.environment = Environment::new(
        two.vehicle,
        vec![
            ParameterChange { quantity: Quantity::Mass, factor: 1.1, start_s: 1.0, end_s: 8.0 },
            ParameterChange { quantity: Quantity::Mass, factor: 1.1, start_s: 2.0, end_s: 9.0 },
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
        // Rows of tints on the time axis, and wide lines along the reference, one wider than the other.
        let is_row = |node: &Node<'_, '_>| node.has_tag_name("rect") && number(*node, "height") < 80.0;
        let is_band = |node: &Node<'_, '_>| node.has_tag_name("polyline") && number(*node, "stroke-width") > 30.0;
        let rows = svg.descendants().filter(is_row).filter_map(|row| row.attribute("fill"));
        let bands = svg.descendants().filter(is_band);
        if name.contains("fig4") {
            let widths: BTreeSet<_> = bands.clone().filter_map(|band| band.attribute("stroke-width")).collect();
            assert_eq!(widths.len(), 2, "{name}");
        }
        let tints: BTreeSet<_> = rows.chain(bands.filter_map(|band| band.attribute("stroke"))).collect();
        assert_eq!(tints.iter().filter(|tint| **tint != "none").count(), 2, "{name}: {tints:?}");
    }
}

#[test]
fn captions_explain_exactly_what_the_figure_shows() {
    let mentions = |folder: &Path, word: &str| captions(folder).iter().filter(|text| text.contains(word)).count();
    let calm = folder("captions-calm");
    flights::write(&open(&calm), &flown(&hover(6.0), &["afbc", "pid"]), &[]).unwrap();
    assert_eq!(captions(&calm).len(), 5);
    for word in ["gust", "Dots", "Cross", "Arrow", "Shaded", "chatter", "lost"] {
        assert_eq!(mentions(&calm, word), 0, "{word}: {:?}", captions(&calm));
    }

    let events = folder("captions-events");
    flights::write(&open(&events), &flown(&eventful(), &["afbc"]), &[]).unwrap();
    assert_eq!((mentions(&events, "gust"), mentions(&events, "Shaded")), (5, 5), "{:?}", captions(&events));
    assert_eq!(mentions(&events, "Cross"), 0);

    // Only a change, without a gust.
    let mut changed = eventful();
    changed.environment = Environment::new(
        changed.vehicle,
        vec![ParameterChange { quantity: Quantity::Mass, factor: 1.1, start_s: 1.0, end_s: 8.0 }],
        Vec::new(),
    )
    .unwrap();
    changed.realism.wind.gusts.clear();
    let only = folder("captions-change");
    flights::write(&open(&only), &flown(&changed, &["afbc"]), &[]).unwrap();
    assert_eq!((mentions(&only, "gust"), mentions(&only, "Shaded")), (0, 5), "{:?}", captions(&only));

    // A vehicle whose rotors fail.
    let mut falling = hover(8.0);
    falling.realism.rotors.faults = vec![RotorFault { rotor: 1, efficiency: 0.0, start_s: 1.0 }];
    let lost = flown(&falling, &["afbc"]);
    assert!(lost[0].run.lost.is_some());
    let fallen = folder("captions-lost");
    flights::write(&open(&fallen), &lost, &[]).unwrap();
    // A cross at the loss, or an arrow if it lies beyond the panel.
    assert_eq!(mentions(&fallen, "lost"), 5, "{:?}", captions(&fallen));
    let marked = |text: &String| text.contains("Cross:") || text.contains("Arrow:");
    assert!(captions(&fallen).iter().all(marked), "{:?}", captions(&fallen));

    // The printed law chatters on the paper's vehicle.
    let paper = Scenario { duration_s: 30.0, ..built_in("paper").unwrap().read().unwrap() };
    let chatter = folder("captions-chatter");
    let contender = paper.contenders.iter().find(|contender| contender.name == "afbc").unwrap().clone();
    let run = Run::fly(&paper, &contender, 10).unwrap();
    flights::write(&open(&chatter), &[Flown { scenario: paper, run }], &[]).unwrap();
    let said = captions(&chatter);
    assert_eq!(said.iter().filter(|text| text.contains("chatter")).count(), 1, "{said:?}");

    // Comparisons: seeds are mentioned only if there are several, losses only if there are some.
    for (seeds, loses) in [(1, false), (3, false), (1, true)] {
        let scenario = if loses { falling.clone() } else { hover(6.0) };
        let scenario = Scenario { contenders: vec![named("afbc")], ..scenario };
        let out = folder(&format!("captions-compare-{seeds}-{loses}"));
        report::compare::write(&open(&out), &compare::fly(vec![scenario], seeds, 10, &|| ()).unwrap()).unwrap();
        let said = format!("{:?} {}", captions(&out)[0], page(&out));
        assert_eq!(said.contains("over all seeds"), seeds > 1, "{said}");
        assert_eq!(said.contains("lost a vehicle"), loses, "{said}");
        // All fly backstepping.
        assert_eq!(said.contains("Ratio"), !loses, "{said}");
    }
    let scenario =
        Scenario { contenders: vec![Contender::of(ControllerKind::Pid, afbc::Profile::Paper)], ..hover(6.0) };
    let out = folder("captions-no-ratio");
    report::compare::write(&open(&out), &compare::fly(vec![scenario], 1, 10, &|| ()).unwrap()).unwrap();
    assert!(!page(&out).contains("atio"), "no backstepping flew");

    // Campaigns.
    for loses in [false, true] {
        let out = folder(&format!("captions-campaign-{loses}"));
        let summary =
            gone_alike(&["afbc", "pid"], &["mass_ratio"], 20, |name, flight| loses && name == "pid" && flight < 5);
        report::campaign::write(&open(&out), &summary).unwrap();
        let said = captions(&out);
        assert_eq!(said.len(), 3);
        assert_eq!(said[0].contains("lost"), loses, "{said:?}");
        assert_eq!(said[1].contains("lost"), loses, "{said:?}");
        assert_eq!(page(&out).contains("A lost flight ranks last"), loses);
        assert!(said[0].contains("95 %") && said[1].contains("95 %") && said[2].contains("95 %"), "{said:?}");
    }
    // Without drawn quantities, or without measurements: no figure rather than an empty one.
    let out = folder("captions-none");
    report::campaign::write(&open(&out), &gone_alike(&["afbc"], &[], 3, |_, _| true)).unwrap();
    assert_eq!(captions(&out).len(), 0, "{:?}", captions(&out));
    assert!(!page(&out).contains("Drawn"));
}

/// Returns the names of a page's elements that are not within a scrolling one.
fn unscrolled(page: &str) -> Vec<String> {
    let mut open: Vec<(String, bool)> = Vec::new();
    let mut found = Vec::new();
    for tag in page.split('<').skip(1) {
        let Some((tag, _)) = tag.split_once('>') else { continue };
        let name: String = tag.trim_start_matches('/').chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
        if tag.starts_with('/') {
            while open.pop().is_some_and(|(other, _)| other != name) {}
            continue;
        }
        if !open.iter().any(|(_, scrolls)| *scrolls) {
            found.push(name.clone());
        }
        let is_void = ["meta", "br", "!DOCTYPE"].contains(&name.as_str()) || tag.ends_with('/');
        if !is_void && !name.is_empty() {
            open.push((name, tag.contains("class=\"scroll\"")));
        }
    }
    found
}

#[test]
fn pages_fit_a_phone_and_have_a_dark_mode() {
    let (fly, compared, whole) = (folder("phone-fly"), folder("phone-compare"), folder("phone-campaign"));
    flights::write(&open(&fly), &flown(&eventful(), &["afbc", "soft"]), &[]).unwrap();
    let scenario = Scenario { contenders: OWN.iter().map(|name| named(name)).collect(), ..eventful() };
    report::compare::write(&open(&compared), &compare::fly(vec![scenario], 2, 10, &|| ()).unwrap()).unwrap();
    report::campaign::write(&open(&whole), &gone_alike(&OWN, &["wind_m_s"], 20, |_, flight| flight == 3)).unwrap();
    for folder in [fly, compared, whole] {
        let page = page(&folder);
        assert!(page.contains("name=\"viewport\" content=\"width=device-width, initial-scale=1\""));
        assert!(page.contains(".scroll { overflow-x: auto; max-width: 100%; }"));
        let free = unscrolled(&page);
        assert!(free.contains(&"h1".to_owned()) && free.contains(&"div".to_owned()), "{free:?}");
        for wide in ["table", "svg", "pre", "img"] {
            assert!(!free.contains(&wide.to_owned()), "{}: a {wide} that does not scroll", folder.display());
        }
        let scheme = "prefers-color-scheme: dark";
        assert!(page.contains(scheme) && page.contains("color-scheme: light dark"), "{}", folder.display());
        assert!(!page.contains("http") && !page.contains("<script") && !page.contains("@import"));

        for (name, text) in svgs(&folder) {
            let svg = Document::parse(&text).unwrap();
            let style = svg.root_element().children().find(|node| node.has_tag_name("style"));
            let style = words(style.unwrap_or_else(|| panic!("{name} has no style")));
            assert!(style.starts_with("@media screen and (prefers-color-scheme:dark){"), "{name}: {style}");
            for node in svg.descendants() {
                for part in ["fill", "stroke"] {
                    let Some(color) = node.attribute(part).filter(|color| *color != "none") else { continue };
                    let rule = format!("svg [{part}=\"{color}\"]{{{part}:#");
                    assert!(style.contains(&rule), "{name}: {part} {color} of {:?} stays", node.tag_name());
                }
            }
            // The page has the file's figure, on its own background.
            let ground = svg.descendants().find(|node| node.has_tag_name("rect")).unwrap();
            assert_eq!(ground.attribute("fill"), Some("#FFFFFF"), "{name}");
        }
    }
}
