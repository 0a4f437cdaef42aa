//! Runs the firmware's code in this process.

use super::{Autopilot, Error};
use crate::host_black_box::{HostBlackBox, Sink};
use crate::metadata::MetadataFiles;
use crate::served_files::{OpenFile, ServedFiles};
use crate::simulated_escs::SimulatedEscs;
use crate::stored_logs::StoredLogs;
use afbc::AdaptiveEstimate;
use afbc_comms::services::signing::{Signing, SigningRecord};
use afbc_comms::{Calibrator, Comms, EscReports, EscsHeard, RadioControl, Setup, Transfers};
use afbc_estimator::GeodeticOrigin;
use afbc_files::FlashFile;
use afbc_flight_core::rate::PERIOD_US;
use afbc_log::exact::Recorder;
use afbc_log::ulog::{BlackBox, LogStart};
use afbc_mavlink::{Decoder, MissionItem, Uplink};
use afbc_onboard::parameters::{Kept, ParameterTable, Reason, RecordChange};
use afbc_onboard::{
    AnyFlight, Configuration, ControlInputs, ImuSelector, Link, RawReadings, Readings, Report, TickBefore, TickDetails,
    TickInputs, TickRecord,
};
use afbc_plant::Plant;
use afbc_scenario::FlownLaw;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_store::{RecordName, Store};
use afbc_types::{OutOfRange, PerAxis, ROTORS_MAX};
use afbc_vehicles::Vehicle;

/// The writer of the exact log, and the receiver of its bytes.
struct ExactLog {
    recorder: Recorder,
    write: Sink,
}

/// The firmware without its hardware, ticked in lockstep.
pub struct Host {
    flight: Box<AnyFlight<FlownLaw>>,
    table: ParameterTable,
    law: FlownLaw,
    /// Telemetry from the motor controllers' line.
    esc_reports: EscReports,
    setup: Setup,
    comms: Comms,
    /// Decoder of the host's own stream.
    decoder: Decoder<Uplink>,
    inputs: ControlInputs,
    /// Inputs that the last tick took from messages, and the state before that tick, for logs.
    taken: ControlInputs,
    before: TickBefore,
    /// Other inputs of the last tick.
    took: TickInputs,
    readings: Readings,
    radio: Box<RadioControl>,
    /// Bytes from the motor controllers' line since the last tick.
    escs: Vec<u8>,
    /// Rotor whose motor controller the last tick has asked for telemetry.
    asks_esc: Option<u8>,
    /// Electrical speeds in the motor controllers' answers \[rev/min\].
    answers_rev_min: [Option<u32>; ROTORS_MAX],
    simulated_escs: SimulatedEscs,
    calibrator: Box<Calibrator>,
    /// Sums of the sensors' readings, while a calibration needs them.
    raw: RawReadings,
    /// Known inputs of the next tick: its number, and changes since the last tick.
    next: TickInputs,
    /// The exact log, if it is kept.
    log: Option<ExactLog>,
    black_box: Option<HostBlackBox>,
    /// Geographic origin of the GNSS fixes, for logs.
    origin: Option<GeodeticOrigin>,
    /// File transfers and the served files, if files are served.
    files: Option<Box<(Transfers<OpenFile>, ServedFiles)>>,
    /// Names of vehicle and law.
    names: [String; 2],
}

/// Name of the vehicle of a host without a vehicle file.
const PAPER: &str = "paper";

/// Name of the hardware in the black box's log.
const HARDWARE: &str = "SITL";

/// Result of one control tick.
#[derive(Clone, Debug)]
pub struct HostTick {
    /// Report of the control tick.
    pub report: Report,
    /// Bytes sent over the link.
    pub bytes: Vec<u8>,
    /// A parameter change, to be stored.
    pub change: Option<RecordChange>,
    /// State of message signing, to be stored.
    pub signing: Option<SigningRecord>,
    /// Rotor, from 0, whose motor controller is asked for telemetry with this tick's frames.
    pub asks_esc: Option<u8>,
}

