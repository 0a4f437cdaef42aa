//! Flights of the firmware's code, with their exact logs.

use afbc_comms::AuxSensors;
use afbc_hil::Host;
use afbc_log::exact::{FRAME_MAX as RECORD_MAX, Frames, Record, write};
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_mavlink::{Address, Datum, Encoder, FRAME_MAX, Height, ParameterRequest, Uplink, VehicleCommand};
use afbc_scenario::Scenario;
use afbc_sim::flight::World;
use afbc_types::{ROTORS_MAX, RotorSpeeds, State};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::cell::RefCell;
use std::rc::Rc;

const STATION: Address = Address { system: 255, component: 190 };
/// Values of MAV_PARAM_TYPE.
const INT32: u8 = 6;
const REAL32: u8 = 9;
/// A scenario outdoors that begins on the ground.
pub(crate) const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../twin/scenarios/hover.toml");

/// Returns the message that a station sends in this millisecond, if any. The flight has random commands of many kinds.
fn sends(ms: u64, random: &mut Xoshiro256PlusPlus) -> Option<Uplink> {
    let command = |command| Some(Uplink::Command(command));
    match ms {
        500 => return Some(set(b"BAT1_N_CELLS", 3_i32.to_le_bytes(), INT32)),
        6_000 | 7_000 | 8_000 | 9_000 => return command(VehicleCommand::Arm),
        6_300 | 7_300 | 8_300 | 9_300 => {
            return command(VehicleCommand::TakeOff(Height { metres: 4.0, above: Datum::Home }));
        }
        18_000 => return command(VehicleCommand::Land),
        _ if ms.is_multiple_of(1_000) => return Some(Uplink::Heartbeat),
        _ => {}
    }
    match random.next_u32() % 300 {
        // The station only sends parameters before the vehicle flies.
        number if ms < 9_500 && number != 4 => None,
        0 => command(VehicleCommand::Speed(1.0 + (random.next_u32() % 5) as f32)),
        1 => command(VehicleCommand::Engage),
        2 => command(VehicleCommand::SelectStandardMode((random.next_u32() % 8) as u8)),
        3 => command(VehicleCommand::Home(None)),
        4 => {
            let speed_m_s = 2.0_f32 + (random.next_u32() % 9) as f32;
            Some(set(b"MPC_XY_VEL_MAX", speed_m_s.to_le_bytes(), REAL32))
        }
        5 => Some(Uplink::State { sent_us: ms * 1_000, state: State::default(), sigmas: Default::default() }),
        6 if ms > 12_000 => command(VehicleCommand::Return),
        _ => None,
    }
}

/// Returns a message that sets a parameter.
fn set(name: &[u8], value: [u8; 4], kind: u8) -> Uplink {
    let mut letters = [0; 16];
    letters.iter_mut().zip(name).for_each(|(to, from)| *to = *from);
    Uplink::Parameter(ParameterRequest::Set { name: letters, value, kind })
}

/// Flies with noise on the link and returns the log.
pub(crate) fn fly(scenario: &Scenario, seed: u64, ticks: u64) -> Vec<u8> {
    fly_with(Host::new().unwrap(), scenario, seed, ticks, false)
}

/// Flies with this host and returns the log. With `faults`, sensors and a rotor fail now and then.
pub(crate) fn fly_with(mut host: Host, scenario: &Scenario, seed: u64, ticks: u64, faults: bool) -> Vec<u8> {
    let log = Rc::new(RefCell::new(Vec::new()));
    let sink = Rc::clone(&log);
    host.record(move |frame| sink.borrow_mut().extend_from_slice(frame));
    let battery = BatteryStatus { voltage_mv: 12_500, current_ca: 500, ..BatteryStatus::default() };
    host.comms().set_aux_sensors(AuxSensors { battery: Some(battery), ..AuxSensors::default() });
    let mut world = World::released(&Scenario { seed, ..scenario.clone() }, 1e-3).unwrap();
    let (mut random, mut sender) = (Xoshiro256PlusPlus::seed_from_u64(seed), Encoder::new(STATION));
    let (mut speeds, mut buffer) = (RotorSpeeds::<ROTORS_MAX>::default(), [0; FRAME_MAX]);
    let (mut fault, mut fault_ms) = (None, 0);
    for ms in 0..ticks {
        world.advance(&speeds);
        world.look();
        let mut readings = world.readings().copied().unwrap_or_default();
        if faults && ms > 10_000 && fault_ms == 0 {
            (fault, fault_ms) = (Some(random.next_u32() % 5), 100 + random.next_u32() % 1_000);
        }
        fault_ms = fault_ms.saturating_sub(1);
        match fault {
            Some(0) => readings.imu = readings.imu.filter(|_| ms % 7 == 0),
            Some(1) => readings.aids = Default::default(),
            Some(2) => readings.aids.iter_mut().flatten().for_each(|aid| aid.age_us += 200_000),
            _ => {}
        }
        host.sense(&readings);
        let mut bytes =
            sends(ms, &mut random).map_or(Vec::new(), |message| sender.send(&message, &mut buffer).to_vec());
        if random.next_u32() % 50 == 0 {
            bytes.extend((0..random.next_u32() % 40).map(|_| random.next_u32() as u8));
        }
        // Ticks are also late, by up to 20 us.
        let tick = host.tick(&bytes, 1_000 * (ms + 1) + u64::from(random.next_u32() % 20), 50.0);
        speeds = tick.report.motors;
        if fault == Some(3) {
            speeds.0[seed as usize % 4] *= 0.8;
        }
    }
    drop(host);
    Rc::try_unwrap(log).unwrap().into_inner()
}

pub(crate) fn records(log: &[u8]) -> Vec<Record> {
    let mut frames = Frames::default();
    let records = log.iter().filter_map(|byte| frames.take(*byte)).collect();
    assert_eq!(frames.damaged(), 0);
    records
}

pub(crate) fn log_of(records: &[Record]) -> Vec<u8> {
    records.iter().flat_map(|record| write(record, &mut [0; RECORD_MAX]).unwrap().to_vec()).collect()
}
