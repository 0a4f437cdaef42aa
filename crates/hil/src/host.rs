//! The firmware's code in this process.

use super::{Autopilot, Error};
use crate::aircraft::{Aircraft, Core, ExactLog, Exchange};
use crate::host_black_box::{HostBlackBox, Sink};
use crate::metadata::MetadataFiles;
use crate::served_files::{OpenFile, ServedFiles};
use crate::simulated_escs::SimulatedEscs;
use crate::stored_logs::StoredLogs;
use afbc::AdaptiveEstimate;
use afbc_estimator::Origin;
use afbc_files::Flash;
use afbc_flight_core::rate::PERIOD_US;
use afbc_link::{Decoder, MissionItem, Uplink};
use afbc_log::exact::Recorder;
use afbc_log::ulog::LogStart;
use afbc_onboard::parameters::{Kept, ParameterTable, Reason, RecordChange};
use afbc_onboard::{
    Configuration, ControlInputs, Flight, ImuSelector, Link, Prepare, RawReadings, Readings, Report, TickBefore,
    TickDetails, TickInputs, TickRecord,
};
use afbc_plant::Plant;
use afbc_scenario::FlownLaw;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_station::services::signing::{Signing, SigningRecord};
use afbc_station::{Calibrator, Comms, EscReports, EscsHeard, RadioControl, Setup, Transfers};
use afbc_store::{RecordName, Store};
use afbc_types::{OutOfRange, PerAxis, ROTORS_MAX, with_rotors};
use afbc_vehicles::Vehicle;

/// The firmware without its hardware, ticked in lockstep.
pub struct Host {
    flight: Box<dyn Core>,
    setup: Setup,
    comms: Comms,
    inputs: ControlInputs,
    /// What the last tick took of it, and what was before that tick.
    taken: ControlInputs,
    before: TickBefore,
    /// What the last tick took beside.
    took: TickInputs,
    readings: Readings,
    radio: Box<RadioControl>,
    /// What has come over the motor controllers' line since the last tick.
    escs: Vec<u8>,
    /// Rotor whose motor controller the last tick has asked.
    asks_esc: Option<u8>,
    /// Electrical speeds that the motor controllers have answered \[rev/min\].
    answers_rev_min: [Option<u32>; ROTORS_MAX],
    simulated_escs: SimulatedEscs,
    calibrator: Box<Calibrator>,
    /// What the sensors have read while somebody wants to know.
    raw: RawReadings,
    /// What the next tick takes that is known before: its number, and what has changed since the last one.
    next: TickInputs,
    /// The exact log of it all, if it is kept.
    log: Option<ExactLog>,
    black_box: Option<HostBlackBox>,
    /// Where fixes of a GNSS receiver are measured from, for logs.
    origin: Option<Origin>,
    /// What it serves of files, if it does.
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
    pub report: Report<ROTORS_MAX>,
    /// Bytes sent over the link.
    pub bytes: Vec<u8>,
    /// A parameter that has changed, to be kept.
    pub change: Option<RecordChange>,
    /// What of the link's signatures is to be kept.
    pub signing: Option<SigningRecord>,
    /// Rotor, from 0, whose motor controller is asked for its telemetry with this tick's frames.
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

    /// The firmware of this vehicle, powered up, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; none in fact, for a vehicle is checked when its file is read.
    pub fn for_vehicle(vehicle: &Vehicle) -> Result<Self, OutOfRange> {
        Self::linked(Some(vehicle), Link::DEFAULT)
    }

    /// The firmware of this vehicle, or of the paper's, powered up, with these defaults of the link's parameters.
    ///
    /// # Errors
    /// As of [`for_vehicle`](Self::for_vehicle).
    pub fn linked(vehicle: Option<&Vehicle>, link: Link) -> Result<Self, OutOfRange> {
        let Some(vehicle) = vehicle else {
            return Self::image(ParameterTable::new(Configuration { link, ..Configuration::default() }), PAPER);
        };
        with_rotors!(vehicle.rotors.len(), N => {
            Self::image(ParameterTable::<N>::new(Configuration { link, ..vehicle.configuration()? }), &vehicle.name)
        })
    }

