//! One vehicle in its world.

use crate::ParameterFile;
use crate::command::WorldChange;
use crate::frames::frames;
use crate::hand::Hand;
use crate::reported_sensors::ReportedSensors;
use crate::world_changes::WorldChanges;
use afbc::Profile;
use afbc_files::read::words::out_of_range;
use afbc_flight_core::Mode;
use afbc_hil::{Host, HostTick, LogFile, UlogFiles, place};
use afbc_link::{Address, Counters, Decoder, Reboot, Uplink};
use afbc_onboard::{Link, Readings, Report};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_sim::flight::World;
use afbc_station::services::health::sensor;
use afbc_station::services::origin::{EarthOrigin, Global};
use afbc_station::services::sensors::tested;
use afbc_station::services::status::SensorBits;
use afbc_station::{AuxSensors, Setup};
use afbc_types::{OutOfRange, ROTORS_MAX};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Component of the vehicle: autopilot.
const AUTOPILOT: u8 = 1;
/// What its link carries: loopback has no limit, clients have.
const BYTES_PER_S: u32 = 100_000;
/// Time of a step \[s\].
const STEP_S: f64 = 0.001;

/// The firmware's code on the plant, with its instruments.
pub struct ServedVehicle {
    /// Defaults of the link's parameters.
    link: Link,
    address: Address,
    host: Host,
    world: World,
    changes: WorldChanges,
    /// Who holds it, if anybody does.
    hand: Option<Hand>,
    /// A decoder for each peer: no stream's bytes complete a frame of another's.
    peers: BTreeMap<u32, Decoder<Uplink>>,
    /// True if new peers count as holding the vehicle.
    wired: bool,
    mode: Mode,
    /// Report of the last tick.
    report: Option<Report<ROTORS_MAX>>,
    /// The law that flies.
    law: ControllerKind,
    reported: ReportedSensors,
    scenario: Scenario,
    keeper: Option<ParameterFile>,
    exact_log: Option<LogFile>,
    black_box: Option<UlogFiles>,
    /// What is to be reported of the parameters that were stored.
    notices: Vec<String>,
}

impl ServedVehicle {
    /// Creates the vehicle of `scenario`, powered up where it starts, with parameters that `keeper` keeps, if there is
    /// one. Its system id is `system`, unless they say another (MAV_SYS_ID).
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn new(scenario: &Scenario, system: u8, mut keeper: Option<ParameterFile>) -> Result<Self, OutOfRange> {
        let link = Link { system: system.into(), ..Link::DEFAULT };
        let mut notices = Vec::new();
        let mut host = power_up(scenario, link, keeper.as_mut(), &mut notices)?;
        host.serve_files(place(scenario), None);
        Ok(ServedVehicle {
            link,
            address: address(&host),
            host,
            world: World::released(scenario, STEP_S)?,
            changes: WorldChanges::new(scenario),
            hand: None,
            peers: BTreeMap::new(),
            wired: false,
            mode: Mode::Disarmed,
            report: None,
            law: ControllerKind::Afbc,
            reported: ReportedSensors::new(scenario),
            scenario: scenario.clone(),
            keeper,
            exact_log: None,
            black_box: None,
            notices,
        })
    }

    /// Returns its MAVLink system id.
    pub fn system(&self) -> u8 {
        self.address.system
    }

    /// Keeps an exact log in this file, from now on, before the first step.
    pub fn record(&mut self, file: LogFile) {
        self.host.record(file.sink());
        self.exact_log = Some(file);
    }

    /// Keeps the black box in these files, from now on, before the first step, and lets stations download them.
    pub fn log(&mut self, files: UlogFiles) {
        self.host.log(place(&self.scenario), files.sink());
        self.host.serve_files(place(&self.scenario), Some(files.stored()));
        self.black_box = Some(files);
    }

