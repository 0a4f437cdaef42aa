//! Tests the repetitions of jumps, and the refusal of invalid ones.

use super::*;

/// Flies the mission as a guidance that completes each item at once. Returns the items' numbers in order.
fn flown(missions: &mut Missions, most: usize) -> List<u16> {
    let (mut wanted, mut done) = (0, List::new());
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
    while let Some(leg) = missions.leg(wanted, Some(&origin), 0.0).filter(|_| done.len() < most) {
        done.push(leg.number);
        missions.reached(leg.number);
        if leg.is_last {
            break;
        }
        wanted = if let Item::Jump(to) = leg.item { to } else { leg.number + 1 };
    }
    done
}

fn jump(number: u16, to: u16, repeats: f32) -> MissionItem {
    MissionItem { command: 177, parameters: [f32::from(to), repeats, 0.0, 0.0], x: 0, y: 0, z: 0.0, ..waypoint(number) }
}

/// Each jump is repeated as often as it says, again in each round of an outer jump, and anew after a restart.
#[test]
fn jumps_are_repeated() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0), waypoint(1), jump(2, 1, 2.0), waypoint(3)]);
    assert_eq!(flown(&mut missions, 99), [0, 1, 2, 1, 2, 1, 2, 3]);
    assert_eq!(flown(&mut missions, 4), [0, 1, 2, 1]);
    missions.restart();
    assert_eq!(flown(&mut missions, 99), [0, 1, 2, 1, 2, 1, 2, 3]);
    upload(&mut missions, &[waypoint(0), jump(1, 0, 1.0), jump(2, 0, 1.0)]);
    assert_eq!(flown(&mut missions, 99), [0, 1, 0, 1, 2, 0, 1, 0, 1, 2], "one within the other");
    upload(&mut missions, &[waypoint(0), jump(1, 0, -1.0)]);
    assert_eq!(flown(&mut missions, 1001).len(), 1001, "for ever");
    upload(&mut missions, &[jump(0, 2, 1.0), waypoint(1), waypoint(2)]);
    assert_eq!(flown(&mut missions, 99), [0, 2], "ahead");
    upload(&mut missions, &[waypoint(0), jump(1, 0, 0.0)]);
    assert_eq!(flown(&mut missions, 99), [0, 1], "never");
}

/// A mission with a jump to a missing item or an endless loop without a flight is refused as a whole.
#[test]
fn jumps_without_an_end_are_refused() {
    let speed =
        |number| MissionItem { command: 178, x: 0, y: 0, z: 0.0, parameters: [1.0, 2.0, 0.0, 0.0], ..waypoint(number) };
    let nine: List<_> = (0..10).map(|number| if number == 0 { waypoint(0) } else { jump(number, 0, 1.0) }).collect();
    let cases: &[(&[MissionItem], u16, &str)] = &[
        (&[waypoint(0), jump(1, 2, 1.0)], 1, "the jump's target does not exist"),
        (&[waypoint(0), jump(1, 1, 1.0), waypoint(2)], 1, "the jump's target does not exist"),
        (&[waypoint(0), speed(1), jump(2, 1, -1.0)], 2, "jump loops without a waypoint"),
        (&[jump(0, 2, -1.0), waypoint(1), jump(2, 0, -1.0)], 0, "jump loops without a waypoint"),
        (&nine, 9, "more than 8 jumps"),
    ];
    for (items, number, reason) in cases {
        let mut missions = Missions::default();
        missions.hear(MissionMessage::Count(items.len() as u16, PLAN), A, true, 0, &NOWHERE);
        let take = |item: &MissionItem| {
            said(&mut missions);
            missions.hear(MissionMessage::Item(*item, PLAN), A, true, 0, &NOWHERE)
        };
        let heard = items.iter().map(take).last();
        let text = Words::of("mission item ").number((*number).into()).and(": ").and(reason);
        assert_eq!(heard.expect("an item").text, Some(text));
        assert!(missions.items().is_empty());
    }
    // These loops end or take time.
    for items in [
        &[waypoint(0), speed(1), jump(2, 1, 1000.0)][..],
        &[waypoint(0), jump(1, 0, -1.0)],
        &[jump(0, 2, 1.0), waypoint(1), jump(2, 0, -1.0)],
    ] {
        let mut missions = Missions::default();
        assert_eq!(
            upload(&mut missions, items),
            [(MissionMessage::Ack(MissionResult::ACCEPTED, PLAN), A)],
            "{items:?}"
        );
    }
}
