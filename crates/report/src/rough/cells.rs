//! Contents of the table, and their explanation.

use super::judged::RoughResults;
use crate::grid::GridCell;
use afbc_campaign::rough::{CLASSES, ClassRow, LONG_ONE_IN, LONG_S, MIXTURE, MIXTURE_MEANING, SHORT_S};
use afbc_scenario::contender::Contender;
use afbc_sim::metrics::SETTLED_S;
use maud::{Markup, html};

/// Column heads without the class's.
pub(super) const HEADS: [&str; 10] =
    ["known", "flights", "NEES", "worst", "within 3 sigma", "valid", "coasted", "descended", "handed over", "lost"];

/// Returns the cells of a class.
pub(super) fn cells(row: &ClassRow) -> Vec<GridCell> {
    let ClassRow { flights, nees, worst_nees, within, valid, coasted, descended, tripped, lost, .. } = *row;
    let percent = |share: f64| if share.is_nan() { "-".into() } else { format!("{:.1} %", 100.0 * share) };
    let figures = if within.is_nan() { ["-".into(), "-".into()] } else { [nees, worst_nees].map(error) };
    let counts = [coasted, descended, tripped, lost].map(|count| count.to_string());
    let known = CLASSES.iter().any(|class| class.known && Some(class.name) == row.class);
    let known = if known { "yes".to_owned() } else { String::new() };
    let all =
        [known, flights.to_string()].into_iter().chain(figures).chain([percent(within), percent(valid)]).chain(counts);
    all.map(GridCell::from).collect()
}

/// Formats a normalised error.
fn error(nees: f64) -> String {
    match nees {
        nees if nees.is_nan() => "none".into(),
        nees if nees < 1000.0 => format!("{nees:.1}"),
        nees => format!("{nees:.1e}"),
    }
}

/// Returns the name of a row: its class, or "all".
pub(super) fn name(row: &ClassRow) -> &'static str {
    row.class.unwrap_or("all")
}

/// Returns the contender that flew.
pub(super) fn contender<'a>(results: &RoughResults<'a>) -> Option<&'a Contender> {
    results.flown.first().and_then(|first| first.flight.scenario.contenders.first())
}

/// Describes the flights, without a full stop.
pub(super) fn words(results: &RoughResults<'_>) -> String {
    let rough = results.rough;
    let (first, last) = (rough.seeds.start, rough.seeds.end.saturating_sub(1));
    let seeds = if first == last { format!("Seed {first}") } else { format!("Seeds {first} to {last}") };
    let vehicles: Vec<&str> = rough.vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
    let lasts = match rough.duration_s {
        Some(duration_s) => format!("{duration_s} s"),
        None => format!("{SHORT_S} s, one in {LONG_ONE_IN} of {LONG_S} s"),
    };
    let flights = rough.flights;
    let law = contender(results).map_or("", Contender::title);
    format!(
        "{seeds}; flights of each vehicle, class and seed: {flights}; law: {law}; duration: {lasts}; vehicles: {}",
        vehicles.join(", ")
    )
}

/// Explains the columns.
pub(super) fn legend() -> String {
    format!(
        "known: the vehicle knows of the error from data sheets, time stamps or missing data. Figures of the estimate \
         count while the estimate was valid, from {SETTLED_S} s to the end or until the motors stop: NEES, the \
         normalised estimation error squared of rotation, velocity and position, mean over the flights, 9 if the \
         estimate is consistent; none if a covariance was not positive. worst: NEES of the worst flight. within 3 \
         sigma: share of the nine errors within three standard deviations. valid: share of the time. coasted, \
         descended, fell back, lost: numbers of flights in which the flight core flew without a fresh state, in which \
         it descended, in which the monitor switched to the fallback law, and in which the vehicle was lost."
    )
}

/// Returns the meanings of the classes, for the HTML page.
pub(super) fn meanings() -> Markup {
    html! {
        dl {
            @for class in &CLASSES {
                dt { (class.name) }
                dd { (class.meaning) @if class.known { " (the vehicle knows)" } }
            }
            dt { (MIXTURE) }
            dd { (MIXTURE_MEANING) }
        }
    }
}
