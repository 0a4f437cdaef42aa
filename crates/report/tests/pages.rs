//! Texts and layout of pages: labels with units, captions that fit the figure, small and dark screens.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

mod common;

use afbc_campaign::compare::Comparison;
use afbc_campaign::random::{self, FeedbackSource, FlownRandomFlight, RandomFlights};
use afbc_campaign::suite::{SUITES, Suite};
use afbc_campaign::{QUANTITIES, compare};
use afbc_plant::{Environment, PlantParameter, PlantParameterChange, RotorFault};
use afbc_report::random::RandomResults;
use afbc_report::{self as report, flights};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::Lost;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::run::FlightResult;
use afbc_vehicles::BUILT_IN;
use common::{OWN, captions, eventful, flown, folder, gone_alike, hover, labels, named, open, page, svgs, words};
use nalgebra::Vector4;
use roxmltree::Document;
use std::collections::BTreeSet;
use std::path::Path;

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

/// Returns a page's text without its scripts.
fn words_of(folder: &Path) -> String {
    let page = page(folder);
    let mut words = String::new();
    for (i, part) in page.split("<script").enumerate() {
        words += if i == 0 { part } else { part.split_once("</script>").map_or("", |(_, after)| after) };
    }
    words
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

    // The flight has only a parameter change, without a gust.
    let mut changed = eventful();
    changed.environment = Environment::new(
        changed.vehicle,
        vec![PlantParameterChange { quantity: PlantParameter::Mass, factor: 1.1, start_s: 1.0, end_s: 8.0 }],
        Vec::new(),
    )
    .unwrap();
    changed.realism.wind.gusts.clear();
    let only = folder("captions-change");
    flights::write(&open(&only), &flown(&changed, &["afbc"]), &[]).unwrap();
    assert_eq!((mentions(&only, "gust"), mentions(&only, "Shaded")), (0, 5), "{:?}", captions(&only));

    // A vehicle with a failing rotor.
    let mut falling = hover(8.0);
    falling.realism.rotors.faults = vec![RotorFault { rotor: 1, efficiency: 0.0, start_s: 1.0 }];
    let lost = flown(&falling, &["afbc"]);
    assert!(lost[0].run.lost.is_some());
    let fallen = folder("captions-lost");
    flights::write(&open(&fallen), &lost, &[]).unwrap();
    // The caption explains a cross at the loss, or an arrow if the loss lies outside the panel.
    assert_eq!(mentions(&fallen, "lost"), 5, "{:?}", captions(&fallen));
    let marked = |text: &String| text.contains("Cross:") || text.contains("Arrow:");
    assert!(captions(&fallen).iter().all(marked), "{:?}", captions(&fallen));

    // The law as printed in the paper chatters on the paper's vehicle.
    let paper = Scenario { duration_s: 30.0, ..built_in("paper").unwrap().read().unwrap() };
    let chatter = folder("captions-chatter");
    let contender = paper.contenders.iter().find(|contender| contender.name == "afbc").unwrap().clone();
    let run = FlightResult::fly(&paper, &contender, 10).unwrap();
    flights::write(&open(&chatter), &[ScenarioFlight { scenario: paper, run }], &[]).unwrap();
    let said = captions(&chatter);
    assert_eq!(said.iter().filter(|text| text.contains("chatter")).count(), 1, "{said:?}");

    // A comparison mentions seeds only if there are several, and losses only if there are some.
    for (seeds, loses) in [(1, false), (3, false), (1, true)] {
        let scenario = if loses { falling.clone() } else { hover(6.0) };
        let scenario = Scenario { contenders: vec![named("afbc")], ..scenario };
        let out = folder(&format!("captions-compare-{seeds}-{loses}"));
        report::compare::write(&open(&out), &compare::fly(vec![scenario], seeds, 10, &|| ()).unwrap()).unwrap();
        let said = format!("{:?} {}", captions(&out)[0], words_of(&out));
        assert_eq!(said.contains("over all seeds"), seeds > 1, "{said}");
        assert_eq!(said.contains("lost a vehicle"), loses, "{said}");
        // The page shows the ratio of errors to backstepping's errors, because the flights of backstepping are there to
        // compare with.
        assert_eq!(said.contains("Ratio"), !loses, "{said}");
    }
    let scenario =
        Scenario { contenders: vec![Contender::of(ControllerKind::Pid, afbc::Profile::Paper)], ..hover(6.0) };
    let out = folder("captions-no-ratio");
    report::compare::write(&open(&out), &compare::fly(vec![scenario], 1, 10, &|| ()).unwrap()).unwrap();
    let said = words_of(&out);
    assert!(!said.contains("Ratio") && !said.contains(" ratio"), "no backstepping flew");

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
    // Without drawn quantities and measurements there are no figures, rather than empty ones.
    let out = folder("captions-none");
    report::campaign::write(&open(&out), &gone_alike(&["afbc"], &[], 3, |_, _| true)).unwrap();
    assert_eq!(captions(&out).len(), 0, "{:?}", captions(&out));
    assert!(!page(&out).contains("Drawn"));
}

