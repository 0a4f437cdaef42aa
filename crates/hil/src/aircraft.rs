//! The flying part of a host: a vehicle with any number of rotors, its law and its parameters.

use crate::host_black_box::{HostBlackBox, Sink};
use crate::metadata::MetadataFiles;
use afbc::AdaptiveEstimate;
use afbc_calibration::RawSample;
use afbc_comms::{Calibrator, Comms, EscAction, EscReports, EscsHeard, RadioControl};
use afbc_log::exact::Recorder;
use afbc_log::ulog::{BlackBox, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{
    Configuration, ControlInputs, EscTelemetry, Flight, ImuSelector, Link, Prepare, Readings, Report, TickBefore,
    TickDetails, TickInputs, TickRecord,
};
use afbc_scenario::{AnyController, FlownLaw};
use afbc_store::RecordName;
use afbc_types::{OutOfRange, PerAxis, ROTORS_MAX};

/// The writer of the exact log, and the receiver of its bytes.
pub(crate) struct ExactLog {
    pub(crate) recorder: Recorder,
    pub(crate) write: Sink,
}

/// Interface to a vehicle with any number of rotors.
pub(crate) trait Core {
    fn tick(
        &mut self,
        now_us: u64,
        inputs: &mut ControlInputs,
        readings: &Readings,
        exchange: Exchange<'_>,
    ) -> (Report<ROTORS_MAX>, EscAction);

    fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings);

    /// Advances a calibration, and sends stations the sensors' readings.
    fn calibrate(
        &mut self,
        comms: &mut Comms,
        calibrator: &mut Calibrator,
        sample: Option<RawSample>,
        send: &mut dyn FnMut(&[u8]),
    );

    /// Takes bytes from a radio receiver. Returns the pilot's inputs.
    fn pilot(&mut self, comms: &mut Comms, radio: &mut RadioControl, bytes: &[u8]) -> Option<ControlInputs>;

    /// Executes the stations' parameter requests, and flies with a changed parameter.
    fn parameters(&mut self, comms: &mut Comms, send: &mut dyn FnMut(&[u8])) -> Option<RecordChange>;

    /// Begins the black box's log.
    fn black_box(&self, start: &LogStart<'_>) -> BlackBox;

    /// Returns the metadata of the vehicle with this name.
    fn metadata(&self, vehicle: &str) -> MetadataFiles;
    /// Returns name and value of every parameter.
    fn parameter_values(&self) -> Vec<(RecordName, f32)>;
    /// Returns the state before a tick that logs need ([`Flight::before`]).
    fn before(&self, messages: &ControlInputs) -> TickBefore;
    /// Returns the details of the last tick for logs ([`Flight::details`]).
    fn details(&self, inputs: &TickInputs, before: &TickBefore, messages: &ControlInputs) -> TickDetails;
    /// Returns AFBC's estimates, if AFBC flies.
    fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>>;
    /// Changes to this law, or to the firmware's own.
    fn change_law(&mut self, law: FlownLaw) -> Result<(), OutOfRange>;

    /// Logs the last tick, and a parameter change after it.
    fn log(
        &self,
        black_box: &mut HostBlackBox,
        tick: &TickRecord<'_, ROTORS_MAX>,
        escs: &EscTelemetry,
        change: Option<RecordChange>,
    );

    /// Records the start, or a parameter change. Returns the number of the new configuration.
    fn record(&self, log: &mut ExactLog, names: &[String; 2], change: Option<RecordChange>) -> Option<u16>;
}

/// A vehicle with its law and parameters.
pub(crate) struct Aircraft<const N: usize> {
    pub(crate) flight: Flight<N, AnyController<N>>,
    pub(crate) table: ParameterTable<N>,
    pub(crate) law: FlownLaw,
    /// Telemetry from the motor controllers' line.
    pub(crate) escs: EscReports,
}

/// Connections of a tick to stations and motor controllers, and the tick's duration.
pub(crate) struct Exchange<'a> {
    pub(crate) comms: &'a mut Comms,
    pub(crate) tick_us: f32,
    pub(crate) send: &'a mut dyn FnMut(&[u8]),
    /// Data received from the motor controllers.
    pub(crate) escs: EscsHeard<'a>,
}