    /// The firmware of this vehicle under another law, without a monitor: no image has it, but it is the same code.
    ///
    /// # Errors
    /// The first parameter or gain out of range.
    pub fn under(vehicle: &Vehicle, law: Law) -> Result<Self, OutOfRange> {
        with_rotors!(vehicle.rotors.len(), N => {
            let table = ParameterTable::<N>::new(vehicle.configuration()?);
            Self::of(table, FlownLaw(Some(law)), [&vehicle.name, law.kind().name()])
        })
    }

    /// The same with the parameters and the key of signatures that are in `store`; `notice` is called with a line on
    /// each that is not used. Without a store that can be read, they are at their defaults.
    ///
    /// # Errors
    /// As of [`for_vehicle`](Self::for_vehicle).
    pub fn stored(
        vehicle: Option<&Vehicle>,
        link: Link,
        store: &mut Store<Flash>,
        notice: &mut dyn FnMut(&str),
    ) -> Result<Self, OutOfRange> {
        let signing = Signing::kept(|name| store.get(name).ok().flatten().map(|(_, bits)| bits));
        let mut host = match vehicle {
            None => Self::image(loaded(Configuration { link, ..Configuration::default() }, store, notice), PAPER)?,
            Some(vehicle) => with_rotors!(vehicle.rotors.len(), N => {
                let table = loaded::<N>(Configuration { link, ..vehicle.configuration()? }, store, notice);
                Self::image(table, &vehicle.name)
            })?,
        };
        host.comms.set_signing(signing);
        Ok(host)
    }

    /// Creates what an image is.
    fn image<const N: usize>(table: ParameterTable<N>, vehicle: &str) -> Result<Self, OutOfRange> {
        Self::of(table, FlownLaw(None), [vehicle, ControllerKind::Afbc.name()])
    }

