//! Tests of the inbox: order of requests, rejection of implausible values, and ages.

use afbc_flight_core::inbox::QUEUE_MAX;
use afbc_flight_core::{Inbox, Reasons, Refusal, Request, Stamped, Ticketed};
use afbc_types::{Pose, PoseSigmas, Setpoint, State};
use nalgebra::Vector3;

fn asked(request: Request, ticket: usize) -> Ticketed<Request> {
    Ticketed { value: request, ticket: ticket as u8 }
}

/// The inbox passes on one request per tick in order, whether it was queued directly or merged.
#[test]
fn requests_wait_for_their_turn() {
    let all = [Request::Arm, Request::Disarm, Request::Engage, Request::Kill];
    let (mut inbox, mut news) = (Inbox::default(), Inbox::default());
    for (ticket, request) in all.into_iter().enumerate() {
        let to = if ticket < 2 { &mut inbox } else { &mut news };
        assert!(to.request(asked(request, ticket)));
    }
    inbox.merge(&news);
    for (ticket, request) in all.into_iter().enumerate() {
        assert!(inbox.kills(), "it is among those that wait");
        assert_eq!(inbox.take().asked(), Some(asked(request, ticket)));
    }
    assert_eq!(inbox.take().asked(), None, "a request is done with");
    assert!(!inbox.kills());
}

#[test]
fn a_full_inbox_takes_the_request_to_kill_only() {
    let mut inbox = Inbox::default();
    for ticket in 0..QUEUE_MAX {
        assert!(inbox.request(asked(Request::Arm, ticket)));
    }
    let full = inbox.clone();
    assert!(!inbox.request(asked(Request::Disarm, 99)));
    assert_eq!(inbox, full);
    assert!(inbox.request(asked(Request::Kill, 99)));
    assert!(inbox.kills());
}

#[test]
fn implausible_values_do_not_enter_the_inbox() {
    let good = (Stamped { value: State::default(), at_us: 1 }, Stamped { value: Setpoint::default(), at_us: 1 });
    let mut inbox = Inbox::EMPTY;
    inbox.put_state(good.0);
    inbox.put_setpoint(good.1);
    for bad in [f32::NAN, f32::INFINITY, 2e5] {
        let position_m = Vector3::new(0.0, bad, 0.0);
        let mut news = Inbox::EMPTY;
        news.put_state(Stamped { value: State { position_m, ..State::default() }, at_us: 2 });
        news.put_setpoint(Stamped { value: Setpoint { position_m, ..Setpoint::default() }, at_us: 2 });
        assert_eq!(news, Inbox::EMPTY, "{bad}");
        inbox.merge(&news);
    }
    assert_eq!((inbox.state(), inbox.setpoint()), (Some(&good.0), Some(&good.1)), "the last good ones stay");
}

/// Each pose is seen by one tick, and the newest one only. An implausible pose is seen by none.
#[test]
fn a_pose_is_taken_once() {
    let at = |x, at_us| Stamped { value: Pose { position_m: Vector3::new(x, 0.0, 0.0), ..Pose::default() }, at_us };
    let (mut inbox, mut taken) = (Inbox::EMPTY, Inbox::EMPTY);
    for (number, at_us) in [(1.0, 10), (2.0, 20)] {
        let mut news = Inbox::EMPTY;
        news.put_pose(at(number, at_us));
        inbox.merge(&news);
    }
    inbox.merge(&Inbox::EMPTY);
    inbox.take_into(&mut taken);
    assert_eq!(taken.pose(), Some(&at(2.0, 20)));
    inbox.take_into(&mut taken);
    assert_eq!(taken.pose(), None);

    let no_rotation = Pose { attitude: [0.5, 0.0, 0.0, 0.0], ..Pose::default() };
    let unsure = |sigma| Pose { sigmas: PoseSigmas { position_m: Some(sigma), attitude_rad: None }, ..Pose::default() };
    let turned = |sigma| Pose { sigmas: PoseSigmas { position_m: None, attitude_rad: Some(sigma) }, ..Pose::default() };
    for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        for value in [unsure(bad), turned(bad), no_rotation, at(2e5, 0).value, at(f32::NAN, 0).value] {
            inbox.put_pose(Stamped { value, at_us: 30 });
            assert_eq!(inbox, Inbox::EMPTY, "{value:?}");
        }
    }
}

