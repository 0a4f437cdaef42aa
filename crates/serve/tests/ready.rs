//! The time at which stations consider the vehicle ready.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_mavlink::{Address, CommandResult, Decoder, Downlink, Encoder, FRAME_MAX, Telemetry, Uplink, VehicleCommand};
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};

const STATION: Address = Address { system: 255, component: 190 };
const ARM: u16 = VehicleCommand::Arm.id();
const HOME_POSITION: u32 = 242;

/// Like MAVSDK's examples, a client arms as soon as position and home are reported, and checks nothing else. The
/// vehicle must accept.
#[test]
fn whoever_arms_once_home_is_known_is_not_refused() {
    for (scenario, seed) in [("outdoor", 1), ("outdoor", 2), ("outdoor", 3), ("outdoor", 4)] {
        let mut scenario = built_in(scenario).unwrap().read().unwrap();
        scenario.seed = seed;
        let mut server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        let (mut decoder, mut said) = (Decoder::<Downlink>::new(STATION), Vec::new());
        let say = |server: &mut Server, command| {
            server.hear(0, 1, Encoder::new(STATION).send(&Uplink::Command(command), &mut [0; FRAME_MAX]));
        };
        // Request HOME_POSITION as often as possible, so that the client arms at the earliest time.
        say(&mut server, VehicleCommand::SetInterval { message: HOME_POSITION, interval_us: 1_000 });
        let (mut asked, mut answer) = (false, None);
        for _ in 0..20_000 {
            let _ = server.step(|_, bytes| decoder.feed(bytes, |_, message| said.push(message)), |_| ());
            for message in said.drain(..) {
                match message {
                    Downlink::Telemetry(Telemetry::HomePosition(_)) if !asked => {
                        asked = true;
                        say(&mut server, VehicleCommand::Arm);
                    }
                    Downlink::CommandAck { command: ARM, answer: reported, .. } => answer = Some(reported),
                    _ => {}
                }
            }
        }
        assert_eq!(answer, Some(CommandResult::Accepted), "{}, seed {seed}", scenario.name);
    }
}
