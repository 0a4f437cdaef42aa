//! Runs the flight core with a law: arms a vehicle at rest, flies it, and descends when the states stop.
//! `cargo run -p afbc-flight-core --example flight_core`.

use afbc::{Adaptive, Controller, Profile};
use afbc_flight_core::{ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Request, Stamped, Ticketed};
use afbc_types::{OutOfRange, Parameters, Setpoint, State};

fn main() -> Result<(), OutOfRange> {
    let parameters = Parameters::PAPER.to_f32();
    let law = Adaptive::new(Profile::Flight.gains_for(&parameters, afbc::LAG_S))?;
    let controller = Controller::new(parameters, Profile::Flight.settings(), law)?;
    let core = FlightCore::new(parameters, ArmingLimits::DEFAULT, controller)?;
    let (mut memory, mut inbox) = (FlightCoreMemory::default(), Inbox::EMPTY);
    let mut last = core.tick(&mut memory, 0, &inbox).mode;
    for ms in 1..=6000_u64 {
        let at_us = 1000 * ms;
        if ms < 4000 {
            // The last digits of a real tracker always change.
            let mut value = State::default();
            value.position_m.z = if ms.is_multiple_of(2) { 1e-5 } else { -1e-5 };
            inbox.put_state(Stamped { value, at_us });
        }
        let mut value = Setpoint::default();
        value.position_m.z = if ms > 2000 { 1.0 } else { 0.0 };
        inbox.put_setpoint(Stamped { value, at_us });
        if ms == 1500 {
            inbox.request(Ticketed { value: Request::Arm, ticket: 0 });
        }
        let outcome = core.tick(&mut memory, at_us, &inbox.take());
        if let Some(answer) = outcome.answer {
            println!("{ms:4} ms: {answer:?}");
        }
        if outcome.mode != last {
            println!("{ms:4} ms: {last:?} -> {:?}", outcome.mode);
            last = outcome.mode;
        }
    }
    assert_eq!(last, Mode::Descending);
    Ok(())
}
