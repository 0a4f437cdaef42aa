//! `sitl hitl`: flies a real board over a serial port.

use super::in_the_loop::{InTheLoopArgs, LoopRecorder, outcome};
use super::target::TargetArg;
use super::terminal::{CommandError, print};
use crate::serial::{self, SerialBoard};
use afbc_hil::{LoopEnd, MessagePeriods, Station};
use afbc_onboard::BAUD;
use afbc_sim::flight::Sample;
use clap::Args;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Fly a real board over a serial port, in real time
///
/// The board flies a simulated vehicle, but ITS MOTOR OUTPUTS ARE LIVE: remove the propellers, or leave the motors
/// unpowered. Ctrl-C disarms. See docs/hitl.md.
#[derive(Args, Debug)]
pub(crate) struct HitlArgs {
    /// Name of a built-in scenario, or path of a scenario file
    #[arg(default_value = "paper")]
    scenario: TargetArg,

    /// Serial port of the board
    #[arg(long, value_name = "DEVICE", required_unless_present = "list")]
    port: Option<String>,

    /// Baud rate of the port; the firmware uses 460800, unless its parameter SER_TEL1_BAUD sets another rate
    #[arg(long, value_name = "N", default_value_t = BAUD)]
    baud: u32,

    /// Only list the serial ports
    #[arg(long)]
    list: bool,

    #[command(flatten)]
    flying: InTheLoopArgs,
}

impl HitlArgs {
    /// Flies and prints the results.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let Some(port) = self.port.filter(|_| !self.list) else {
            let ports = serial::ports()?;
            print(&if ports.is_empty() { "no serial port\n".into() } else { ports.join("\n") + "\n" })?;
            return Ok(ExitCode::SUCCESS);
        };
        let scenario = self.flying.scenario(&self.scenario)?;
        let pace = MessagePeriods::at(self.baud)?;
        let output = self.flying.output()?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopper = Arc::clone(&stop);
        ctrlc::set_handler(move || stopper.store(true, Ordering::Relaxed))?;
        let mut serial = SerialBoard::open(&port, self.baud)?;
        let mut recorder = LoopRecorder::new(&scenario, output.as_ref())?;
        print(&format!(
            "{}: {} s in real time; {} baud carry a state every {} ms ({:.0} Hz), a setpoint every {} ms\n",
            scenario.name,
            scenario.duration_s,
            self.baud,
            pace.state_ms,
            pace.state_hz(),
            pace.setpoint_ms,
        ))?;

        let mut station = Station::new();
        let observe = |sample: &Sample| match recorder.observe(sample) {
            ControlFlow::Continue(()) if !stop.load(Ordering::Relaxed) => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        };
        let end = afbc_hil::fly(&scenario, &mut station, &mut serial, pace, observe)?;
        let late_ms = serial.late_max().as_secs_f64() * 1e3;
        let metrics = recorder.finish()?;

        print(&format!(
            "\n{}simulator            {late_ms:.1} ms behind real time at most\n\n{}",
            figures(&station),
            outcome(&scenario, &metrics, &end)?,
        ))?;
        let LoopEnd { lost, interrupted, disarmed } = end;
        Ok(ExitCode::from(u8::from(lost.is_some() || interrupted || !disarmed)))
    }
}

/// Formats the statistics of link and board.
fn figures(station: &Station) -> String {
    let (here, heard, round_trip) = (station.counters(), station.heard(), station.round_trip_ms());
    let health = heard.health.unwrap_or_default();
    let there = health.link;
    let [min, mean, max] = [round_trip.min(), round_trip.mean(), round_trip.max()];
    format!(
        "messages from board  {} received, {} lost, {} corrupt\n\
         messages to board    {} received, {} lost, {} corrupt\n\
         round trip           min {min:.1}, mean {mean:.1}, max {max:.1} ms of {} pings, {} unanswered\n\
         state age on board   {:.1} ms at most, sampled 10 times per second\n\
         control tick         {:.1} us at most, {:.0} Hz, {} late, {} with a saturated rotor\n",
        here.received,
        here.lost,
        here.bad_checksum,
        there.received,
        there.lost,
        there.bad_checksum,
        round_trip.count(),
        station.unanswered(),
        heard.state_age_max_us * 1e-3,
        health.tick_max_us,
        health.rate_hz,
        health.late_ticks,
        health.saturated_ticks,
    )
}