    /// Ends the black box.
    ///
    /// # Errors
    /// A line on why it has ended early, reported or not.
    pub fn end_log(&mut self) -> Result<(), String> {
        self.black_box.take().map_or(Ok(()), UlogFiles::finish)
    }

    /// Ends the black box; returns a line on why it has ended early, unless that was reported.
    pub fn close_log(&mut self) -> Option<String> {
        self.black_box.take().and_then(|mut files| files.end())
    }

    /// Returns its world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Puts the local frame's origin at this latitude and longitude \[deg\], and altitude above the sea \[m\]; false
    /// within a kilometre of a pole.
    pub fn move_origin(&mut self, [latitude_deg, longitude_deg]: [f64; 2], altitude_m: f64) -> bool {
        let origin = EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m });
        origin.map(|origin| self.reported.move_origin(origin)).is_some()
    }

    /// Sets whether those that connect from now on count as holding the vehicle: they may set the key of signatures.
    pub fn set_wired(&mut self, wired: bool) {
        self.wired = wired;
    }

    /// True if frames need a signature.
    pub fn needs_signatures(&self) -> bool {
        self.host.needs_signatures()
    }

    /// Receives, for the next step, what `peer` has sent. Returns whether that completes a frame that shows who it is:
    /// any that is intact or, where frames need a signature, one that is accepted.
    pub fn hear(&mut self, peer: u32, bytes: &[u8]) -> bool {
        let (address, wired, signed) = (self.address, self.wired, self.host.needs_signatures());
        let decoder = self.peers.entry(peer).or_insert_with(|| decoder(address, wired));
        let before = *decoder.counters();
        self.host.hear(decoder, bytes);
        let after = *decoder.counters();
        after.received != before.received || (!signed && intact(&after) != intact(&before))
    }

    /// Forgets what is left of a peer that is gone.
    pub fn forget(&mut self, peer: u32) {
        self.peers.remove(&peer);
    }

    /// Runs a millisecond; returns the bytes that it has sent, whole frames. What is worth a line goes to `log`.
    pub fn step(&mut self, mut log: impl FnMut(&str)) -> Vec<u8> {
        self.notices.drain(..).for_each(|notice| log(&notice));
        match &self.hand {
            Some(_) => self.world.look_held(),
            None => drop(self.world.look()),
        }
        if let Some(readings) = self.world.readings() {
            self.host.sense(readings);
        }
        let readings = self.world.readings().copied().unwrap_or_default();
        let aux = self.reported.look(&self.world, &readings);
        self.host.comms().set_aux_sensors(aux);
        if self.host.comms().wants_self_tests() {
            self.test_sensors(&aux, &readings);
        }
        self.host.hear_simulated_escs(self.world.plant());
        let HostTick { report, bytes, change, signing, .. } = self.host.next_tick(&[]);
        self.world.advance(&report.motors);
        // After the plant's own step, which the hand overrules.
        self.hold();
        if report.mode.armed() != self.mode.armed() {
            log(if report.mode.armed() { "armed" } else { "disarmed" });
        }
        self.mode = report.mode;
        self.report = Some(report);
        frames(&bytes).filter_map(|frame| frame.text()).for_each(|text| log(&text));
        if let Some(keeper) = &mut self.keeper {
            let change = change.map_or(Ok(()), |change| keeper.keep(change));
            let signing = signing.map_or(Ok(()), |record| keeper.keep_signing(record));
            // Both have been written by now, or tried: one failure does not keep the other back.
            let later = keeper.take_failure().map_or(Ok(()), Err);
            if let Err(error) = change.and(signing).and(later) {
                // The reason is a text to the stations, and reported with it.
                self.host.comms().warn(error.reason());
            }
        }
        if let Some(failure) = self.exact_log.as_ref().and_then(LogFile::take_failure) {
            log(&format!("the exact log has ended: {failure}"));
        }
        if let Some(failure) = self.black_box.as_mut().and_then(UlogFiles::take_failure) {
            log(&failure);
        }
        // What was sent before has left.
        if self.host.comms().wants_reboot().is_some() {
            self.restart();
        }
        bytes
    }

    /// Tells the results of the sensors' own tests, which sensors pass that read something.
    fn test_sensors(&mut self, aux: &AuxSensors, readings: &Readings) {
        let SensorBits { present, healthy } = aux.sensors;
        let imu = sensor::GYROSCOPE | sensor::ACCELEROMETER;
        let compass = (present & sensor::MAGNETOMETER != 0).then_some(healthy & sensor::MAGNETOMETER != 0);
        let imu_passes = self.scenario.instruments.imu.map(|_| readings.imu.is_some());
        for (bits, passes) in [(imu, imu_passes), (sensor::MAGNETOMETER, compass)] {
            let told = passes.and_then(|passes| Some((passes, tested(bits, passes)?)));
            match told {
                Some((true, (text, _))) => self.host.comms().inform(text),
                Some((false, (text, _))) => self.host.comms().warn(text),
                None => (),
            }
        }
    }

    /// Powers the firmware down and up again; the world goes on.
    fn restart(&mut self) {
        self.notices.push("restarted".into());
        let host = power_up(&self.scenario, self.link, self.keeper.as_mut(), &mut self.notices);
        match host {
            Ok(host) => {
                self.address = address(&host);
                // Firmware starts with its own law: one that a line has chosen is gone, like all else that it knew.
                (self.host, self.law) = (host, ControllerKind::Afbc);
                if let Some(file) = &self.exact_log {
                    self.host.record(file.sink());
                }
                if let Some(files) = &mut self.black_box {
                    files.next_start();
                    self.host.log(place(&self.scenario), files.sink());
                }
                self.host.serve_files(place(&self.scenario), self.black_box.as_ref().map(UlogFiles::stored));
                // Nothing of a frame outlasts it.
                self.peers.values_mut().for_each(|peer| *peer = decoder(self.address, self.wired));
            }
            Err(error) => self.notices.push(out_of_range(&error)),
        }
    }

    /// Moves the vehicle where a hand holds it.
    fn hold(&mut self) {
        let Some(hand) = &self.hand else { return };
        let plant = self.world.plant_mut();
        let now_s = plant.time_s();
        plant.set_motion(&hand.motion(now_s));
        if hand.has_left(now_s) {
            self.hand = None;
        }
    }

    /// Changes weather or faults.
    ///
    /// # Errors
    /// One line on why it does not.
    pub fn apply(&mut self, change: &WorldChange) -> Result<(), String> {
        if let WorldChange::Hold(grip) = change {
            if self.mode.armed() {
                return Err("hold: an armed vehicle is not touched".into());
            }
            let plant = self.world.plant();
            let now_s = plant.time_s();
            self.hand.get_or_insert_with(|| Hand::new(&plant.motion(), now_s)).take(*grip, now_s);
        }
        self.changes.apply(change, &mut self.world)
    }

    /// Flies on under this law, from the next tick on, armed or not: it begins afresh, as after arming. AFBC is the
    /// firmware's own, with its monitor.
    ///
    /// # Errors
    /// One line on why it does not.
    pub fn change_law(&mut self, kind: ControllerKind) -> Result<(), String> {
        if self.exact_log.is_some() {
            return Err("law: an exact log is of one law; serve without --exact-log".into());
        }
        let law = match (kind, &self.scenario.vehicle_file) {
            (ControllerKind::Afbc, _) => None,
            (kind, Some(vehicle)) => Some(Law::on(kind, vehicle, Profile::Flight).map_err(|error| error.to_string())?),
            (kind, None) => Some(Law::of(kind, Profile::Flight)),
        };
        self.host.change_law(law).map_err(|error| out_of_range(&error))?;
        self.law = kind;
        Ok(())
    }

    /// Returns the law that flies.
    pub fn law(&self) -> ControllerKind {
        self.law
    }

    /// Returns the firmware's code that flies it, to look at.
    pub fn host(&self) -> &Host {
        &self.host
    }

    /// Returns the report of the last tick; none before the first.
    pub fn report(&self) -> Option<&Report<ROTORS_MAX>> {
        self.report.as_ref()
    }

    /// Returns the scenario that it was made of.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns where on the earth the origin of its local frame is, if that is known.
    pub fn origin(&self) -> Option<EarthOrigin> {
        self.reported.origin()
    }

    /// Returns what it suffers now, in words.
    pub fn faults(&self) -> Vec<String> {
        self.changes.active_faults(self.world.plant().time_s())
    }

    /// Returns the share of its thrust that each rotor has now.
    pub fn rotor_shares(&self) -> Vec<f64> {
        self.changes.rotor_shares(self.scenario.rotors.len(), self.world.plant().time_s())
    }

    /// Returns its state in one line.
    pub fn status(&self) -> String {
        let (plant, mode) = (self.world.plant(), self.mode);
        let motion = plant.motion();
        let [[x, y, z]] = motion.position_m.data.0;
        let [[u, v, w]] = motion.velocity_m_s.data.0;
        let yaw_deg = motion.attitude_rad.z.to_degrees();
        let mut line = format!(
            "vehicle {}: {:.3} s, {}, position {x:.2} {y:.2} {z:.2} m, velocity {u:.2} {v:.2} {w:.2} m/s, \
             heading {yaw_deg:.0} deg",
            self.system(),
            plant.time_s(),
            mode_name(mode),
        );
        if let Some(telemetry) = plant.telemetry() {
            let [[x, y, z]] = telemetry.wind_m_s.data.0;
            // Writing to a string cannot fail.
            let _ = write!(line, ", wind {x:.1} {y:.1} {z:.1} m/s");
            if telemetry.on_ground {
                line += ", on the ground";
            }
            if let Some(battery) = telemetry.battery {
                let _ = write!(line, ", battery {:.1} V {:.0} %", battery.voltage_v, battery.charge * 100.0);
            }
        }
        let bad = self.peers.values().map(|peer| u64::from(peer.counters().bad_checksum)).sum::<u64>();
        let _ = write!(line, ", {} peers, {bad} bad frames", self.peers.len());
        let active_faults = self.changes.active_faults(plant.time_s());
        if !active_faults.is_empty() {
            let _ = write!(line, ", {}", active_faults.join(", "));
        }
        line
    }
}

