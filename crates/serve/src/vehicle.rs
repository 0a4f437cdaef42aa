//! One simulated vehicle in its world.

use crate::ParameterFile;
use crate::command::WorldChange;
use crate::frames::frames;
use crate::handheld::HandheldMotion;
use crate::reported_sensors::ReportedSensors;
use crate::world_changes::WorldChanges;
use afbc::Profile;
use afbc_comms::services::health::sensor;
use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_comms::services::sensors::tested;
use afbc_comms::services::status::SensorBits;
use afbc_comms::{AuxSensors, Setup};
use afbc_files::read::words::out_of_range;
use afbc_flight_core::Mode;
use afbc_hil::{Host, HostTick, LogFile, UlogFiles, place};
use afbc_mavlink::{Address, Counters, Decoder, Reboot, Uplink};
use afbc_onboard::{Link, Readings, Report};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_sim::flight::World;
use afbc_types::OutOfRange;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Component id of an autopilot.
const AUTOPILOT: u8 = 1;
/// Data rate of the link \[bytes/s\]. Loopback has no limit, but clients do.
const BYTES_PER_S: u32 = 100_000;
/// Duration of a step \[s\].
const STEP_S: f64 = 0.001;

/// The firmware's code on a simulated plant with its instruments.
pub struct ServedVehicle {
    /// Default values of the link's parameters.
    link: Link,
    address: Address,
    host: Host,
    world: World,
    changes: WorldChanges,
    /// Hand that holds the vehicle, if any.
    handheld: Option<HandheldMotion>,
    /// One decoder per peer, so that bytes of different peers never mix into one frame.
    peers: BTreeMap<u32, Decoder<Uplink>>,
    /// True if new peers count as wired to the vehicle.
    wired: bool,
    mode: Mode,
    /// Report of the last tick.
    report: Option<Report>,
    /// The law that flies.
    law: ControllerKind,
    reported: ReportedSensors,
    scenario: Scenario,
    parameter_file: Option<ParameterFile>,
    exact_log: Option<LogFile>,
    black_box: Option<UlogFiles>,
    /// Lines about the stored parameters and restarts, to be logged in the next step.
    notices: Vec<String>,
}

impl ServedVehicle {
    /// Creates and powers up the vehicle of `scenario` at its start. Its parameters are stored in `parameter_file`, if
    /// there is one. Its system id is `system`, unless the parameter MAV_SYS_ID says otherwise.
    ///
    /// # Errors
    /// Fails with the first setting out of range.
    pub fn new(scenario: &Scenario, system: u8, mut parameter_file: Option<ParameterFile>) -> Result<Self, OutOfRange> {
        let link = Link { system: system.into(), ..Link::DEFAULT };
        let mut notices = Vec::new();
        let mut host = power_up(scenario, link, parameter_file.as_mut(), &mut notices)?;
        host.serve_files(place(scenario), None);
        Ok(ServedVehicle {
            link,
            address: address(&host),
            host,
            world: World::released(scenario, STEP_S)?,
            changes: WorldChanges::new(scenario),
            handheld: None,
            peers: BTreeMap::new(),
            wired: false,
            mode: Mode::Disarmed,
            report: None,
            law: ControllerKind::Afbc,
            reported: ReportedSensors::new(scenario),
            scenario: scenario.clone(),
            parameter_file,
            exact_log: None,
            black_box: None,
            notices,
        })
    }

    /// Returns the MAVLink system id.
    pub fn system(&self) -> u8 {
        self.address.system
    }

    /// Records an exact log to this file. Call this before the first step.
    pub fn record(&mut self, file: LogFile) {
        self.host.record(file.sink());
        self.exact_log = Some(file);
    }

    /// Records the black box to these files, and lets stations download them. Call this before the first step.
    pub fn log(&mut self, files: UlogFiles) {
        self.host.log(place(&self.scenario), files.sink());
        self.host.serve_files(place(&self.scenario), Some(files.stored()));
        self.black_box = Some(files);
    }

    /// Closes the black box.
    ///
    /// # Errors
    /// Fails with one line if the black box ended early, whether this was reported or not.
    pub fn end_log(&mut self) -> Result<(), String> {
        self.black_box.take().map_or(Ok(()), UlogFiles::finish)
    }