impl Host {
    /// Creates the firmware of the paper's vehicle, powered up and disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; does not occur.
    pub fn new() -> Result<Self, OutOfRange> {
        Self::linked(None, Link::DEFAULT)
    }

    /// Creates the firmware of this vehicle, powered up and disarmed.
    ///
    /// # Errors
    /// The first parameter out of range. Does not occur, for a vehicle is checked when its file is read.
    pub fn for_vehicle(vehicle: &Vehicle) -> Result<Self, OutOfRange> {
        Self::linked(Some(vehicle), Link::DEFAULT)
    }

    /// Creates the firmware of this vehicle, or of the paper's, with these defaults of the link's parameters.
    ///
    /// # Errors
    /// The same as for [`for_vehicle`](Self::for_vehicle).
    pub fn linked(vehicle: Option<&Vehicle>, link: Link) -> Result<Self, OutOfRange> {
        let Some(vehicle) = vehicle else {
            return Self::image(ParameterTable::new(Configuration { link, ..Configuration::default() }), PAPER);
        };
        Self::image(ParameterTable::new(Configuration { link, ..vehicle.configuration()? }), &vehicle.name)
    }

    /// Creates the firmware of this vehicle under another law, without a monitor. No firmware image has this law, but
    /// the other code is the same.
    ///
    /// # Errors
    /// The first parameter or gain out of range.
    pub fn under(vehicle: &Vehicle, law: Law) -> Result<Self, OutOfRange> {
        let table = ParameterTable::new(vehicle.configuration()?);
        Self::of(table, FlownLaw(Some(law)), [&vehicle.name, law.kind().name()])
    }

    /// Creates the firmware as [`linked`](Self::linked) does, with the parameters and the signing key from `store`.
    /// Calls `notice` with a line for each value that is not used. If the store cannot be read, defaults are used.
    ///
    /// # Errors
    /// The same as for [`for_vehicle`](Self::for_vehicle).
    pub fn stored(
        vehicle: Option<&Vehicle>,
        link: Link,
        store: &mut Store<FlashFile>,
        notice: &mut dyn FnMut(&str),
    ) -> Result<Self, OutOfRange> {
        let signing = Signing::kept(|name| store.get(name).ok().flatten().map(|(_, bits)| bits));
        let (configuration, name) = match vehicle {
            None => (Configuration::default(), PAPER),
            Some(vehicle) => (vehicle.configuration()?, vehicle.name.as_str()),
        };
        let mut host = Self::image(loaded(Configuration { link, ..configuration }, store, notice), name)?;
        host.comms.set_signing(signing);
        Ok(host)
    }

    /// Creates a host that corresponds to a firmware image.
    fn image(table: ParameterTable, vehicle: &str) -> Result<Self, OutOfRange> {
        Self::of(table, FlownLaw(None), [vehicle, ControllerKind::Afbc.name()])
    }

    fn of(table: ParameterTable, law: FlownLaw, names: [&str; 2]) -> Result<Self, OutOfRange> {
        let setup = Setup { calibrates: true, ..Setup::of(&table.configuration().link) };
        let comms = Comms::with(setup);
        Ok(Host {
            flight: Box::new(AnyFlight::new(&law, table.configuration())?),
            law,
            esc_reports: EscReports::new(table.configuration()),
            escs: Vec::new(),
            asks_esc: None,
            answers_rev_min: [None; ROTORS_MAX],
            simulated_escs: SimulatedEscs::new(table.configuration().escs.poles),
            table,
            setup,
            decoder: comms.decoder(),
            comms,
            inputs: ControlInputs::EMPTY,
            taken: ControlInputs::EMPTY,
            before: TickBefore::default(),
            took: TickInputs::default(),
            readings: Readings::NONE,
            radio: Box::default(),
            calibrator: Box::default(),
            raw: RawReadings::NONE,
            next: TickInputs::default(),
            log: None,
            black_box: None,
            origin: None,
            files: None,
            names: names.map(str::to_owned),
        })
    }