    fn of<const N: usize>(table: ParameterTable<N>, law: FlownLaw, names: [&str; 2]) -> Result<Self, OutOfRange> {
        let setup = Setup { calibrates: true, ..Setup::of(&table.configuration().link) };
        let flight = Flight::of(law.prepare(table.configuration())?);
        let escs = EscReports::new(table.configuration());
        Ok(Host {
            escs: Vec::new(),
            asks_esc: None,
            answers_rev_min: [None; ROTORS_MAX],
            simulated_escs: SimulatedEscs::new(table.configuration().escs.poles),
            flight: Box::new(Aircraft { flight, table, law, escs }),
            setup,
            comms: Comms::with(setup),
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

    /// Returns how its link is set up: at first, by the parameters.
    pub fn setup(&self) -> Setup {
        self.setup
    }

    /// The same firmware, freshly powered up, with this setup of its link.
    #[must_use]
    pub fn with(self, setup: Setup) -> Self {
        let mut comms = Comms::with(setup);
        comms.set_signing(self.comms.signing().clone());
        Host { setup, comms, ..self }
    }

    /// True if frames need a signature.
    pub fn needs_signatures(&self) -> bool {
        self.comms.signing().is_on()
    }

    /// Returns the half that communicates.
    pub fn comms(&mut self) -> &mut Comms {
        &mut self.comms
    }

    /// Returns the items of the mission and of the geofence, as stations have uploaded them.
    pub fn plan(&self) -> [&[MissionItem]; 2] {
        self.comms.plan()
    }

    /// Returns what logs have of the last tick.
    pub fn details(&self) -> TickDetails {
        self.flight.details(&self.took, &self.before, &self.taken)
    }

    /// Returns AFBC's estimates in this or the last flight, if it flies.
    pub fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        self.flight.estimates()
    }

    /// Flies on under this law, or under the image's own with its monitor, from the next tick on, armed or not: it
    /// begins afresh, as after arming. An exact log does not know of it.
    ///
    /// # Errors
    /// The first gain out of range; nothing has changed then.
    pub fn change_law(&mut self, law: Option<Law>) -> Result<(), OutOfRange> {
        self.flight.change_law(FlownLaw(law))?;
        let [_, name] = &mut self.names;
        law.map_or(ControllerKind::Afbc, |law| law.kind()).name().clone_into(name);
        Ok(())
    }

    /// Returns name and value of every parameter.
    pub fn parameter_values(&self) -> Vec<(RecordName, f32)> {
        self.flight.parameter_values()
    }

    /// Returns the metadata of its parameters, as stations download it.
    pub fn metadata(&self) -> MetadataFiles {
        let [vehicle, _] = &self.names;
        self.flight.metadata(vehicle)
    }

    /// Keeps an exact log ([`afbc_log::exact`]) from now on, before the first tick; `write` takes its bytes.
    pub fn record(&mut self, write: impl FnMut(&[u8]) + 'static) {
        let mut log = ExactLog { recorder: Recorder::default(), write: Box::new(write) };
        self.flight.record(&mut log, &self.names, None);
        self.log = Some(log);
    }

    /// Keeps a black box's log ([`afbc_log::ulog`]) from now on, before the first tick; `write` takes its bytes. Fixes
    /// of a GNSS receiver are measured from `origin`, if that is known.
    pub fn log(&mut self, origin: Option<Origin>, write: impl FnMut(&[u8]) + 'static) {
        self.origin = origin;
        self.black_box = Some(self.new_black_box(Some(Box::new(write))));
    }

    fn new_black_box(&self, write: Option<Sink>) -> HostBlackBox {
        new_black_box(&*self.flight, &self.names, self.origin, write)
    }

    /// Serves its metadata, these logs, and the log of a black box while it is made, to stations, from now on. Fixes
    /// are measured from `origin`, as for [`log`](Self::log).
    pub fn serve_files(&mut self, origin: Option<Origin>, logs: Option<StoredLogs>) {
        self.origin = origin;
        let [vehicle, _] = &self.names;
        let MetadataFiles { files, general } = self.flight.metadata(vehicle);
        self.files = Some(Box::new((Transfers::new(Some(general)), ServedFiles::new(logs, files))));
    }

    /// Takes what messages have brought.
    fn merge(&mut self, news: &ControlInputs) {
        self.inputs.merge(news);
        if let Some(ExactLog { recorder, write }) = &mut self.log {
            recorder.inputs(self.next.number, news, write);
        }
    }

    /// Receives, for the next tick, the next bytes of one of several streams, each with a decoder of its own.
    pub fn hear(&mut self, decoder: &mut Decoder<Uplink>, bytes: &[u8]) {
        self.comms.exchange(decoder);
        let news = self.receive(bytes);
        self.merge(&news);
        self.comms.exchange(decoder);
    }

    fn receive(&mut self, bytes: &[u8]) -> ControlInputs {
        match &mut self.files {
            Some(files) => self.comms.receive_beside(bytes, &mut files.0),
            None => self.comms.receive(bytes),
        }
    }

    /// Receives, for the next tick, the next bytes of a radio receiver.
    pub fn hear_radio(&mut self, bytes: &[u8]) {
        if let Some(news) = self.flight.pilot(&mut self.comms, &mut self.radio, bytes) {
            self.merge(&news);
        }
    }

    /// Receives, for the next tick, the next bytes of the motor controllers' line ([`HostTick::asks_esc`]); they count
    /// while `DSHOT_TEL_CFG` is set.
    pub fn hear_escs(&mut self, bytes: &[u8]) {
        self.escs.extend_from_slice(bytes);
    }

    /// Lets simulated motor controllers answer the question of the last tick, which the rotors of `plant` have turned
    /// for, and its frame, by bidirectional DSHOT; in place of [`hear_escs`](Self::hear_escs).
    pub fn hear_simulated_escs(&mut self, plant: &Plant) {
        if let Some(answer) = self.simulated_escs.step(self.asks_esc.take(), plant) {
            self.hear_escs(&answer);
        }
        self.answers_rev_min = self.simulated_escs.answers_rev_min(plant);
    }

    /// Sets what the vehicle's own sensors read for the next tick alone.
    pub fn sense(&mut self, readings: &Readings) {
        self.readings = *readings;
    }

    /// Cross-checks the inertial sensors after the last tick, which took these readings ([`sense`](Self::sense)).
    pub fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings) {
        self.flight.cross_check(selector, readings);
    }

    /// Runs one control tick at `time_us` since power-up, after `uplink` has reached the link. The tick reports a
    /// duration of `tick_us`.
    pub fn tick(&mut self, uplink: &[u8], time_us: u64, tick_us: f32) -> HostTick {
        let news = self.receive(uplink);
        self.merge(&news);
        self.inputs.take_into(&mut self.taken);
        let (readings, battery) = (core::mem::take(&mut self.readings), self.taken.battery);
        self.took = TickInputs { time_us, readings, battery, ..self.next };
        self.before = self.flight.before(&self.taken);
        let mut bytes = Vec::new();
        let mut send = |frame: &[u8]| bytes.extend_from_slice(frame);
        let escs = core::mem::take(&mut self.escs);
        let heard = EscsHeard { bytes: &escs, speeds_rev_min: core::mem::take(&mut self.answers_rev_min) };
        let exchange = Exchange { comms: &mut self.comms, tick_us, send: &mut send, escs: heard };
        let (report, action) = self.flight.tick(time_us, &mut self.taken, &readings, exchange);
        // Before anything changes that it would show.
        let details = (self.black_box.is_some() || self.files.is_some()).then(|| self.details());
        if let Some(ExactLog { recorder, write }) = &mut self.log {
            recorder.tick(&self.took, &report, write);
        }
        // What this tick has moved counts from the next one on.
        let notch_rad_s = action.notch.map(|notch| notch.centre_rad_s());
        self.next = TickInputs { number: self.next.number, notch_rad_s, ..TickInputs::default() };
        if self.comms.takes_samples() {
            self.raw.add(time_us, &readings);
        } else {
            self.raw = RawReadings::NONE;
        }
        self.flight.calibrate(&mut self.comms, &mut self.calibrator, self.raw.take(), &mut send);
        let change = self.flight.parameters(&mut self.comms, &mut send);
        if let Some(files) = &mut self.files {
            let (transfers, store) = &mut **files;
            self.comms.transfer(transfers, store, &mut send);
        }
        if let (Some(log), true) = (&mut self.log, change.is_some()) {
            self.next.adopted = self.flight.record(log, &self.names, change);
        }
        let tick = details.as_ref().map(|details| TickRecord { report: &report, details });
        if let (Some(black_box), Some(tick)) = (&mut self.black_box, &tick) {
            self.flight.log(black_box, tick, self.comms.esc_telemetry(), change);
            black_box.sent(time_us, &bytes);
        }
        if let (Some(files), Some(tick)) = (&mut self.files, &tick)
            && let Some(stream) = files.1.streamed(|| new_black_box(&*self.flight, &self.names, self.origin, None))
        {
            self.flight.log(stream, tick, self.comms.esc_telemetry(), change);
            stream.sent(time_us, &bytes);
        }
        // Before what follows is merged, which is of the next tick.
        self.next.number = self.next.number.wrapping_add(1);
        if let Some(news) = &action.inputs {
            self.merge(news);
        }
        // Notices that there are none.
        self.hear_radio(&[]);
        self.asks_esc = action.ask;
        HostTick { report, bytes, change, signing: self.comms.signing_record(), asks_esc: action.ask }
    }

    /// Runs the tick a millisecond after the previous one, with a duration of zero.
    pub fn next_tick(&mut self, uplink: &[u8]) -> HostTick {
        self.tick(uplink, self.took.time_us + PERIOD_US, 0.0)
    }
}

fn new_black_box(flight: &dyn Core, names: &[String; 2], origin: Option<Origin>, write: Option<Sink>) -> HostBlackBox {
    let [vehicle, law] = names;
    let log = flight.black_box(&LogStart { vehicle, law, hardware: HARDWARE, ..LogStart::default() });
    HostBlackBox::new(log, origin, write)
}

/// Returns the parameters with what is in `store`.
fn loaded<const N: usize>(
    image: Configuration<N>,
    store: &mut Store<Flash>,
    notice: &mut dyn FnMut(&str),
) -> ParameterTable<N> {
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
