//! Single and combined faults of the server's vehicle: the end of the flight, the announcements, and the rules that
//! hold at every tick. Compares the table of `docs/reference/safety.md`, or writes it with `WRITE=1`. `CASE=fence`
//! shows the cases with that name only.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs)] // a failed flight stops it

use crate::airborne::checker::End;
use crate::airborne::{Checker, STATION, Session, Tick, on_all_cores};
use crate::safety_cases::{Case, Do, Start, cases};
use afbc_guidance::FlightMode;
use afbc_mavlink::{Datum, Height, Uplink, VehicleCommand};
use std::{env, fs};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/reference/safety.md");
const BEGIN: &str = "<!-- safety net: tests/tests/safety_net.rs -->\n";
const ENDS: &str = "<!-- end of the safety net -->\n";

/// Number of seeds of every case.
const SEEDS: u64 = 2;
/// Longest duration of a take-off \[s\].
const TAKEN_OFF_S: f64 = 20.0;
/// Parameters of every flight: a station counts as lost after 2 s, and the return height is 5 m above home.
const COMMON: [(&str, f32); 2] = [("COM_DL_LOSS_T", 2.0), ("RTL_RETURN_ALT", 5.0)];

/// Result of a flight.
struct Outcome {
    checker: Checker,
    end: End,
    /// Texts heard since the beginning of the case.
    heard: Vec<String>,
}

fn fly(case: &Case, seed: u64) -> Outcome {
    let mut session = Session::new(case.indoors, seed);
    let set = |name: &str| case.set.iter().find(|(it, _)| *it == name).map(|(_, value)| *value);
    for (name, value) in COMMON.iter().filter(|(name, _)| set(name).is_none()).chain(&case.set) {
        session.set(name, *value);
    }
    case.before.iter().for_each(|it| act(&mut session, it));
    let acts = set("NAV_DLL_ACT") != Some(0.0);
    let mut checker = Checker::new(case.bounds, set("COM_DL_LOSS_T").unwrap_or(2.0), acts);
    let mut run = |session: &mut Session, until: &dyn Fn(&Tick, &Checker) -> bool, most_s: f64| {
        let end_s = session.time_s() + most_s;
        while session.time_s() < end_s {
            let tick = session.step();
            checker.see(&tick);
            if until(&tick, &checker) {
                return;
            }
        }
    };
    match case.start {
        Start::PowerUp => run(&mut session, &|_, _| false, 12.0),
        Start::Ground | Start::Air(_) => session.arm(|tick| checker.see(tick)),
    }
    if let Start::Air(metres) = case.start {
        let height = Height { metres, above: Datum::Here };
        session.say(STATION, Uplink::Command(VehicleCommand::TakeOff(height)));
        let mut run = |session: &mut Session, mode: FlightMode| {
            let end_s = session.time_s() + TAKEN_OFF_S;
            while session.time_s() < end_s && checker.mode() != mode {
                checker.see(&session.step());
            }
        };
        run(&mut session, FlightMode::Takeoff);
        run(&mut session, FlightMode::Hold);
    }
    let (begin_s, before) = (session.time_s(), checker.texts.len());
    let mut steps: Vec<_> = case.steps.iter().collect();
    steps.sort_by(|one, other| one.0.total_cmp(&other.0));
    for (at_s, it) in steps {
        while session.time_s() < begin_s + at_s - 1e-9 {
            checker.see(&session.step());
        }
        act(&mut session, it);
    }
    while session.time_s() < begin_s + case.lasts_s {
        checker.see(&session.step());
    }
    let end = checker.end();
    let heard = checker.texts.get(before..).unwrap_or_default().to_vec();
    Outcome { checker, end, heard }
}

fn act(session: &mut Session, it: &Do) {
    match it {
        Do::Say(from, message) => session.say(*from, *message),
        Do::Line(line) => session.line(line),
        Do::Silent(station) => session.reach(*station, false),
        Do::Back(station) => session.reach(*station, true),
        Do::Stream(target) => session.stream(STATION, *target),
        Do::Breaks(one_of) => session.breaks(STATION, *one_of),
        Do::Upload(items) => session.upload(STATION, items.clone()),
        Do::Noise(count) => {
            let bytes: Vec<u8> = (0..*count).map(|place| (place * place * 7 + place) as u8 | 0xf0).collect();
            session.noise(&bytes);
        }
    }
}