    /// Returns the setup of the link, at first as the parameters set it.
    pub fn setup(&self) -> Setup {
        self.setup
    }

    /// Changes the link's setup, as if the firmware had just been powered up.
    #[must_use]
    pub fn with(self, setup: Setup) -> Self {
        let mut comms = Comms::with(setup);
        comms.set_signing(self.comms.signing().clone());
        Host { setup, decoder: comms.decoder(), comms, ..self }
    }

    /// Returns true if messages need a signature.
    pub fn needs_signatures(&self) -> bool {
        self.comms.signing().is_on()
    }

    /// Returns the communication services.
    pub fn comms(&mut self) -> &mut Comms {
        &mut self.comms
    }

    /// Returns the items of the mission and of the geofence that stations have uploaded.
    pub fn plan(&self) -> [&[MissionItem]; 2] {
        self.comms.plan()
    }

    /// Returns the details of the last tick for logs.
    pub fn details(&self) -> TickDetails {
        self.flight.details(&self.took, &self.before, &self.taken)
    }

    /// Returns AFBC's estimates in the present or last flight, if AFBC flies.
    pub fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        self.flight.estimates()
    }

    /// Changes to this law from the next tick on, even while armed. None means the firmware's own law with its monitor.
    /// The new law starts as after arming. An exact log does not record the change.
    ///
    /// # Errors
    /// The first gain out of range. Then nothing has changed.
    pub fn change_law(&mut self, law: Option<Law>) -> Result<(), OutOfRange> {
        self.flight.change_law(&FlownLaw(law), self.table.configuration())?;
        self.law = FlownLaw(law);
        let [_, name] = &mut self.names;
        law.map_or(ControllerKind::Afbc, |law| law.kind()).name().clone_into(name);
        Ok(())
    }

    /// Returns name and value of every parameter.
    pub fn parameter_values(&self) -> Vec<(RecordName, f32)> {
        self.table.iter().map(|parameter| (parameter.name, parameter.value)).collect()
    }

    /// Returns the parameters' metadata files, as stations download them.
    pub fn metadata(&self) -> MetadataFiles {
        let [vehicle, _] = &self.names;
        MetadataFiles::new(vehicle, &self.table)
    }

    /// Starts an exact log ([`afbc_log::exact`]). Call it before the first tick. `write` gets the log's bytes.
    pub fn record(&mut self, write: impl FnMut(&[u8]) + 'static) {
        let mut log = ExactLog { recorder: Recorder::default(), write: Box::new(write) };
        let [vehicle, law] = &self.names;
        log.recorder.start([vehicle, law], &self.as_built(), &mut log.write);
        self.log = Some(log);
    }

    /// Returns the parameters relative to a firmware image whose link has the declared defaults.
    fn as_built(&self) -> ParameterTable {
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

    /// Starts a black box ([`afbc_log::ulog`]). Call it before the first tick. `write` gets the log's bytes. `origin`
    /// is the geographic origin of GNSS fixes, if it is known.
    pub fn log(&mut self, origin: Option<GeodeticOrigin>, write: impl FnMut(&[u8]) + 'static) {
        self.origin = origin;
        self.black_box = Some(new_black_box(&self.table, &self.names, origin, Some(Box::new(write))));
    }

    /// Starts to serve files to stations: the metadata, these logs, and a black box streamed as it is written. `origin`
    /// is as for [`log`](Self::log).
    pub fn serve_files(&mut self, origin: Option<GeodeticOrigin>, logs: Option<StoredLogs>) {
        self.origin = origin;
        let MetadataFiles { files, general } = self.metadata();
        self.files = Some(Box::new((Transfers::new(Some(general)), ServedFiles::new(logs, files))));
    }

    /// Merges inputs from messages, and records them.
    fn merge(&mut self, news: &ControlInputs) {
        self.inputs.merge(news);
        if let Some(ExactLog { recorder, write }) = &mut self.log {
            recorder.inputs(self.next.number, news, write);
        }
    }

    /// Receives bytes for the next tick from one of several streams. Each stream has its own decoder.
    pub fn hear(&mut self, decoder: &mut Decoder<Uplink>, bytes: &[u8]) {
        let news = received(&mut self.comms, decoder, bytes, self.files.as_deref_mut());
        self.merge(&news);
    }

    /// Receives bytes from a radio receiver for the next tick.
    pub fn hear_radio(&mut self, bytes: &[u8]) {
        if let Some(news) = self.comms.pilot(&mut self.radio, bytes, &self.table.configuration().radio) {
            self.merge(&news);
        }
    }

    /// Receives bytes from the motor controllers' line for the next tick ([`HostTick::asks_esc`]). They are ignored
    /// unless `DSHOT_TEL_CFG` is set.
    pub fn hear_escs(&mut self, bytes: &[u8]) {
        self.escs.extend_from_slice(bytes);
    }

    /// Lets simulated motor controllers answer the last tick's telemetry request, and its frames by bidirectional
    /// DSHOT, with the rotor speeds of `plant`. Replaces [`hear_escs`](Self::hear_escs).
    pub fn hear_simulated_escs(&mut self, plant: &Plant) {
        if let Some(answer) = self.simulated_escs.step(self.asks_esc.take(), plant) {
            self.hear_escs(&answer);
        }
        self.answers_rev_min = self.simulated_escs.answers_rev_min(plant);
    }

    /// Sets the readings of the vehicle's own sensors for the next tick only.
    pub fn sense(&mut self, readings: &Readings) {
        self.readings = *readings;
    }

    /// Cross-checks the inertial sensors after the last tick, which took these readings ([`sense`](Self::sense)).
    pub fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings) {
        self.flight.cross_check(selector, readings);
    }

    /// Runs one control tick at `time_us` since power-up, after the link has received `uplink`. The tick reports a
    /// duration of `tick_us`.
    pub fn tick(&mut self, uplink: &[u8], time_us: u64, tick_us: f32) -> HostTick {
        let news = received(&mut self.comms, &mut self.decoder, uplink, self.files.as_deref_mut());
        self.merge(&news);
        self.inputs.take_into(&mut self.taken);
        let (readings, battery) = (core::mem::take(&mut self.readings), self.taken.battery);
        self.took = TickInputs { time_us, readings, battery, ..self.next };
        self.before = self.flight.before(&self.taken);
        let mut bytes = Vec::new();
        let mut send = |frame: &[u8]| bytes.extend_from_slice(frame);
        let escs = core::mem::take(&mut self.escs);
        let heard = EscsHeard { bytes: &escs, speeds_rev_min: core::mem::take(&mut self.answers_rev_min) };
        let report = self.flight.tick(time_us, &mut self.taken, &readings);
        self.comms.report(&report, tick_us, &mut send);
        let action = self.comms.escs(&mut self.esc_reports, &heard, &report);
        // The notch moves between two ticks, as on the board. The next tick is the first with the new notch.
        action.notch.iter().for_each(|notch| self.flight.move_notch(notch));
        // The details are taken before anything in them changes.
        let details = (self.black_box.is_some() || self.files.is_some()).then(|| self.details());
        if let Some(ExactLog { recorder, write }) = &mut self.log {
            recorder.tick(&self.took, &report, write);
        }
        // The next tick is the first with the moved notch.
        let notch_rad_s = action.notch.map(|notch| notch.centre_rad_s());
        self.next = TickInputs { number: self.next.number, notch_rad_s, ..TickInputs::default() };
        if self.comms.takes_samples() {
            self.raw.add(time_us, &readings);
        } else {
            self.raw = RawReadings::NONE;
        }
        self.comms.calibrate(&mut self.calibrator, self.raw.take(), &self.table, &mut send);
        let change = self.comms.parameters(&mut self.table, &mut send);
        if change.is_some() {
            self.esc_reports.adopt(self.table.configuration());
            // The configuration is adopted at once, because the vehicle is disarmed and each change has been checked.
            let adopted = self.flight.adopt(&self.law, self.table.configuration());
            debug_assert_eq!(adopted, Ok(true), "a parameter change that passed its checks was not adopted");
        }
        if let Some(files) = &mut self.files {
            let (transfers, store) = &mut **files;
            self.comms.transfer(transfers, store, &mut send);
        }
        if let (Some(ExactLog { recorder, write }), Some(change)) = (&mut self.log, change) {
            self.next.adopted = Some(recorder.change(&self.table, change, write));
        }
        let tick = details.as_ref().map(|details| TickRecord { report: &report, details });
        if let (Some(black_box), Some(tick)) = (&mut self.black_box, &tick) {
            black_box.tick(tick, self.comms.esc_telemetry(), &self.table, change);
            black_box.sent(time_us, &bytes);
        }
        if let (Some(files), Some(tick)) = (&mut self.files, &tick)
            && let Some(stream) = files.1.streamed(|| new_black_box(&self.table, &self.names, self.origin, None))
        {
            stream.tick(tick, self.comms.esc_telemetry(), &self.table, change);
            stream.sent(time_us, &bytes);
        }
        // The number is incremented before the following inputs are merged, which belong to the next tick.
        self.next.number = self.next.number.wrapping_add(1);
        if let Some(news) = &action.inputs {
            self.merge(news);
        }
        // Lets the radio services notice a silent receiver.
        self.hear_radio(&[]);
        self.asks_esc = action.ask;
        HostTick { report, bytes, change, signing: self.comms.signing_record(), asks_esc: action.ask }
    }

    /// Runs the tick one millisecond after the previous tick, with a reported duration of zero.
    pub fn next_tick(&mut self, uplink: &[u8]) -> HostTick {
        self.tick(uplink, self.took.time_us + PERIOD_US, 0.0)
    }
}

