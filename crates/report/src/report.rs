//! Self-contained HTML pages with tables, claims, figures and parameters.

use crate::claims::Claim;
use crate::explore::{Explorable, ExplorableScene};
use crate::figures::Picture;
use crate::groups::ScenarioGroup;
use crate::{explore, reality, table, words};
use afbc::reference::ReferenceModel;
use afbc::{PositionControlLimits, Settings};
use afbc_control::Smoothing;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind, Law};
use afbc_scenario::trajectory::Trajectory;
use afbc_types::{Axis, Declared, DeclaredValue, PerAxis};
use core::convert::Infallible;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Style sheet of the pages. There is one column, dark on white, or light on dark for readers who prefer it (not in
/// print). A table may be wider than the column, up to the screen's width. A still wider table scrolls: it has a scroll
/// bar and a shadow on the side where it continues, and its first column stays visible. In print, the cells of wide
/// tables wrap, and their font is smaller.
const STYLE: &str = "
:root { color-scheme: light dark; --paper: #fff; --ink: #1a1a1a; --quiet: #555; --rule: #888; --faint: #ccc;
  --good: #146c2e; --bad: #a12; --shade: #0003; }
@media screen and (prefers-color-scheme: dark) {
  :root { --paper: #16181d; --ink: #e8e8e8; --quiet: #a8acb3; --rule: #737983; --faint: #3a3f48;
    --good: #6fcf8a; --bad: #ff8f85; --shade: #fff3; }
}
body { font: 15px/1.5 system-ui, -apple-system, 'Segoe UI', Helvetica, Arial, sans-serif; color: var(--ink);
  background: var(--paper); margin: 2.5rem 0; padding: 0 1rem; -webkit-text-size-adjust: 100%; }
h1 { font-size: 1.7rem; margin: 0 0 .25rem; }
h2 { font-size: 1.3rem; margin: 2.5rem 0 .25rem; }
h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
p { margin: .3rem 0; }
h1, h2, h3, p, dd, figcaption { overflow-wrap: anywhere; }
.quiet { color: var(--quiet); }
table { border-collapse: separate; border-spacing: 0; margin: .6rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .16rem .65rem; text-align: right; white-space: nowrap; }
th { font-weight: 600; }
td small { display: inline-block; font-size: .75rem; line-height: 1.1; }
th:first-child, td:first-child, .name, .prose { text-align: left; }
.prose { white-space: normal; min-width: 14rem; }
.prose code { overflow-wrap: anywhere; }
tr > :first-child { position: sticky; left: 0; background: var(--paper); }
table:has(tr > :nth-child(8)) :is(th, td) { padding: .16rem .4rem; }
tr:last-child > * { border-bottom: 1px solid var(--faint); }
thead tr:last-child > * { border-color: var(--rule); }
.lost { color: var(--bad); text-align: left; }
.heat td { background: color-mix(in srgb, var(--bad) calc(0.55 * var(--heat, 0%)), var(--paper)); }
.heat .best { background: color-mix(in srgb, var(--good) 30%, var(--paper)); font-weight: 600; }
.heat .lost { text-align: right; color: var(--paper);
  background: color-mix(in srgb, var(--bad) 75%, var(--paper)); }
.heat a { color: inherit; text-underline-offset: .2em; }
dl { margin: .4rem 0; }
dl > div { display: grid; grid-template-columns: 8.5rem 1fr; margin: .7rem 0; }
dt { font-weight: 600; }
dd { margin: 0; }
.holds { color: var(--good); }
.fails { color: var(--bad); }
figure { margin: 1.6rem 0; }
figure svg { display: block; width: 100%; min-width: 40rem; height: auto; }
figure .scroll { border: 1px solid var(--faint); }
figcaption { color: var(--quiet); font-size: .9rem; }
.scroll { overflow-x: auto; max-width: 100%; background:
  linear-gradient(to left, var(--paper) 40%, transparent) right / 3rem 100% no-repeat local,
  linear-gradient(to left, var(--shade), transparent) right / 1rem 100% no-repeat scroll; }
.scroll::-webkit-scrollbar { height: .6rem; }
.scroll::-webkit-scrollbar-track { background: var(--faint); }
.scroll::-webkit-scrollbar-thumb { background: var(--rule); border-radius: .3rem; }
body > * { max-width: 900px; margin-inline: auto; }
body > .scroll { width: fit-content; min-width: min(100%, 900px); max-width: 100%; }
body > .scroll:has(.prose) { max-width: min(100%, 900px); }
@media (max-width: 34rem) {
  body { margin: 1.2rem auto; }
  dl > div { display: block; }
  th, td { padding: .16rem .5rem; }
}
@page { margin: 15mm; }
@media print {
  .heat td { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  body { font-size: 10.5pt; margin: 0; padding: 0; }
  body > *, body > .scroll { max-width: none; width: auto; min-width: 0; }
  .scroll { overflow: visible; background: none; }
  .scroll table { max-width: 100%; }
  th, td { white-space: normal; }
  tr > :first-child { position: static; }
  table:has(tr > :nth-child(8)) { font-size: 7pt; }
  table:has(tr > :nth-child(8)) :is(th, td) { padding: .16rem .2rem; }
  table:has(tr > :nth-child(12)) { font-size: 6pt; overflow-wrap: anywhere; }
  figure, tbody, dl > div, tr { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  figure svg { min-width: 0; max-height: 110mm; }
  figure .scroll { border: 0; }
}
";

/// Namespace that an SVG file needs, but not an SVG within a page.
const NAMESPACE: &str = " xmlns=\"http://www.w3.org/2000/svg\"";

/// Returns the page of some flights; `figures` holds one set of figures per group.
pub(super) fn page(groups: &[ScenarioGroup], figures: &[Vec<Picture>], claims: &[Claim]) -> String {
    let title = match groups {
        [only] => only.scenario.description.as_str(),
        _ => "Flights",
    };
    let body = html! {
        p.quiet {
            "Simulated: the control software flies a model of the vehicle in lockstep."
        }
        @if groups.is_empty() { p { "Nothing was flown." } }
        @if !claims.is_empty() { (verdicts(claims)) }
        @for (group, figures) in groups.iter().zip(figures) { (section(group, figures)) }
    };
    sheet(title, &body)
}

/// Returns a whole page.
pub(super) fn sheet(title: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(explore::STYLE)) }
            }
            body {
                h1 { (capitalised(title)) }
                (body)
                (explore::scripts(body))
            }
        }
    }
    .into_string()
}

