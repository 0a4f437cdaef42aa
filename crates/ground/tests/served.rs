//! Bring-ups of the firmware's code on simulated sensors in lockstep, and of things that are no board.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_ground::bring_up::{BringUpLog, BringUpOptions, Error, Verdict, bring_up};
use afbc_mavlink::{
    Address, Downlink, Encoder, FRAME_MAX, SIGNED_FRAME_MAX, SigningKey, Stamp, Uplink, VehicleCommand,
};
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};

/// A simulated vehicle at the other end of a line, in lockstep.
struct Served(Server);

impl Served {
    fn new(scenario: &str) -> Self {
        let scenario = built_in(scenario).unwrap().read().unwrap();
        let mut served = Served(Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap());
        (0..3_000).for_each(|_| served.exchange(&[], &mut |_| ()));
        served
    }

    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) {
        self.0.hear(0, 1, uplink);
        let _ = self.0.step(|_, bytes| hear(bytes), |_| ());
    }
}

/// Returns the simulator command for what a person does on this instruction; `wrong` swaps left and right.
fn obeyed(told: &str, wrong: bool) -> Option<String> {
    let (right, left) = if wrong { ("left", "right") } else { ("right", "left") };
    let side = [("level", "down"), ("right side", right), ("left side", left), ("down", "front"), ("up", "back")]
        .into_iter()
        .find(|(word, _)| told.ends_with(word));
    let asked = told.starts_with("hold") || told.starts_with("turn");
    side.filter(|_| asked).map(|(_, side)| format!("hold {side}"))
}

/// Runs a bring-up with a person who does what is asked: each instruction is carried out in the next millisecond.
fn with_a_hand(wrong: bool) -> BringUpLog {
    let orders = std::cell::RefCell::new(Vec::<String>::new());
    let mut served = Served::new("outdoor");
    let options = BringUpOptions { rest_s: 10, is_attended: true };
    let mut exchange = |uplink: &[u8], hear: &mut dyn FnMut(&[u8])| {
        for line in orders.borrow_mut().drain(..) {
            let reply = served.0.line(&line);
            assert!(reply.lines.iter().all(|line| !line.starts_with("error")), "{reply:?}");
        }
        served.exchange(uplink, hear);
        Ok(())
    };
    bring_up(&mut exchange, options, &mut |told| orders.borrow_mut().extend(obeyed(told, wrong))).unwrap()
}

fn verdict(log: &BringUpLog, name: &str) -> (Verdict, String) {
    let step = log.steps.iter().find(|step| step.name == name).unwrap();
    (step.verdict, step.reasons.join("; "))
}

#[test]
fn a_vehicle_in_good_hands_passes_every_step() {
    let log = with_a_hand(false);
    for step in &log.steps {
        assert_eq!(step.verdict, Verdict::Passed, "{}: {:?}\n{}", step.name, step.reasons, log.page());
    }
    let names: Vec<_> = log.steps.iter().map(|step| step.name).collect();
    for wanted in ["noise at rest", "right side down", "nose up", "warmth", "GNSS fix", "battery", "link"] {
        assert!(names.contains(&wanted), "{names:?}");
    }
    assert!(log.parameters.iter().any(|(name, value)| name == "SER_TEL1_BAUD" && value == "460800"));
}

/// Turning the board to the wrong side looks like a board whose y-axis is reversed, and fails.
#[test]
fn a_turn_to_the_other_side_fails() {
    let log = with_a_hand(true);
    for name in ["right side down", "left side down"] {
        let (verdict, reasons) = verdict(&log, name);
        assert_eq!(verdict, Verdict::Failed, "{name}");
        assert!(reasons.contains("the gyroscope does not show"), "{reasons}");
    }
    assert_eq!(verdict(&log, "nose down").0, Verdict::Passed);
    assert!(!log.is_well());
}

/// Without a person, the bring-up does the steps that need none, gives the same log each time, and finds faults.
#[test]
fn alone_it_does_what_needs_no_hand() {
    let run = |fault: &str| {
        let mut served = Served::new("outdoor");
        if !fault.is_empty() {
            served.0.line(fault);
        }
        let options = BringUpOptions { rest_s: 5, is_attended: false };
        let mut exchange = |uplink: &[u8], hear: &mut dyn FnMut(&[u8])| {
            served.exchange(uplink, hear);
            Ok(())
        };
        bring_up(&mut exchange, options, &mut |_| ()).unwrap()
    };
    let log = run("");
    assert!(log.is_well(), "{}", log.page());
    assert_eq!(log.page(), run("").page());
    for name in ["right side down", "warmth"] {
        assert_eq!(verdict(&log, name).0, Verdict::Skipped, "{name}");
    }
    let (stuck, reasons) = verdict(&run("fault imu stuck"), "noise at rest");
    assert_eq!(stuck, Verdict::Failed, "{reasons}");
    assert!(reasons.contains("stuck"), "{reasons}");
    let (noisy, reasons) = verdict(&run("fault imu noisy 0.5 5"), "noise at rest");
    assert_eq!(noisy, Verdict::Failed, "{reasons}");
    let lost = run("fault magnetometer lost");
    let (silent, reasons) = verdict(&lost, "sensors");
    assert_eq!(silent, Verdict::Failed, "{reasons}");
    let (fails, reasons) = verdict(&lost, "self-tests");
    assert_eq!((fails, reasons.as_str()), (Verdict::Failed, "the compass failed its self-test"));
}

/// Something other than a board sends the same bytes each millisecond.
#[test]
fn what_is_no_board_is_named() {
    let beat = |armed| {
        let beat = Downlink::Heartbeat { armed, failsafe: false, mode: 0 };
        Encoder::new(Address { system: 1, component: 1 }).send(&beat, &mut [0; FRAME_MAX]).to_vec()
    };
    let signed = {
        let beat = Downlink::Heartbeat { armed: false, failsafe: false, mode: 0 };
        let (stamp, mut buffer) = (Stamp { link: 0, time_10us: 1 }, [0; SIGNED_FRAME_MAX]);
        let mut vehicle = Encoder::new(Address { system: 1, component: 1 });
        vehicle.send_signed(&beat, Some((&SigningKey([1; 32]), stamp)), &mut buffer).to_vec()
    };
    let arm = Encoder::new(Address { system: 255, component: 190 });
    let mut own = arm;
    let mut uplink = own.send(&Uplink::Command(VehicleCommand::Disarm), &mut [0; FRAME_MAX]).to_vec();
    uplink.extend_from_slice(own.send(&Uplink::Heartbeat, &mut [0; FRAME_MAX]));
    for (bytes, wanted) in [
        (Vec::new(), "sends nothing"),
        (vec![0x24, 0x4d, 0x3c, 0xfd, 0x09, 0x00], "bytes but no MAVLink heartbeat"),
        // The station's own frames, sent back by a wire from TX to RX.
        (uplink, "bytes but no MAVLink heartbeat"),
        (beat(false), "does not run this firmware"),
        (beat(true), "is armed"),
        (signed, "signing key"),
    ] {
        let options = BringUpOptions { rest_s: 1, is_attended: false };
        let mut exchange = |_: &[u8], hear: &mut dyn FnMut(&[u8])| {
            hear(&bytes);
            Ok(())
        };
        let error: Error = bring_up(&mut exchange, options, &mut |_| ()).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(wanted) && text.lines().count() == 1, "{text}");
    }
}