/// Powers up the firmware of a scenario's vehicle.
fn power_up(
    scenario: &Scenario,
    link: Link,
    keeper: Option<&mut ParameterFile>,
    notices: &mut Vec<String>,
) -> Result<Host, OutOfRange> {
    let host = match keeper {
        Some(keeper) => keeper.power_up(scenario, link, |notice| notices.push(notice.into()))?,
        None => Host::linked(scenario.vehicle_file.as_ref(), link)?,
    };
    let setup = Setup { bytes_per_s: BYTES_PER_S, reboots: &[Reboot::Program], ..host.setup() };
    Ok(host.with(setup))
}

/// Returns the decoder of a new peer.
fn decoder(receiver: Address, wired: bool) -> Decoder<Uplink> {
    let decoder = Decoder::new(receiver);
    if wired { decoder.wired() } else { decoder }
}

/// Returns the number of frames with the right checksum that were not delivered.
fn intact(counters: &Counters) -> u32 {
    let Counters { malformed, implausible, unsupported, elsewhere, .. } = *counters;
    [malformed, implausible, unsupported, elsewhere].into_iter().fold(0, u32::wrapping_add)
}

fn address(host: &Host) -> Address {
    Address { system: host.setup().system, component: AUTOPILOT }
}

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Disarmed => "disarmed",
        Mode::Flying => "flying",
        Mode::Coasting => "coasting",
        Mode::Descending => "descending",
        _ => "in another mode",
    }
}
