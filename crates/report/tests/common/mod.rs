//! Helpers for the tests: small reports to write, and readers of their SVG and HTML.
#![allow(dead_code, reason = "each test file uses a part")]

use afbc_campaign::{
    self as campaign, CampaignSummary, DrawnQuantity, FIGURES, Manifest, QUANTITIES, ResultRow, Shard,
};
use afbc_files::Folder;
use afbc_plant::{CosineGust, Environment, Gust, GustKind, Payload, PlantParameter, PlantParameterChange, RotorFault};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Outage, Scenario, built_in};
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::run::FlightResult;
use nalgebra::Vector3;
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Contender names, some with characters to escape or spaces. There are more names than colours, so some share one.
pub(crate) const OWN: [&str; 14] =
    ["soft", "stiff", "no limits", "a", "b", "c", "d", "e", "f", "g", "pid-tuned", "AFBC 2", "<&> δ", "mine (storm)"];

/// Returns a separate empty folder for each test.
pub(crate) fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reports").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

/// Opens the output folder of a test, as a command opens its own.
pub(crate) fn open(folder: &Path) -> Folder {
    Folder::open(folder, "test", "it", false).unwrap()
}

/// Returns every SVG in `folder`, by name.
pub(crate) fn svgs(folder: &Path) -> BTreeMap<String, String> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let svgs = paths.filter(|path| path.extension().is_some_and(|ending| ending == "svg"));
    svgs.map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read_to_string(&path).unwrap()))
        .collect()
}

pub(crate) fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).unwrap()
}

/// Returns the caption of each figure.
pub(crate) fn captions(folder: &Path) -> Vec<String> {
    let page = page(folder);
    page.split("<figcaption>").skip(1).map(|rest| rest.split("</figcaption>").next().unwrap().to_owned()).collect()
}

pub(crate) fn hover(duration_s: f64) -> Scenario {
    Scenario { duration_s, ..built_in("hover").unwrap().read().unwrap() }
}

pub(crate) fn named(name: &str) -> Contender {
    Contender { name: name.into(), ..Contender::of(ControllerKind::Backstepping, afbc::Profile::Paper) }
}

/// Flies `scenario` under contenders with these names.
pub(crate) fn flown(scenario: &Scenario, names: &[&str]) -> Vec<ScenarioFlight> {
    let contenders: Vec<_> = names.iter().map(|name| named(name)).collect();
    let scenario = Scenario { contenders, ..scenario.clone() };
    let fly = |contender| ScenarioFlight {
        run: FlightResult::fly(&scenario, contender, 10).unwrap(),
        scenario: scenario.clone(),
    };
    scenario.contenders.iter().map(fly).collect()
}

/// Returns a campaign whose flights have the same results for all contenders, except those that are `lost`.
pub(crate) fn gone_alike(
    names: &[&str],
    drawn: &[&str],
    flights: u64,
    lost: impl Fn(&str, u64) -> bool,
) -> CampaignSummary {
    let drawn = drawn.iter().map(|name| {
        let quantity = QUANTITIES.iter().find(|quantity| quantity.range.name == *name).unwrap();
        DrawnQuantity { name: (*name).into(), meaning: quantity.meaning.into(), ends: [0.5, 1.5] }
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
    let mut summary = CampaignSummary::new(&manifest);
    for flight in 0..flights {
        for name in names {
            let draws = manifest.drawn.iter().map(|_| 0.5 + (flight as f64 + 0.5) / flights as f64);
            let lost = lost(name, flight);
            let figures = FIGURES.iter().map(|figure| match figure.name {
                "lost_at_s" | "tripped_at_s" => lost.then_some(1.0),
                _ => Some(0.01 * (1.0 + flight as f64)),
            });
            summary.add(&ResultRow {
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

/// Returns a scenario with every kind of event, many at the same time.
pub(crate) fn eventful() -> Scenario {
    let calm = hover(12.0);
    let gust = |axis, start_s, end_s| Gust { axis, kind: GustKind::Force, size: 0.01, start_s, end_s };
    let change = |quantity, factor, start_s, end_s| PlantParameterChange { quantity, factor, start_s, end_s };
    let environment = Environment::new(
        calm.vehicle,
        vec![
            change(PlantParameter::Mass, 1.1, 1.0, 8.0),
            change(PlantParameter::Inertia, 0.9, 2.0, 9.0),
            change(PlantParameter::ThrustFactor, 0.98, 3.0, 4.0),
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

pub(crate) fn words(node: Node<'_, '_>) -> String {
    node.descendants()
        .filter_map(|child| child.text().filter(|_| child.is_text()))
        .collect::<String>()
        .trim()
        .to_owned()
}

/// Returns all texts of a figure with their positions.
pub(crate) fn labels(svg: &Document<'_>) -> Vec<(String, f64, f64)> {
    let texts = svg.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|text| (words(text), number(text, "x"), middle(text))).collect()
}

/// Returns the height of a text's middle, halfway up its small letters.
pub(crate) fn middle(text: Node<'_, '_>) -> f64 {
    number(text, "y") - 0.26 * number(text, "font-size")
}

pub(crate) fn points(node: Node<'_, '_>) -> Vec<(f64, f64)> {
    let pair = |text: &str| text.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap();
    node.attribute("points").unwrap().split_whitespace().map(pair).collect()
}

/// Returns every filled rectangle: left, top, width, height.
pub(crate) fn boxes<'a>(svg: &'a Document<'_>) -> Vec<(Node<'a, 'a>, [f64; 4])> {
    let areas = svg.descendants().filter(|node| node.has_tag_name("polygon"));
    let rectangle = |area| {
        let [a, b, c, d] = points(area).try_into().ok()?;
        let is_upright = a.1 == b.1 && b.0 == c.0 && c.1 == d.1 && d.0 == a.0;
        is_upright.then_some((area, [a.0.min(c.0), a.1.min(c.1), (c.0 - a.0).abs(), (c.1 - a.1).abs()]))
    };
    areas.filter_map(rectangle).collect()
}

pub(crate) fn number(node: Node<'_, '_>, attribute: &str) -> f64 {
    node.attribute(attribute).unwrap().parse().unwrap()
}