/// Returns the names of a page's elements that are not inside a scrolling element.
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

/// A suite of one short flight, with its results.
struct Suited(Suite, Vec<Comparison>);

impl Suited {
    fn fly(names: &[&str]) -> Self {
        let mut suite = SUITES[0].read().unwrap();
        suite.flights.truncate(1);
        suite.flights[0].scenario = hover(6.0);
        let contenders: Vec<_> = names.iter().map(|name| named(name)).collect();
        let comparisons = compare::fly(suite.under(&contenders).unwrap(), 1, 10, &|| ()).unwrap();
        Suited(suite, comparisons)
    }

    fn flown(&self) -> report::suite::FlownSuite<'_> {
        report::suite::FlownSuite { suite: &self.0, comparisons: &self.1 }
    }
}

/// For each vehicle, the page shows one flight in space: the flight that the contender alone lost, or else the flight
/// in which it was farthest behind.
#[test]
fn the_flights_that_tell_most_are_told() {
    let vehicles = BUILT_IN.iter().take(2).map(|vehicle| vehicle.read().unwrap()).collect();
    let random = RandomFlights { seeds: 1..2, flights: 3, seen: FeedbackSource::Truth, vehicles };
    let contenders = ["afbc", "pid"].map(named);
    let mut drawn = random.under(&contenders, &[]).unwrap();
    drawn.iter_mut().for_each(|flight| flight.scenario.duration_s = 6.0);
    let mut flown = random::fly(drawn, &|| ()).unwrap();
    let told = |flown: &[FlownRandomFlight]| -> Vec<String> {
        RandomResults::new(&random, flown, "afbc").telling().iter().map(|scenario| scenario.name.clone()).collect()
    };
    let name = |place: usize, flown: &[FlownRandomFlight]| flown[place].flight.scenario.name.clone();
    // Make all results equal, except for one flight per vehicle.
    for one in flown.iter_mut().flat_map(|flown| &mut flown.outcomes) {
        (one.lost, one.metrics.rmse) = (None, Vector4::repeat(1.0));
    }
    assert_eq!(told(&flown), [name(0, &flown), name(3, &flown)]);
    flown[1].outcomes[0].metrics.rmse *= 1.5;
    flown[5].outcomes[1].metrics.rmse *= 0.5;
    assert_eq!(told(&flown), [name(1, &flown), name(5, &flown)]);
    let lost = Some(Lost { time_s: 1.0, reason: "it fell" });
    flown[2].outcomes[0].lost = lost;
    // A flight that every contender lost is not shown.
    flown[3].outcomes.iter_mut().for_each(|outcome| outcome.lost = lost);
    assert_eq!(told(&flown), [name(2, &flown), name(5, &flown)]);

    let judged = RandomResults::new(&random, &flown, "afbc");
    let again = compare::fly(judged.telling().into_iter().cloned().collect(), 1, 10, &|| ()).unwrap();
    let out = folder("random");
    report::random::write(&open(&out), &judged, &again).unwrap();
    assert_eq!(page(&out).matches("data-explore=\"scene\"").count(), 2);
}

/// Returns the declarations for exactly this selector in a part of a style sheet.
fn declared(style: &str, selector: &str) -> String {
    let rules = style.split('}').filter_map(|rule| rule.rsplit_once('{'));
    let is_it = |names: &str| names.rsplit('{').next().unwrap().split(',').any(|name| name.trim() == selector);
    rules.filter(|(names, _)| is_it(names)).map(|(_, declarations)| declarations).collect()
}

