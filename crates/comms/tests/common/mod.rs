//! The firmware without its hardware, and stations that communicate with it.

use afbc_comms::services::modes;
use afbc_comms::{Comms, REPORT_MAX};
use afbc_guidance::FlightMode;
use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, Uplink, VehicleCommand};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Configuration, ControlInputs, Flight, Prepared, Readings, Report};
use afbc_types::{PoseSigmas, Setpoint, State};

pub const STATION: Address = Address { system: 255, component: 190 };

pub struct Bench {
    pub flight: Flight,
    pub comms: Comms,
    /// Decoder of the stations' stream to the vehicle.
    pub uplink: Decoder<Uplink>,
    pub table: ParameterTable,
    /// Changes of the table so far.
    pub changes: Vec<RecordChange>,
    pub inputs: ControlInputs,
    pub taken: ControlInputs,
    decoder: Decoder<Downlink>,
    pub now_us: u64,
}

impl Bench {
    pub fn new() -> Self {
        Bench {
            flight: Flight::new(&Configuration::default()).expect("valid"),
            comms: Comms::new(),
            uplink: Comms::new().decoder(),
            table: ParameterTable::new(Configuration::default()),
            changes: Vec::new(),
            inputs: ControlInputs::EMPTY,
            taken: ControlInputs::EMPTY,
            decoder: Decoder::new(STATION),
            now_us: 0,
        }
    }

    /// Returns an armed vehicle that has been flying long enough to be airborne.
    pub fn flying() -> Self {
        let mut bench = Bench::new();
        for tick in 0..2000 {
            if tick == 1100 {
                bench.follow();
                bench.hear(Uplink::Command(VehicleCommand::Arm));
            }
            assert_eq!(bench.tick(&State::default()).0.mode.armed(), tick >= 1100);
        }
        bench
    }

    /// Selects Offboard mode.
    pub fn follow(&mut self) {
        self.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Offboard))));
    }

    /// Receives `message` from `from`.
    pub fn hear_from(&mut self, from: Address, message: Uplink) {
        self.hear_bytes(Encoder::new(from).send(&message, &mut [0; FRAME_MAX]));
    }

    /// Receives bytes, and returns the new inputs.
    pub fn receive(&mut self, bytes: &[u8]) -> ControlInputs {
        self.comms.receive(&mut self.uplink, bytes)
    }

    pub fn hear_bytes(&mut self, bytes: &[u8]) {
        let update = self.receive(bytes);
        self.inputs.merge(&update);
    }

    pub fn hear(&mut self, message: Uplink) {
        self.hear_from(STATION, message);
    }

    /// Receives this state with some noise.
    pub fn measure(&mut self, state: &State) {
        // A tracker never repeats a state exactly.
        let mut state = *state;
        state.position_m.z += (self.now_us % 1_000_000) as f32 * 1e-12;
        self.hear(Uplink::State { sent_us: self.now_us, state, sigmas: PoseSigmas::UNKNOWN });
    }

    /// Runs a tick with the received inputs. Returns its report and all messages.
    pub fn step(&mut self) -> (Report, Vec<Downlink>) {
        self.sense(&Readings::NONE)
    }

    /// Runs a tick with the received inputs and these sensor readings. Returns its report and all messages.
    pub fn sense(&mut self, readings: &Readings) -> (Report, Vec<Downlink>) {
        self.now_us += 1000;
        self.inputs.take_into(&mut self.taken);
        let report = self.flight.tick(self.now_us, &mut self.taken, readings);
        (report, self.said(&report))
    }

    /// Runs a tick in which this state is received. Returns its report, its answers and its texts.
    pub fn tick(&mut self, state: &State) -> (Report, Vec<Downlink>) {
        self.measure(state);
        self.hear(Uplink::Setpoint(Setpoint::default()));
        let (report, mut said) = self.step();
        said.retain(|message| matches!(message, Downlink::CommandAck { .. } | Downlink::Text { .. }));
        (report, said)
    }

    /// Returns the messages after a tick with this report. Checks that they fit the firmware's buffer and can be
    /// decoded.
    pub fn said(&mut self, report: &Report) -> Vec<Downlink> {
        let (mut messages, mut length, mut frames) = (Vec::new(), 0, 0);
        let Bench { flight, comms, table, changes, decoder, .. } = self;
        let mut send = |bytes: &[u8]| {
            (length, frames) = (length + bytes.len(), frames + 1);
            decoder.feed_accepted(bytes, |_| true, |_, message| messages.push(message));
        };
        comms.report(report, 0.0, &mut send);
        if let Some(change) = comms.parameters(table, &mut send) {
            assert!(flight.adopt(&Prepared::new(table.configuration()).expect("checked")), "changed while armed");
            changes.push(change);
        }
        assert!(length <= REPORT_MAX, "{length} bytes");
        assert_eq!(messages.len(), frames);
        messages
    }
}