/// Returns a figure with its caption.
pub(super) fn picture(figure: &Picture) -> Markup {
    html! {
        figure {
            div.drawn {
                div.scroll { (PreEscaped(explore::with_short_paths(&figure.svg.replacen(NAMESPACE, "", 1)))) }
            }
            @if let Some(explorable) = &figure.explorable { (explorable.markup()) }
            figcaption { (caption(figure)) }
        }
    }
}

/// Largest number of points of a vehicle's track, on a page with many flights.
const POINTS_OF_MANY: usize = 300;

/// Returns an interactive view in space, reduced for a page with many flights.
pub(super) fn space_of_many(scene: Option<ExplorableScene>) -> Markup {
    space(scene.map(|scene| scene.thinned(POINTS_OF_MANY)), "The flights' paths in three dimensions.")
}

/// Returns an interactive view in space without a still picture: it is only visible on a screen with JavaScript.
pub(super) fn space(scene: Option<ExplorableScene>, caption: &str) -> Markup {
    html! {
        @if let Some(scene) = scene {
            figure.on-screen { (Explorable::Scene(scene).markup()) figcaption { (caption) } }
        }
    }
}

/// Returns the caption. Its sentences about the still picture are hidden together with the picture.
fn caption(figure: &Picture) -> Markup {
    match (&figure.explorable, figure.caption.split_once(". ")) {
        (Some(Explorable::Scene(_)), Some((both, picture))) => html! { (both) "." span.drawn { " " (picture) } },
        _ => html! { (figure.caption) },
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn verdicts(claims: &[Claim]) -> Markup {
    html! {
        h2 { "The paper's claims" }
        dl {
            @for claim in claims {
                div {
                    dt { @if claim.holds { span.holds { "✓ holds" } } @else { span.fails { "✗ does not hold" } } }
                    dd { strong { (claim.statement) } br; span.quiet { (claim.evidence) } }
                }
            }
        }
    }
}

fn section(group: &ScenarioGroup, figures: &[Picture]) -> Markup {
    html! {
        h2 { (group.scenario.name) }
        p { (words::conditions(group.scenario)) "." }
        div.scroll { (results(group)) }
        @for flight in &group.flights {
            @if let Some(tripped) = &flight.run.tripped {
                p { (flight.run.contender.title()) ": " (words::tripped(tripped)) "." }
            }
            @if let Some(estimate) = &flight.run.metrics.estimate {
                p { (flight.run.contender.title()) ": " (words::estimate(estimate)) "." }
            }
        }
        p.quiet { (table::legend()) }
        @for figure in figures { (picture(figure)) }
        h3 { "Parameters" }
        (parameters(group.scenario))
    }
}

/// Returns the terminal's table as HTML.
fn results(group: &ScenarioGroup) -> Markup {
    html! {
        table {
            @for (i, block) in table::BLOCKS.iter().enumerate() {
                @let rows: Vec<_> = block.rows(group).collect();
                @let head = i == 0 || table::BLOCKS.get(i - 1).is_none_or(|above| above.columns != block.columns);
                @if head && !rows.is_empty() {
                    tbody.head { tr { td {} td {} @for column in block.columns { th scope="col" { (column) } } } }
                }
                tbody {
                    @for (row, flight) in rows.iter().enumerate() {
                        tr {
                            th scope="row" { @if row == 0 { (block.title) } }
                            td.name { (flight.run.contender.title()) }
                            @match &flight.run.lost {
                                Some(lost) => td.lost colspan="4" { (words::lost(lost)) },
                                None => @for cell in block.cells(flight) { td { (cell) } },
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the parameters that determine the flight.
pub(super) fn parameters(scenario: &Scenario) -> Markup {
    let vehicle = &scenario.vehicle;
    let inertia = &vehicle.inertia_kg_m2;
    let fixed = [
        ("mass m", format!("{} kg", vehicle.mass_kg)),
        ("arm l", format!("{} m", vehicle.arm_m)),
        ("inertia Ix, Iy, Iz", format!("{}, {}, {} kg m²", inertia.x, inertia.y, inertia.z)),
        ("rotor inertia Ir", format!("{:e} kg m²", vehicle.rotor_inertia_kg_m2)),
        ("thrust factor b", format!("{:e} N s²", vehicle.thrust_factor_n_s2)),
        ("drag factor d", format!("{:e} N m s²", vehicle.drag_factor_n_m_s2)),
        ("gravity g", format!("{} m/s²", vehicle.gravity_m_s2)),
        ("start", start(scenario)),
        ("reference", trajectory(&scenario.trajectory)),
    ];
    let until = |end_s: f64| if end_s < scenario.duration_s { format!("to {end_s} s") } else { "on".into() };
    html! {
        div.scroll { table {
            tbody { @for (name, value) in fixed { tr { td { (name) } td.prose { (value) } } } }
            tbody {
                @for gust in scenario.environment.gusts() {
                    @let (letter, index) = words::gust(gust);
                    tr {
                        td { "gust " (letter) sub { (index) } }
                        td.prose {
                            (gust.size) " " (words::gust_unit(gust)) " from " (gust.start_s) " s " (until(gust.end_s))
                        }
                    }
                }
                @for change in scenario.environment.changes() {
                    tr {
                        td { (words::change(change)) }
                        td.prose { "from " (change.start_s) " s " (until(change.end_s)) }
                    }
                }
                @for payload in scenario.environment.payloads() {
                    tr {
                        td { "payload " (words::payload(payload)) }
                        td.prose { (words::place(payload)) ", from " (payload.start_s) " s " (until(payload.end_s)) }
                    }
                }
                @for (name, value) in reality::rows(scenario) { tr { td { (name) } td.prose { (value) } } }
            }
        } }
        @for contender in &scenario.contenders { (gains(contender)) }
    }
}

/// Returns settings and gains of a contender.
fn gains(contender: &Contender) -> Markup {
    let Settings {
        common: afbc_control::Settings { dt_s, rotor_force_max_n, raised_thrust_max, drag: _ },
        command_filter_rad_s,
        forward_rad_s,
        limits,
        tilt_by_thrust,
        freeze_on_ground,
        bumpless,
        anti_windup,
        feed_forward,
        by_rotation,
        disturbance,
        reference,
        smoothing,
    } = contender.settings;
    let mut settings = format!("steps of {dt_s} s, at most {rotor_force_max_n} N a rotor");
    if raised_thrust_max < afbc_control::Settings::RAISE_MAX.range.max as f32 {
        settings += &format!(", thrust raised to at most {raised_thrust_max} times the weight for roll and pitch");
    }
    if contender.kind().in_cascade() {
        settings += &format!(", command filter {command_filter_rad_s} rad/s");
        let also = [
            (tilt_by_thrust, "tilt by thrust"),
            (freeze_on_ground, "adaptation frozen on the ground"),
            (bumpless, "bumpless"),
            (anti_windup, "anti-windup"),
            (feed_forward, "feed-forward"),
            (by_rotation, "attitude errors by rotation"),
            (contender.monitored, "monitored"),
        ];
        settings.extend(also.into_iter().filter(|(on, _)| *on).map(|(_, word)| format!(", {word}")));
        if feed_forward {
            settings += &format!(", jumps of the jerk fed forward at {forward_rad_s} rad/s");
        }
        if limits != PositionControlLimits::NONE {
            settings += &format!(
                ", limits: tilt {} rad, tilt rate {} rad/s, acceleration {} m/s², speed {} m/s, climb rate {} m/s",
                limits.tilt_max_rad,
                limits.tilt_rate_max_rad_s,
                limits.acceleration_max_m_s2,
                limits.speed_max_m_s,
                limits.climb_max_m_s
            );
        }
        if contender.kind() == ControllerKind::Afbc && disturbance.disturbance_rad_s > 0.0 {
            settings += &format!(", disturbance observer {} rad/s", disturbance.disturbance_rad_s);
        }
        if reference != ReferenceModel::DEFAULT {
            settings += &format!(
                ", reference model: {} rad/s for x and y, {} z, {} yaw, {} m/s²",
                reference.reference_xy_rad_s,
                reference.reference_z_rad_s,
                reference.reference_yaw_rad_s,
                reference.reference_acceleration_m_s2
            );
        }
        if smoothing != Smoothing::DEFAULT {
            settings += &format!(
                ", filters: {} rad/s for U1 and U2, {} U3, {} U4, lead {} s",
                smoothing.smooth_tilt_rad_s, smoothing.smooth_yaw_rad_s, smoothing.smooth_lift_rad_s, smoothing.lead_s
            );
        }
    }
    html! {
        h3 { (capitalised(contender.title())) }
        p.quiet { (contender.kind().title()) ", " (settings) "." }
        @match &contender.law {
            Law::Afbc(gains) => (per_axis(&AFBC_GAINS, gains)),
            Law::Backstepping(gains) => (per_axis(&["α₁", "α₂", "c"], gains)),
            law => (by_name(law)),
        }
    }
}

/// Column heads of AFBC's gains.
const AFBC_GAINS: [&str; 11] = ["α₁", "α₂", "c", "γ", "η", "ε", "centre", "width", "σ", "Θ max", "δ max"];

fn per_axis<G: Declared>(names: &[&str], gains: &PerAxis<G>) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { td { "subsystem" } @for name in names { th scope="col" { (name) } } } }
            tbody { @for axis in Axis::ALL { tr {
                td { (axis.name()) }
                @for (_, gain) in listed(&gains[axis]) { td { (gain) } }
            } } }
        } }
    }
}

fn by_name(law: &Law) -> Markup {
    html! { div.scroll { table { tbody {
        @for (name, gain) in listed(law) { tr { td { code { (name) } } td { (gain) } } }
    } } } }
}

/// Returns the name and value of each gain.
fn listed(gains: &impl Declared) -> Vec<(String, f32)> {
    let mut list = Vec::new();
    let Ok(()) = gains.visit(&mut |declaration, value| {
        if let DeclaredValue::Single([gain]) = value {
            let dot = if declaration.group.is_empty() { "" } else { "." };
            list.push((format!("{}{dot}{}", declaration.group, declaration.range.name), *gain));
        }
        Ok::<(), Infallible>(())
    });
    list
}

fn start(scenario: &Scenario) -> String {
    let (p, eta) = (&scenario.initial.position_m, &scenario.initial.attitude_rad);
    format!("({}, {}, {}) m, roll {}, pitch {}, yaw {} rad", p.x, p.y, p.z, eta.x, eta.y, eta.z)
}

fn trajectory(trajectory: &Trajectory) -> String {
    let place = |p: &nalgebra::Vector3<f64>| format!("({}, {}, {}) m", p.x, p.y, p.z);
    match trajectory {
        Trajectory::Paper => "Section IV: a tilted ellipse from 2 m to 8 m height, once round in 60 s".into(),
        Trajectory::Hover { position_m, .. } => format!("hover at {}", place(position_m)),
        Trajectory::Step { from_m, to_m, at_s, .. } => {
            format!("step from {} to {} at {at_s} s", place(from_m), place(to_m))
        }
        Trajectory::Circle { centre_m, radius_m, period_s, .. } => {
            format!("circle of {radius_m} m around {}, once round in {period_s} s", place(centre_m))
        }
        Trajectory::Lissajous { centre_m, sines: [x, y, z], .. } => format!(
            "Lissajous around {} with amplitudes of {}, {}, {} m along x, y, z and periods of {}, {}, {} s",
            place(centre_m),
            x.amplitude_m,
            y.amplitude_m,
            z.amplitude_m,
            x.period_s,
            y.period_s,
            z.period_s
        ),
        Trajectory::Waypoints(waypoints) => format!("{} waypoints", waypoints.len()),
        Trajectory::Polynomials(pieces) => format!("a path of {} pieces", pieces.len()),
    }
}