#[test]
fn a_stamp_from_the_future_is_infinitely_old() {
    let stamped = Stamped { value: (), at_us: 1000 };
    assert_eq!(stamped.age_us(1000), 0);
    assert_eq!(stamped.age_us(4000), 3000);
    assert_eq!(stamped.age_us(999), u32::MAX);
}

/// Every value of a setpoint reaches the tick, also when it replaces the last one.
#[test]
fn a_setpoint_is_taken_whole() {
    let vector = |first: f32| Vector3::new(first, first + 0.1, first + 0.2);
    let value = Setpoint {
        position_m: vector(1.0),
        velocity_m_s: vector(2.0),
        acceleration_m_s2: vector(3.0),
        jerk_m_s3: vector(4.0),
        snap_m_s4: vector(5.0),
        yaw_rad: 0.6,
        yaw_rate_rad_s: 0.7,
        yaw_acceleration_rad_s2: 0.8,
    };
    let (mut inbox, mut taken) = (Inbox::EMPTY, Inbox::EMPTY);
    for at_us in [7, 9] {
        inbox.put_setpoint(Stamped { value, at_us });
        inbox.take_into(&mut taken);
        assert_eq!(taken.setpoint(), Some(&Stamped { value, at_us }));
        inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us: at_us + 1 });
        inbox.take_into(&mut taken);
        assert_eq!(taken.setpoint(), Some(&Stamped { value: Setpoint::default(), at_us: at_us + 1 }));
    }
}

/// An own estimate, an own estimate without a position, and a state from the link replace one another.
#[test]
fn one_state_stands_at_a_time() {
    let at = |at_us| Stamped { value: State::default(), at_us };
    let mut inbox = Inbox::EMPTY;
    inbox.put_state(at(1));
    assert!(!inbox.is_own() && inbox.missing().is_none());
    inbox.locate(at(2));
    assert_eq!((inbox.state(), inbox.is_own()), (Some(&at(2)), true));
    assert!(inbox.take().is_own());
    inbox.put_position_lost(Some(at(3)), Refusal::PositionUnknown);
    assert_eq!(
        (inbox.state(), inbox.position_lost(), inbox.missing()),
        (None, Some(&at(3)), Some(Refusal::PositionUnknown))
    );
    let taken = inbox.take();
    assert_eq!((taken.state(), taken.position_lost(), taken.missing()), (None, Some(&at(3)), inbox.missing()));
    inbox.locate(at(4));
    assert_eq!((inbox.position_lost(), inbox.missing()), (None, None));
    inbox.put_state(at(5));
    assert!(!inbox.is_own());
    // An estimate without any state leaves the link's.
    inbox.put_position_lost(None, Refusal::AttitudeUnknown);
    assert_eq!(
        (inbox.state(), inbox.position_lost(), inbox.missing()),
        (Some(&at(5)), None, Some(Refusal::AttitudeUnknown))
    );
}

/// Merging replaces the values that the newer inbox has, and keeps the rest.
#[test]
fn news_are_merged() {
    let at = |at_us| Stamped { value: State::default(), at_us };
    let mut inbox = Inbox::EMPTY;
    inbox.put_state(at(1));
    inbox.put_position_lost(None, Refusal::HeadingUnknown);
    inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us: 1 });
    inbox.inhibit(Refusal::BatteryLow.into());
    let before = inbox.clone();
    inbox.merge(&Inbox::EMPTY);
    assert_eq!(inbox, before);
    let mut news = Inbox::EMPTY;
    news.put_position_lost(Some(at(2)), Refusal::PositionUnknown);
    news.inhibit(Refusal::SensorFailed.into());
    inbox.merge(&news);
    assert_eq!((inbox.position_lost(), inbox.missing()), (Some(&at(2)), Some(Refusal::PositionUnknown)));
    assert_eq!((inbox.state(), inbox.inhibited()), (Some(&at(1)), Refusal::SensorFailed.into()));
    assert_eq!(inbox.take().inhibited(), Refusal::SensorFailed.into());
    inbox.inhibit(Reasons::NONE);
    assert_eq!(inbox.inhibited(), Reasons::NONE);
    inbox.put_pose(Stamped { value: Pose::default(), at_us: 3 });
    inbox.clear_pose();
    assert_eq!(inbox.take().pose(), None);
}