impl Outcome {
    /// Returns the rules and expectations that do not hold.
    fn complaints(&self, case: &Case) -> Vec<String> {
        let mut complaints = self.checker.complaints.clone();
        let mut heard = self.heard.iter();
        for wanted in &case.heard {
            if !heard.any(|text| text.contains(wanted)) {
                complaints.push(format!("not heard, or not then: {wanted}"));
            }
        }
        for never in &case.never {
            complaints
                .extend(self.heard.iter().filter(|text| text.contains(never)).map(|text| format!("heard: {text}")));
        }
        if self.end != case.end {
            complaints.push(format!("ends {:?}, not {:?}", self.end, case.end));
        }
        if let (Some(([x, y], within_m)), Some(truth)) = (case.near, self.checker.last()) {
            let off_m = (truth.position_m.x - x).hypot(truth.position_m.y - y);
            if off_m > within_m {
                complaints.push(format!("ends {off_m:.2} m from {x} {y}"));
            }
        }
        complaints
    }

    fn row(&self, case: &Case) -> String {
        let set: Vec<String> = case.set.iter().map(|(name, value)| format!("`{name}` {value}")).collect();
        let usual = |text: &&String| !text.ends_with(": ordered") && !text.ends_with(": disarmed");
        let heard: Vec<&str> = self.heard.iter().filter(usual).map(String::as_str).collect();
        let extremes = self.checker.extremes;
        let touch = extremes.touch_m_s.map_or(String::new(), |touch_m_s| format!("{touch_m_s:.1}"));
        let end = match self.end {
            End::Disarmed if case.bounds.cut => "falls, disarmed",
            End::Disarmed => "disarmed",
            End::Holds => "holds",
            End::Flies => "flies on",
            End::Lost => "lost",
        };
        let where_ = if case.indoors { "" } else { ", outdoors" };
        format!(
            "| `{}`: {}{where_} | {} | {} | {:.0} | {touch} | {:.1} | {:.1} | {end} |\n",
            case.name,
            case.what,
            set.join(", "),
            heard.join("; "),
            extremes.tilt_rad.to_degrees(),
            extremes.radius_m,
            extremes.height_m,
        )
    }
}

#[test]
fn every_fault_ends_as_the_page_says() {
    let cases = cases();
    assert!(cases.len() >= 60, "{}", cases.len());
    let only = env::var("CASE").ok();
    let wanted = |case: &&Case| only.as_ref().is_none_or(|only| case.name.contains(only.as_str()));
    let jobs: Vec<(&Case, u64)> =
        cases.iter().filter(wanted).flat_map(|case| (1..=SEEDS).map(move |seed| (case, seed))).collect();
    let flown = on_all_cores(&jobs, |(case, seed)| fly(case, *seed));
    let mut wrong = Vec::new();
    for ((case, seed), outcome) in jobs.iter().zip(&flown) {
        let complaints = outcome.complaints(case);
        if !complaints.is_empty() || only.is_some() {
            wrong.push(format!(
                "{}, seed {seed}: {complaints:#?}\n  heard {:?}\n  {:?} {:?} {:?}",
                case.name,
                outcome.heard,
                outcome.checker.extremes,
                outcome.end,
                outcome.checker.last()
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of {}\n{}", wrong.len(), jobs.len(), wrong.join("\n"));
    let rows = jobs.iter().zip(&flown).filter(|((_, seed), _)| *seed == 1);
    let rows: String = rows.map(|((case, _), outcome)| outcome.row(case)).collect();
    let head =
        "| fault | set | heard | tilt \\[deg\\] | touch-down \\[m/s\\] | farthest \\[m\\] | highest \\[m\\] | end |";
    let table = format!("{head}\n|---|---|---|--:|--:|--:|--:|---|\n{rows}");
    let page = fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (kept, after) = rest.split_once(ENDS).unwrap();
    if env::var_os("WRITE").is_some() {
        fs::write(PAGE, format!("{before}{BEGIN}{table}{ENDS}{after}")).unwrap();
    } else {
        assert_eq!(kept, table, "WRITE=1 writes it");
    }
}