/// A table is as wide as it needs, up to the screen's width. A wider one scrolls visibly next to its fixed first
/// column. In print, where nothing scrolls, its cells wrap.
#[test]
fn wide_tables_are_seen_whole() {
    let out = folder("wide-suite");
    report::suite::write(&open(&out), Suited::fly(&OWN).flown()).unwrap();
    let page = page(&out);
    let style = page.split_once("<style>").unwrap().1.split_once("</style>").unwrap().0;
    let (_, body) = page.split_once("<body>").unwrap();
    let columns = |table: &str| table.split("</tr>").next().unwrap().matches("<th").count();
    let mut wide = 0;
    for (before, table) in body.match_indices("<table").map(|(at, _)| body.split_at(at)) {
        let table = table.split("</table>").next().unwrap();
        // The table is in a child of the body, so it may be wider than the text.
        assert!(before.ends_with("<div class=\"scroll\">"), "{table}");
        assert_eq!(before.matches("<div").count() - before.matches("</div>").count(), 1, "{table}");
        wide += usize::from(columns(table) >= OWN.len());
    }
    assert!(wide >= 3, "{wide} wide tables");

    let (screen, print) = style.split_once("@media print {").unwrap();
    for (part, selector, wanted) in [
        (screen, "body > *", &["max-width: 900px;"][..]),
        (screen, "body > .scroll", &["width: fit-content;", "max-width: 100%;"]),
        (screen, ".scroll", &["overflow-x: auto;", "linear-gradient"]),
        (screen, ".scroll::-webkit-scrollbar", &["height:"]),
        (screen, "tr > :first-child", &["position: sticky;", "left: 0;", "background: var(--paper);"]),
        (print, ".scroll", &["overflow: visible;"]),
        (print, "body > .scroll", &["max-width: none;"]),
        (print, "td", &["white-space: normal;"]),
        (print, "tr > :first-child", &["position: static;"]),
        (print, "table:has(tr > :nth-child(8))", &["font-size:"]),
    ] {
        let declared = declared(part, selector);
        for wanted in wanted {
            assert!(declared.contains(wanted), "{selector}: {wanted} is not in {declared:?}");
        }
    }
    assert!(!declared(screen, "body").contains("max-width"), "the text is narrow, not the page");
}

#[test]
fn pages_fit_a_phone_and_have_a_dark_mode() {
    let (fly, compared, whole) = (folder("phone-fly"), folder("phone-compare"), folder("phone-campaign"));
    let suite = folder("phone-suite");
    flights::write(&open(&fly), &flown(&eventful(), &["afbc", "soft"]), &[]).unwrap();
    let scenario = Scenario { contenders: OWN.iter().map(|name| named(name)).collect(), ..eventful() };
    report::compare::write(&open(&compared), &compare::fly(vec![scenario], 2, 10, &|| ()).unwrap()).unwrap();
    report::campaign::write(&open(&whole), &gone_alike(&OWN, &["wind_m_s"], 20, |_, flight| flight == 3)).unwrap();
    report::suite::write(&open(&suite), Suited::fly(&OWN).flown()).unwrap();
    for folder in [fly, compared, whole, suite] {
        let page = page(&folder);
        assert!(page.contains("name=\"viewport\" content=\"width=device-width, initial-scale=1\""));
        let free = unscrolled(&page);
        assert!(free.contains(&"h1".to_owned()) && free.contains(&"div".to_owned()), "{free:?}");
        for wide in ["table", "svg", "pre", "img"] {
            assert!(!free.contains(&wide.to_owned()), "{}: a {wide} that does not scroll", folder.display());
        }
        let scheme = "prefers-color-scheme: dark";
        assert!(page.contains(scheme) && page.contains("color-scheme: light dark"), "{}", folder.display());
        assert!(!page.contains("http") && !page.contains("src=") && !page.contains("@import"));

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
            // The page shows the same figure as the file, on the figure's own background.
            let ground = svg.descendants().find(|node| node.has_tag_name("rect")).unwrap();
            assert_eq!(ground.attribute("fill"), Some("#ffffff"), "{name}");
        }
    }
}