    /// Closes the black box; returns one line if it ended early, unless that was already reported.
    pub fn close_log(&mut self) -> Option<String> {
        self.black_box.take().and_then(|mut files| files.end())
    }

    /// Returns the vehicle's simulated world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Moves the local frame's origin to this latitude and longitude \[deg\] and altitude above the sea \[m\]. Returns
    /// false within a kilometre of a pole, where there is no such frame.
    pub fn move_origin(&mut self, [latitude_deg, longitude_deg]: [f64; 2], altitude_m: f64) -> bool {
        let origin = EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m });
        origin.map(|origin| self.reported.move_origin(origin)).is_some()
    }

    /// Sets whether peers that connect from now on count as wired to the vehicle: they may set the signing key.
    pub fn set_wired(&mut self, wired: bool) {
        self.wired = wired;
    }

    /// Returns true if frames need a signature.
    pub fn needs_signatures(&self) -> bool {
        self.host.needs_signatures()
    }

    /// Queues bytes of `peer` for the next step. Returns whether they complete a valid frame: any intact frame or, if
    /// frames need a signature, an accepted one.
    pub fn hear(&mut self, peer: u32, bytes: &[u8]) -> bool {
        let (address, wired, signed) = (self.address, self.wired, self.host.needs_signatures());
        let decoder = self.peers.entry(peer).or_insert_with(|| decoder(address, wired));
        let before = *decoder.counters();
        self.host.hear(decoder, bytes);
        let after = *decoder.counters();
        after.received != before.received || (!signed && intact(&after) != intact(&before))
    }

    /// Forgets an unfinished frame of a peer that is gone.
    pub fn forget(&mut self, peer: u32) {
        self.peers.remove(&peer);
    }

    /// Runs one millisecond; returns the complete frames that the vehicle has sent. Passes lines about events to `log`.
    pub fn step(&mut self, mut log: impl FnMut(&str)) -> Vec<u8> {
        self.notices.drain(..).for_each(|notice| log(&notice));
        match &self.handheld {
            Some(_) => self.world.look_held(),
            None => drop(self.world.look()),
        }
        if let Some(readings) = self.world.readings() {
            self.host.sense(readings);
        }
        let readings = self.world.readings().copied().unwrap_or_default();
        let aux = self.reported.observe(&self.world, &readings);
        self.host.comms().set_aux_sensors(aux);
        if self.host.comms().wants_self_tests() {
            self.test_sensors(&aux, &readings);
        }
        self.host.hear_simulated_escs(self.world.plant());
        let HostTick { report, bytes, change, signing, .. } = self.host.next_tick(&[]);
        self.world.advance(&report.motors);
        // The hand overrides the plant's own step.
        self.hold();
        if report.mode.armed() != self.mode.armed() {
            log(if report.mode.armed() { "armed" } else { "disarmed" });
        }
        self.mode = report.mode;
        self.report = Some(report);
        frames(&bytes).filter_map(|frame| frame.text()).for_each(|text| log(&text));
        if let Some(parameter_file) = &mut self.parameter_file {
            let change = change.map_or(Ok(()), |change| parameter_file.store_change(change));
            let signing = signing.map_or(Ok(()), |record| parameter_file.store_signing(record));
            // Both writes have been attempted by now: if one fails, the other is still done.
            let later = parameter_file.take_failure().map_or(Ok(()), Err);
            if let Err(error) = change.and(signing).and(later) {
                // The warning is sent as a status text, and thereby logged, too.
                self.host.comms().warn(error.reason());
            }
        }
        if let Some(failure) = self.exact_log.as_ref().and_then(LogFile::take_failure) {
            log(&format!("the exact log has ended: {failure}"));
        }
        if let Some(failure) = self.black_box.as_mut().and_then(UlogFiles::take_failure) {
            log(&failure);
        }
        // The frames of this step have been sent, so the firmware may restart.
        if self.host.comms().wants_reboot().is_some() {
            self.restart();
        }
        bytes
    }

    /// Reports the sensors' self-tests: a sensor passes if it has readings.
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

    /// Restarts the firmware; the world goes on.
    fn restart(&mut self) {
        self.notices.push("restarted".into());
        let host = power_up(&self.scenario, self.link, self.parameter_file.as_mut(), &mut self.notices);
        match host {
            Ok(host) => {
                self.address = address(&host);
                // The firmware restarts with its own law; a law chosen by a command is lost with the rest of its state.
                (self.host, self.law) = (host, ControllerKind::Afbc);
                if let Some(file) = &self.exact_log {
                    self.host.record(file.sink());
                }
                if let Some(files) = &mut self.black_box {
                    files.next_start();
                    self.host.log(place(&self.scenario), files.sink());
                }
                self.host.serve_files(place(&self.scenario), self.black_box.as_ref().map(UlogFiles::stored));
                // Unfinished frames are lost in a restart.
                self.peers.values_mut().for_each(|peer| *peer = decoder(self.address, self.wired));
            }
            Err(error) => self.notices.push(out_of_range(&error)),
        }
    }

    /// Moves the vehicle to where the hand holds it.
    fn hold(&mut self) {
        let Some(handheld) = &self.handheld else { return };
        let plant = self.world.plant_mut();
        let now_s = plant.time_s();
        plant.set_motion(&handheld.motion(now_s));
        if handheld.is_released(now_s) {
            self.handheld = None;
        }
    }

    /// Changes weather or faults, or takes the vehicle by hand.
    ///
    /// # Errors
    /// Fails with one line that says why the change is impossible.
    pub fn apply(&mut self, change: &WorldChange) -> Result<(), String> {
        if let WorldChange::Hold(grip) = change {
            if self.mode.armed() {
                return Err("hold: refused, the vehicle is armed; disarm it first".into());
            }
            let plant = self.world.plant();
            let now_s = plant.time_s();
            self.handheld.get_or_insert_with(|| HandheldMotion::new(&plant.motion(), now_s)).take(*grip, now_s);
        }
        self.changes.apply(change, &mut self.world)
    }

    /// Switches to another law at the next tick, armed or not. The law starts from its initial state, as after arming.
    /// AFBC is the firmware's own law, with its monitor.
    ///
    /// # Errors
    /// Fails with one line that says why the law cannot be used.
    pub fn change_law(&mut self, kind: ControllerKind) -> Result<(), String> {
        if self.exact_log.is_some() {
            return Err("law: an exact log can only contain one law; serve without --exact-log".into());
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

    /// Returns the firmware's code that flies the vehicle.
    pub fn host(&self) -> &Host {
        &self.host
    }

    /// Returns the report of the last tick; `None` before the first.
    pub fn report(&self) -> Option<&Report> {
        self.report.as_ref()
    }

    /// Returns the scenario of this vehicle.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the place of the local frame's origin on the earth, if known.
    pub fn origin(&self) -> Option<EarthOrigin> {
        self.reported.origin()
    }

    /// Returns the faults that act now, in words.
    pub fn faults(&self) -> Vec<String> {
        self.changes.active_faults(self.world.plant().time_s())
    }

    /// Returns the remaining share of each rotor's thrust.
    pub fn rotor_shares(&self) -> Vec<f64> {
        self.changes.rotor_shares(self.scenario.rotors.len(), self.world.plant().time_s())
    }

    /// Returns the vehicle's state in one line.
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

/// Powers up the firmware of the scenario's vehicle.
fn power_up(
    scenario: &Scenario,
    link: Link,
    parameter_file: Option<&mut ParameterFile>,
    notices: &mut Vec<String>,
) -> Result<Host, OutOfRange> {
    let host = match parameter_file {
        Some(parameter_file) => parameter_file.power_up(scenario, link, |notice| notices.push(notice.into()))?,
        None => Host::linked(scenario.vehicle_file.as_ref(), link)?,
    };
    let setup = Setup { bytes_per_s: BYTES_PER_S, reboots: &[Reboot::Program], ..host.setup() };
    Ok(host.with(setup))
}

/// Returns a decoder for a new peer.
fn decoder(receiver: Address, wired: bool) -> Decoder<Uplink> {
    let decoder = Decoder::new(receiver);
    if wired { decoder.wired() } else { decoder }
}

/// Returns the number of frames with a valid checksum that were not delivered.
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