impl<const N: usize> Core for Aircraft<N> {
    fn tick(
        &mut self,
        now_us: u64,
        inputs: &mut ControlInputs,
        readings: &Readings,
        exchange: Exchange<'_>,
    ) -> (Report<ROTORS_MAX>, EscAction) {
        let report = self.flight.tick(now_us, inputs, readings);
        exchange.comms.report(&report, exchange.tick_us, exchange.send);
        let action = exchange.comms.escs(&mut self.escs, &exchange.escs, &report);
        // Applied between two ticks, as on the board: the next tick is the first with the new notch.
        action.notch.iter().for_each(|notch| self.flight.move_notch(notch));
        (report.padded(), action)
    }

    fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings) {
        self.flight.cross_check(selector, readings);
    }

    fn calibrate(
        &mut self,
        comms: &mut Comms,
        calibrator: &mut Calibrator,
        sample: Option<RawSample>,
        send: &mut dyn FnMut(&[u8]),
    ) {
        comms.calibrate(calibrator, sample, &self.table, send);
    }

    fn pilot(&mut self, comms: &mut Comms, radio: &mut RadioControl, bytes: &[u8]) -> Option<ControlInputs> {
        comms.pilot(radio, bytes, &self.table.configuration().radio)
    }

    fn parameters(&mut self, comms: &mut Comms, send: &mut dyn FnMut(&[u8])) -> Option<RecordChange> {
        let Aircraft { flight, table, law, escs } = self;
        let change = comms.parameters(table, send)?;
        escs.adopt(table.configuration());
        // Adopted at once, because the vehicle is disarmed and each change has been checked.
        let adopted = law.prepare(table.configuration()).is_ok_and(|prepared| flight.adopt(&prepared));
        debug_assert!(adopted, "a change that is not flown");
        Some(change)
    }

    fn black_box(&self, start: &LogStart<'_>) -> BlackBox {
        BlackBox::new(start, &self.table)
    }

    fn metadata(&self, vehicle: &str) -> MetadataFiles {
        MetadataFiles::new(vehicle, &self.table)
    }

    fn parameter_values(&self) -> Vec<(RecordName, f32)> {
        self.table.iter().map(|parameter| (parameter.name, parameter.value)).collect()
    }

    fn details(&self, inputs: &TickInputs, before: &TickBefore, messages: &ControlInputs) -> TickDetails {
        self.flight.details(inputs, before, messages)
    }

    fn before(&self, messages: &ControlInputs) -> TickBefore {
        self.flight.before(messages)
    }

    fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        self.flight.law_memory()?.estimates()
    }

    fn change_law(&mut self, law: FlownLaw) -> Result<(), OutOfRange> {
        let prepared = law.prepare(self.table.configuration())?;
        self.flight.change_law(&prepared);
        self.law = law;
        Ok(())
    }

    fn log(
        &self,
        black_box: &mut HostBlackBox,
        tick: &TickRecord<'_, ROTORS_MAX>,
        escs: &EscTelemetry,
        change: Option<RecordChange>,
    ) {
        black_box.tick(tick, escs, &self.table);
        if let Some(change) = change {
            black_box.change(&self.table, change);
        }
    }

    fn record(
        &self,
        ExactLog { recorder, write }: &mut ExactLog,
        [vehicle, law]: &[String; 2],
        change: Option<RecordChange>,
    ) -> Option<u16> {
        match change {
            None => {
                recorder.start([vehicle, law], &self.as_built(), write);
                None
            }
            Some(change) => Some(recorder.change(&self.table, change, write)),
        }
    }
}

impl<const N: usize> Aircraft<N> {
    /// Returns the parameters relative to a firmware image whose link has the declared defaults.
    fn as_built(&self) -> ParameterTable<N> {
        let mut image = self.table.clone();
        image.restore();
        let image = Configuration { link: Link::DEFAULT, ..image.configuration().clone() };
        let mut table = ParameterTable::new(image);
        for parameter in self.table.iter() {
            // Accepted, because the values are in their ranges already.
            let _ = table.put(parameter.name, parameter.value);
        }
        table
    }
}
