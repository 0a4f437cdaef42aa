//! Injects faults at the pins in flight, all from the same instant of one flight, and judges how each flight ends.

use crate::check::check;
use crate::fault_injection::{FaultContext, FaultOutcome};
use crate::fly::{TICK_NS, TwinFlight};
use crate::hover_snapshot::{HoverSnapshot, LinkEnds};
use crate::impairments::Impairments;
use crate::machine::{Machine, quiet_usb};
use crate::random::Xorshift;
use crate::table::{PinFault, ROWS};
use rigless::emulator::{Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::error::Error;

/// Range from which the start of a fault, after the flight resumes, is drawn [ns].
const BEGINS_NS: [u64; 2] = [50_000_000, 250_000_000];
/// Largest distance from its start at which a vehicle counts as flying on [m].
const OFF_M: f64 = 6.0;
/// Highest vertical speed at touch-down that counts as a landing [m/s].
const TOUCH_M_S: f64 = 2.0;
/// Time within which a descending vehicle must have landed [ms].
const LANDS_MS: u64 = 45_000;

/// Flight with a fault.
struct FaultFlight {
    flight: TwinFlight,
    link: LinkEnds,
    row: &'static PinFault,
    impairments: Impairments,
    random: Xorshift,
    begins_ns: u64,
    ends_ns: u64,
    /// Time at which an undecided flight counts as lost.
    last_ns: u64,
    looks: u64,
    kept: u64,
    start_m: [f64; 3],
    off_m: f64,
    tilt_rad: f64,
    /// Downward speed at touch-down.
    touch_m_s: Option<f64>,
    outcome: Option<FaultOutcome>,
}

impl FaultFlight {
    fn new(flight: TwinFlight, link: LinkEnds, now_ns: u64, row: &'static PinFault, seed: u64) -> Self {
        let mut random = Xorshift::new(seed, row.name);
        let begins_ns = now_ns + BEGINS_NS[0] + random.below(BEGINS_NS[1] - BEGINS_NS[0]);
        let start_m = flight.pilot.motion().position_m.into();
        FaultFlight {
            flight,
            link,
            row,
            impairments: Impairments::default(),
            random,
            begins_ns,
            ends_ns: begins_ns + row.watch_ms * TICK_NS,
            last_ns: begins_ns + LANDS_MS * TICK_NS,
            looks: 0,
            kept: 0,
            start_m,
            off_m: 0.0,
            tilt_rad: 0.0,
            touch_m_s: None,
            outcome: None,
        }
    }

    /// Judges the vehicle's motion; returns true once its outcome is decided.
    fn judge(&mut self, now_ns: u64) -> bool {
        let pilot = &self.flight.pilot;
        let motion = pilot.motion();
        let [x, y, z]: [f64; 3] = motion.position_m.into();
        let [start_x, start_y, start_z] = self.start_m;
        self.off_m = self.off_m.max((x - start_x).hypot(y - start_y).hypot(z - start_z));
        self.tilt_rad = self.tilt_rad.max(motion.attitude_rad.x.hypot(motion.attitude_rad.y));
        if z < 0.1 {
            self.touch_m_s.get_or_insert(-motion.velocity_m_s.z);
        }
        let touched_hard = self.touch_m_s.is_some_and(|touch_m_s| touch_m_s > TOUCH_M_S);
        self.outcome = if self.tilt_rad > 1.5 || touched_hard || self.off_m > 50.0 {
            Some(FaultOutcome::Lost)
        } else if self.touch_m_s.is_some() && !pilot.armed() {
            Some(FaultOutcome::Lands)
        } else if now_ns < self.ends_ns {
            None
        } else if (z - start_z).abs() < 2.0 && self.off_m < OFF_M && pilot.armed() {
            Some(FaultOutcome::FliesOn)
        } else if now_ns > self.last_ns {
            Some(FaultOutcome::Lost)
        } else {
            None
        };
        self.outcome.is_some()
    }
}

impl<M: Machine> Driver<M> for FaultFlight {
    fn on_settled(&mut self, session: &mut Session<M>, host: &mut dyn Host, settled: Settled) {
        self.flight.on_settled(session, host, settled);
        let (at, instructions) = match settled {
            Settled::Access { access, .. } => (access.virtual_time, access.instruction_count),
            Settled::Stop(stop) => (stop.at, stop.instruction_count),
            _ => return,
        };
        let Some(since_ns) = at.0.checked_sub(self.begins_ns) else { return };
        let before = self.impairments;
        (self.row.act)(&mut FaultContext {
            target: session,
            host,
            link: &self.link,
            impairments: &mut self.impairments,
            random: &mut self.random,
            at,
            instructions,
            since_ns,
            looks: self.looks,
            kept: &mut self.kept,
        });
        self.looks += 1;
        if self.impairments != before {
            session.board_mut().impair(&self.impairments);
        }
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        self.flight.hear_pulses(session);
        quiet_usb(session, stop.at);
        self.link.pass();
        let (_, signals) = self.flight.pilot.watch(stop.at.0 / TICK_NS);
        let board = session.board_mut();
        // The fault's start, which depends on the seed, seeds the noise, so that a repeated flight has the same noise.
        board.draw(self.begins_ns, stop.at.0 / TICK_NS);
        board.sense(&signals);
        (!self.judge(stop.at.0)).then_some(VirtualNanos(stop.at.0 + TICK_NS))
    }
}

/// Flies one fault, and returns whether the outcome is at least as good as expected.
fn fly<M: Machine>(hover: &HoverSnapshot<M>, row: &'static PinFault, seed: u64) -> Result<bool, Box<dyn Error>> {
    let finished = hover.resume(|flight, link, now_ns| FaultFlight::new(flight, link, now_ns, row, seed))?;
    let session = &finished.session;
    let FaultFlight { flight, begins_ns, off_m, tilt_rad, touch_m_s, outcome, .. } = finished.driver;
    let begins_ms = begins_ns / TICK_NS;
    let heard: Vec<_> = flight.pilot.heard().iter().filter(|(ms, _)| *ms >= begins_ms).collect();
    let outcome = outcome.unwrap_or(FaultOutcome::Lost);
    let expected = row.expected(M::IMUS.len());
    let is_well = outcome >= expected;
    let touch = touch_m_s.map_or(String::new(), |touch_m_s| format!(", touches the ground at {touch_m_s:.1} m/s"));
    println!(
        "{} {}, {}, at {:.6} s: {outcome}, expected {expected}; off by {off_m:.2} m, tilt {tilt_rad:.2} rad{touch}",
        if is_well { "pass" } else { "FAIL" },
        row.name,
        row.what,
        begins_ns as f64 * 1e-9
    );
    for (ms, text) in heard {
        println!("     {:.3} s: {text}", *ms as f64 * 1e-3);
    }
    for reset in session.resets() {
        println!("     reset at {:.6} s: {:?}", reset.at.0 as f64 * 1e-9, reset.cause);
    }
    for told in session.told() {
        println!("     the models say: {} {}: {}", told.instance, told.register, told.reason);
    }
    let wrong = &flight.pins.wrong;
    if !wrong.is_empty() {
        println!("     motors: {wrong:?}");
    }
    Ok(is_well)
}

/// Flies all faults, or those whose names begin with one of `names`. Fails if an outcome is worse than expected. With
/// `in_turn`, each seed flies only one fault, the next seed the next one.
pub fn fly_all<M: Machine>(
    hover: &HoverSnapshot<M>,
    seeds: std::ops::Range<u64>,
    names: &[&str],
    in_turn: bool,
) -> Result<(), Box<dyn Error>> {
    let (mut flown, mut failed) = (0, Vec::new());
    let is_wanted = |row: &&PinFault| names.is_empty() || names.iter().any(|name| row.name.starts_with(name));
    let (rows, left_out): (Vec<&'static PinFault>, Vec<_>) =
        ROWS.iter().filter(is_wanted).partition(|row| row.imus <= M::IMUS.len());
    for row in left_out {
        println!("skipped {}, {}: the board has no such part", row.name, row.what);
    }
    for seed in seeds {
        let turn = (seed as usize).checked_rem(rows.len()).unwrap_or_default();
        for (_, row) in rows.iter().enumerate().filter(|(place, _)| !in_turn || *place == turn) {
            flown += 1;
            if !fly(hover, row, seed)? {
                failed.push(format!("{} with seed {seed}", row.name));
            }
        }
    }
    println!("{flown} flights with a fault");
    check(flown > 0, "there is a fault of this name")?;
    check(failed.is_empty(), &failed.join(", "))
}
