//! The battery failsafe with its default parameters, in closed loop: it warns, returns, and lands in place before the
//! battery is empty.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "tests")]

use afbc_comms::services::modes::custom;
use afbc_comms::services::origin::EarthOrigin;
use afbc_guidance::FlightMode;
use afbc_mavlink::{
    Address, Datum, Decoder, Downlink, Encoder, FRAME_MAX, GlobalPosition, Height, Uplink, VehicleCommand,
};
use afbc_plant::BatteryModel;
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};
use nalgebra::Vector3;

const STATION: Address = Address { system: 255, component: 190 };
/// Times of the commands \[ms\].
const ARM: u64 = 6_000;
const TAKE_OFF: u64 = 6_300;
const GO: u64 = 12_000;
/// Longest flight \[ms\].
const END: u64 = 400_000;
/// Target \[m\], so far away that the return takes longer than the time from battery critical to almost empty.
const FAR: [f32; 3] = [200.0, 0.0, 10.0];

/// State in one step.
#[derive(Clone, Copy, Debug)]
struct BatterySample {
    charge: f64,
    place_m: Vector3<f64>,
}

#[test]
fn an_empty_battery_warns_returns_and_lands() {
    let mut scenario = fleet(&built_in("outdoor").unwrap().read().unwrap(), 1).unwrap().pop().unwrap();
    let battery = scenario.realism.rotors.battery.unwrap();
    scenario.realism.rotors.battery = Some(BatteryModel { initial_charge: 0.2, capacity_a_h: 0.9, ..battery });
    let (mut server, mut sender) = (Server::new(&[scenario], 1).unwrap(), Encoder::new(STATION));
    let mut decoder = Decoder::<Downlink>::new(STATION);
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).unwrap();
    let [latitude_e7, longitude_e7] = origin.global(&Vector3::from(FAR)).e7();
    let place = GlobalPosition { latitude_e7, longitude_e7, height: Height { metres: FAR[2], above: Datum::Home } };
    let go = VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: Some(10.0), changes_mode: true };

    // Collect every change of mode with its state, and every line about the battery.
    let (mut modes, mut lines) = (Vec::<(u32, BatterySample)>::new(), Vec::<(String, BatterySample)>::new());
    let mut has_landed = false;
    for ms in 0..END {
        let message = match ms {
            ARM => Some(Uplink::Command(VehicleCommand::Arm)),
            TAKE_OFF => Some(Uplink::Command(VehicleCommand::TakeOff(Height { metres: f32::NAN, above: Datum::Home }))),
            GO => Some(Uplink::Command(go)),
            _ if ms % 1_000 == 0 => Some(Uplink::Heartbeat),
            _ => None,
        };
        if let Some(message) = message {
            server.hear(0, 1, sender.send(&message, &mut [0; FRAME_MAX]));
        }
        let plant = server.vehicles().first().unwrap().world().plant();
        let charge = plant.telemetry().unwrap().battery.unwrap().charge;
        let sample = BatterySample { charge, place_m: plant.motion().position_m };
        let hear = |_, bytes: &[u8]| {
            decoder.feed(bytes, |_, message| match message {
                Downlink::Heartbeat { mode, armed: true, .. } if modes.last().is_none_or(|last| last.0 != mode) => {
                    modes.push((mode, sample));
                }
                _ => {}
            });
        };
        let log = |line: &str| {
            has_landed |= line.ends_with("disarmed");
            if line.contains("battery") {
                lines.push((line.to_owned(), sample));
            }
        };
        let _ = server.step(hear, log);
        if has_landed {
            break;
        }
    }
    assert!(has_landed, "{modes:?} {lines:?}");

    let told = |what: &str| lines.iter().find(|(line, _)| line.contains(what)).map(|(_, sample)| *sample).unwrap();
    // The simulated battery monitor reports whole percents, rounded down.
    for (what, threshold) in [("battery low", 0.15), ("battery critical", 0.07), ("battery almost empty", 0.05)] {
        let charge = told(what).charge;
        assert!((threshold - 0.002..=threshold).contains(&charge), "{what}: {charge} {lines:?}");
    }
    let [returns, lands] = [FlightMode::Return, FlightMode::Land].map(|mode| {
        let first = modes.iter().find(|(told, _)| *told == custom(mode));
        first.map(|(_, sample)| *sample).unwrap_or_else(|| panic!("{modes:?}"))
    });
    // Heartbeats report the mode once per second.
    for (sample, cause) in [(returns, "battery critical"), (lands, "battery almost empty")] {
        assert!(sample.charge <= told(cause).charge && told(cause).charge - sample.charge < 0.01, "{modes:?}");
    }
    // A low battery only warns. The vehicle returned a good part of the way, landed in place, and had charge left.
    assert_eq!(modes.iter().filter(|(_, sample)| (0.07..0.15).contains(&sample.charge)).count(), 0, "{modes:?}");
    let from_home = |sample: &BatterySample| sample.place_m.xy().norm();
    let end = server.vehicles().first().unwrap().world().plant();
    let landed =
        BatterySample { charge: end.telemetry().unwrap().battery.unwrap().charge, place_m: end.motion().position_m };
    assert!(from_home(&lands) < from_home(&returns) - 20.0 && from_home(&lands) > 20.0, "{returns:?} {lands:?}");
    assert!((landed.place_m - lands.place_m).xy().norm() < 10.0, "{lands:?} {landed:?}");
    assert!(landed.charge > 0.0 && landed.place_m.z < 0.3, "{landed:?}");
}