/// Receives bytes of one stream, including requests for served files.
fn received(
    comms: &mut Comms,
    decoder: &mut Decoder<Uplink>,
    bytes: &[u8],
    files: Option<&mut (Transfers<OpenFile>, ServedFiles)>,
) -> ControlInputs {
    match files {
        Some((transfers, _)) => comms.receive_beside(decoder, bytes, transfers),
        None => comms.receive(decoder, bytes),
    }
}

fn new_black_box(
    table: &ParameterTable,
    [vehicle, law]: &[String; 2],
    origin: Option<GeodeticOrigin>,
    write: Option<Sink>,
) -> HostBlackBox {
    let log = BlackBox::new(&LogStart { vehicle, law, hardware: HARDWARE, ..LogStart::default() }, table);
    HostBlackBox::new(log, origin, write)
}

/// Returns the parameters with the values in `store`.
fn loaded(image: Configuration, store: &mut Store<FlashFile>, notice: &mut dyn FnMut(&str)) -> ParameterTable {
    let mut table = ParameterTable::new(image);
    let loaded = Kept::NOW.load(&mut table, store, |unused: Reason| notice(unused.as_str()));
    loaded.unwrap_or_else(|error| notice(error.reason()));
    table
}

impl Autopilot for Host {
    fn sense(&mut self, readings: &Readings) -> bool {
        Host::sense(self, readings);
        true
    }

    fn turn_rotors(&mut self, plant: &Plant) {
        self.hear_simulated_escs(plant);
    }

    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        hear(&self.next_tick(uplink).bytes);
        Ok(())
    }
}
