//! Wrong rate or timing of the control tick, or a failing clock: the pilot is told once, and arming is refused.

use afbc_comms::{CLOCK_FAILED, Comms, TICK_OFF};
use afbc_flight_core::{Mode, Refusal};
use afbc_mavlink::{Address, CommandResult, Decoder, Downlink, Encoder, FRAME_MAX, Uplink, VehicleCommand};
use afbc_onboard::{Configuration, ControlInputs, Flight};
use afbc_types::{PoseSigmas, Setpoint, State};

const STATION: Address = Address { system: 255, component: 190 };

/// The firmware with ticks of any period, a vehicle at rest and a setpoint.
struct Bench {
    flight: Flight,
    comms: Comms,
    uplink: Decoder<Uplink>,
    inputs: ControlInputs,
    taken: ControlInputs,
    sender: Encoder,
    decoder: Decoder<Downlink>,
    now_us: u64,
    mode: Mode,
    /// Texts sent so far.
    texts: Vec<String>,
    answers: Vec<CommandResult>,
}

impl Bench {
    fn new() -> Self {
        Bench {
            flight: Flight::new(&Configuration::default()).expect("valid"),
            comms: Comms::new(),
            uplink: Comms::new().decoder(),
            inputs: ControlInputs::EMPTY,
            taken: ControlInputs::EMPTY,
            sender: Encoder::new(STATION),
            decoder: Decoder::new(STATION),
            now_us: 0,
            mode: Mode::Disarmed,
            texts: Vec::new(),
            answers: Vec::new(),
        }
    }

    fn hear(&mut self, message: Uplink) {
        let update = self.comms.receive(&mut self.uplink, self.sender.send(&message, &mut [0; FRAME_MAX]));
        self.inputs.merge(&update);
    }

    /// Runs ticks with this period.
    fn run(&mut self, ticks: u32, period_us: u64) {
        for _ in 0..ticks {
            self.now_us += period_us;
            // States differ in each tick, like measurements.
            let mut state = State::default();
            state.position_m.z = 1e-6 * (self.now_us % 11) as f32;
            self.hear(Uplink::State { sent_us: self.now_us, state, sigmas: PoseSigmas::UNKNOWN });
            self.hear(Uplink::Setpoint(Setpoint::default()));
            self.inputs.take_into(&mut self.taken);
            let report = self.flight.tick(self.now_us, &mut self.taken, &afbc_onboard::Readings::NONE);
            self.mode = report.mode;
            let Bench { comms, decoder, texts, answers, .. } = self;
            let mut hear = |_: Address, message: Downlink| match message {
                Downlink::Text { text, .. } => texts.push(text.to_str().expect("text").to_owned()),
                Downlink::CommandAck { answer, .. } => answers.push(answer),
                _ => (),
            };
            comms.report(&report, 0.0, |bytes| decoder.feed(bytes, &mut hear));
        }
    }

    /// Returns the answer to an arm command.
    fn arm(&mut self) -> CommandResult {
        self.answers.clear();
        self.hear(Uplink::Command(VehicleCommand::Arm));
        self.run(1, 1000);
        *self.answers.first().expect("answered")
    }
}

#[test]
fn wrong_tick_timing_is_reported_and_does_not_end_the_flight() {
    let mut bench = Bench::new();
    bench.run(1100, 1000);
    assert_eq!(bench.arm(), CommandResult::Accepted);
    bench.run(500, 1000);
    assert_eq!(bench.texts, [""; 0]);

    // One tick is missing, and then every tick is 5 % late for two seconds.
    bench.run(1, 2000);
    assert_eq!(bench.texts, [TICK_OFF]);
    bench.run(2000, 1050);
    assert_eq!((bench.mode, bench.texts.len()), (Mode::Flying, 1), "reported once, and continues flying");

    bench.hear(Uplink::Command(VehicleCommand::Kill));
    bench.run(1, 1000);
    assert_eq!(bench.arm(), CommandResult::Refused(Refusal::Unhealthy as i32));
    bench.texts.clear();
    bench.run(3000, 1000);
    assert_eq!(bench.arm(), CommandResult::Accepted, "its timing is right again");
}

#[test]
fn a_failed_clock_is_reported_and_prevents_arming() {
    let mut bench = Bench::new();
    bench.run(1100, 1000);
    assert_eq!(bench.arm(), CommandResult::Accepted);
    bench.run(50, 1000);
    bench.flight.distrust_clock();
    bench.run(3000, 1000);
    assert_eq!(bench.texts, [CLOCK_FAILED]);
    assert_eq!(bench.mode, Mode::Flying);
    bench.hear(Uplink::Command(VehicleCommand::Kill));
    bench.run(3000, 1000);
    assert_eq!(bench.arm(), CommandResult::Refused(Refusal::Unhealthy as i32), "not until it is switched off and on");
}
