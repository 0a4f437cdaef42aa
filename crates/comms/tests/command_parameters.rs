//! Each parameter of each accepted command and mission item in MAVLink's common dialect is either used, or refused if
//! it is set.

use crate::common::Bench;
use afbc_comms::services::mission::{check, to_guidance};
use afbc_comms::services::origin::EarthOrigin;
use afbc_mavlink::{Address, CommandResult, Decoder, Downlink, MissionItem, Uplink, VehicleCommand};

/// Handling of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Use {
    /// The parameter is reserved or not supported: it must be 0 or NaN.
    No,
    /// The parameter has an effect.
    Yes,
    /// The parameter is checked. These values other than 0 have no effect.
    But(&'static [f32]),
}

use Use::{But, No, Yes};

/// Number of a command, valid values of its parameters, and the handling of each.
struct Row(u16, [f32; 7], [Use; 7]);

const NAN: f32 = f32::NAN;
const HERE: [f32; 3] = [47.397_74, 8.545_594, 490.0];
const NONE: [f32; 7] = [0.0; 7];
const UNUSED: [Use; 7] = [No; 7];

/// Returns parameters 1 to 4 followed by a place.
const fn placed([a, b, c, d]: [f32; 4]) -> [f32; 7] {
    let [x, y, z] = HERE;
    [a, b, c, d, x, y, z]
}

/// The accepted commands of the dialect (`MAV_CMD` in common.xml).
const COMMANDS: &[Row] = &[
    Row(20, NONE, UNUSED),
    // The parameters are abort altitude, precision landing, heading and place. They are unused, because the vehicle
    // lands where it is.
    Row(21, NONE, UNUSED),
    // The parameters are pitch (-1 for none), flags, heading and place, which must be unused, and the height.
    Row(22, NONE, [But(&[-1.0]), No, No, No, No, No, Yes]),
    Row(34, placed([10.0, 2.0, 0.0, 0.0]), [Yes, Yes, Yes, Yes, Yes, Yes, Yes]),
    // Of the mode flags only the custom mode flag is used: stations repeat the vehicle's other flags.
    Row(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0], [But(&[5.0, 7.0, 77.0, 12.5]), Yes, Yes, No, No, No, No]),
    // Airspeed means ground speed, since no sensor measures airspeed. The throttle is not changed.
    Row(178, [1.0, 5.0, -1.0, 0.0, 0.0, 0.0, 0.0], [But(&[0.0]), Yes, But(&[-1.0, -2.0]), No, No, No, No]),
    Row(179, placed([0.0; 4]), [Yes, No, No, No, Yes, Yes, Yes]),
    Row(179, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    // Any speed below 0 means the default.
    Row(192, placed([-1.0, 1.0, 0.0, NAN]), [But(&[-3.0, -1.0, -2.0]), Yes, No, Yes, Yes, Yes, Yes]),
    Row(224, NONE, [Yes, Yes, No, No, No, No, No]),
    Row(241, NONE, [Yes; 7]),
    Row(245, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, But(&[-1.0]), No, No, No, No, No]),
    Row(246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    Row(262, [7.0, 0.0, 0.0, 0.0, 0.0, 0.0, NAN], [Yes, No, No, No, No, No, No]),
    Row(300, NONE, [Yes, Yes, No, No, No, No, No]),
    Row(400, NONE, [Yes, Yes, No, No, No, No, No]),
    Row(400, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    Row(401, NONE, UNUSED),
    Row(510, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    // All messages go to all stations, including the one that asks. All intervals below 0 mean "off".
    Row(511, [30.0, 5e4, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, Yes, No, No, No, No, But(&[1.0, 2.0])]),
    Row(512, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, Yes, No, No, No, No, But(&[1.0, 2.0])]),
    Row(519, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    Row(520, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, No, No, No, No, No]),
    Row(2510, NONE, [Yes, No, No, No, No, No, No]),
    Row(2511, NONE, UNUSED),
    Row(31_010, NONE, UNUSED),
    Row(31_011, NONE, UNUSED),
];

/// Numbers that are tried for each parameter. Each has a meaning for some command.
const ASKING: [f32; 10] = [1.0, -1.0, 2.0, -2.0, -3.0, 5.0, 7.0, 12.5, 77.0, f32::INFINITY];

/// Builds a station's frame with the right checksum.
fn frame(message: u8, extra_crc: u8, payload: &[u8]) -> Vec<u8> {
    let head = [0xFD, payload.len() as u8, 0, 0, 0, 255, 190, message, 0, 0];
    let mut frame = [head.as_slice(), payload].concat();
    let crc = mavlink::calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

/// Builds a command as COMMAND_LONG, and as COMMAND_INT if its integers can hold the values.
fn frames(id: u16, parameters: [f32; 7]) -> Vec<Vec<u8>> {
    let bytes = |numbers: &[f32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>();
    let long = [bytes(&parameters), id.to_le_bytes().to_vec(), vec![1, 1, 0]].concat();
    let mut frames = vec![frame(76, 152, &long)];
    let [first, .., x, y, z] = parameters;
    let is_placed = [34, 179, 192].contains(&id) && !(id == 179 && first == 1.0);
    let exact = |value: f32| value.is_nan() || value.abs() < 180.0 && (is_placed || value.fract() == 0.0);
    // The height of a take-off has another meaning in COMMAND_INT.
    if exact(x) && exact(y) && id != 22 {
        let units = if is_placed { 1e7 } else { 1.0 };
        let whole = |value: f32| if value.is_nan() { i32::MAX } else { (f64::from(value) * units) as i32 };
        let place = [whole(x), whole(y)].into_iter().flat_map(i32::to_le_bytes).collect();
        let int = [bytes(&parameters[..4]), place, bytes(&[z]), id.to_le_bytes().to_vec(), vec![1, 1, 0, 0, 0]];
        frames.push(frame(75, 158, &int.concat()));
    }
    frames
}

fn read(frame: &[u8]) -> VehicleCommand {
    let mut command = None;
    Decoder::new(Address { system: 1, component: 1 }).feed(frame, |_, message| match message {
        Uplink::Command(read) => command = Some(read),
        other => panic!("{other:?}"),
    });
    command.expect("a command")
}

/// Returns the vehicle's first answer.
fn answer(frame: &[u8]) -> CommandResult {
    let mut bench = Bench::new();
    bench.step();
    bench.hear_bytes(frame);
    let said: Vec<_> = (0..5).flat_map(|_| bench.step().1).collect();
    let answer = said.iter().find_map(|message| match message {
        Downlink::CommandAck { answer, .. } => Some(*answer),
        _ => None,
    });
    answer.expect("answered")
}

#[test]
fn every_parameter_of_every_command_is_used_or_refused() {
    let mut rows: Vec<u16> = COMMANDS.iter().map(|Row(id, ..)| *id).collect();
    rows.dedup();
    assert!(
        VehicleCommand::KNOWN.iter().all(|id| rows.contains(id)) && rows.len() == VehicleCommand::KNOWN.len(),
        "{rows:?}"
    );
    for Row(id, parameters, uses) in COMMANDS {
        for (kind, usual) in frames(*id, *parameters).iter().enumerate() {
            assert!(
                !matches!(read(usual), VehicleCommand::Denied(_) | VehicleCommand::Other(_)),
                "{id}: {:?}",
                read(usual)
            );
            for (place, use_of) in uses.iter().enumerate() {
                for value in ASKING.into_iter().chain([0.0, NAN]) {
                    let mut asked = *parameters;
                    asked[place] = value;
                    let Some(sent) = frames(*id, asked).get(kind).cloned() else { continue };
                    let (found, usual) = (format!("{:?}", read(&sent)), format!("{:?}", read(usual)));
                    let what = format!("{id}, parameter {}: {value}, by message {kind}", place + 1);
                    let denied = found == format!("{:?}", VehicleCommand::Denied(*id));
                    if *use_of == No {
                        assert_eq!(denied, !(value == 0.0 || value.is_nan()), "{what}: {found}");
                    } else if !denied && found == usual {
                        let asks_for_nothing = match use_of {
                            But(values) => values.contains(&value),
                            _ => false,
                        };
                        let same = value == 0.0 || value.is_nan() || value == parameters[place];
                        assert!(asks_for_nothing || same, "{what} is ignored");
                    }
                    if denied {
                        assert_eq!(answer(&sent), CommandResult::Denied, "{what}");
                    }
                }
            }
        }
    }
}

/// A command to stop the motors is accepted regardless of its other parameters.
#[test]
fn a_kill_is_one_whatever_else_it_says() {
    for place in 2..7 {
        for value in ASKING {
            let mut parameters = [0.0, 21_196.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            parameters[place] = value;
            for sent in frames(400, parameters) {
                assert_eq!((read(&sent), answer(&sent)), (VehicleCommand::Kill, CommandResult::Accepted));
            }
        }
    }
}

/// The accepted mission items. The heights of a landing and of a region of interest give the height of the ground,
/// which the vehicle finds itself.
const ITEMS: &[Row] = &[
    Row(16, placed([0.0, 0.0, 0.0, NAN]), [Yes, Yes, No, Yes, Yes, Yes, Yes]),
    Row(17, placed([0.0, 0.0, 0.0, NAN]), [No, No, No, Yes, Yes, Yes, Yes]),
    Row(18, placed([1.0, 0.0, 10.0, NAN]), [Yes, No, Yes, No, Yes, Yes, Yes]),
    Row(19, placed([0.0, 0.0, 0.0, NAN]), [Yes, No, No, Yes, Yes, Yes, Yes]),
    Row(20, NONE, UNUSED),
    Row(21, placed([0.0; 4]), [No, No, No, No, Yes, Yes, Yes]),
    // The first parameter is the pitch of fixed-wing aircraft, for which QGroundControl writes 15 degrees into plans.
    Row(
        22,
        placed([0.0; 4]),
        [But(&[1.0, -1.0, 2.0, -2.0, -3.0, 5.0, 7.0, 12.5, 77.0, f32::INFINITY]), No, No, No, Yes, Yes, Yes],
    ),
    Row(31, placed([0.0; 4]), [No, No, No, No, Yes, Yes, Yes]),
    Row(93, [3.0, -1.0, -1.0, -1.0, 0.0, 0.0, 0.0], [Yes, But(&[-1.0]), But(&[-1.0]), But(&[-1.0]), No, No, No]),
    Row(115, [90.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, No, Yes, Yes, No, No, No]),
    Row(177, [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0], [Yes, Yes, No, No, No, No, No]),
    Row(178, [1.0, 5.0, -1.0, 0.0, 0.0, 0.0, 0.0], [But(&[0.0]), Yes, But(&[-1.0, -2.0]), No, No, No, No]),
    Row(195, placed([0.0; 4]), [No, No, No, No, Yes, Yes, But(&[1.0, -1.0, 2.0, -2.0, -3.0, 5.0, 7.0, 12.5, 77.0])]),
    Row(197, NONE, UNUSED),
    Row(201, placed([3.0, 0.0, 0.0, 0.0]), [Yes, No, No, No, Yes, Yes, Yes]),
    Row(201, NONE, [Yes, No, No, No, No, No, No]),
];

fn item(command: u16, [p1, p2, p3, p4, x, y, z]: [f32; 7]) -> MissionItem {
    let whole = |degrees: f32| if degrees.is_nan() { i32::MAX } else { (f64::from(degrees) * 1e7) as i32 };
    let (x, y, parameters) = (whole(x), whole(y), [p1, p2, p3, p4]);
    MissionItem { number: 0, command, frame: 0, is_current: false, goes_on: true, parameters, x, y, z }
}

#[test]
fn every_parameter_of_every_item_is_used_or_refused() {
    for id in 0..=u16::MAX {
        let plain = [placed([0.0; 4]), NONE, placed([1.0, 0.0, 10.0, NAN]), [1.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0]];
        let accepted = plain.into_iter().any(|parameters| check(&item(id, parameters)).is_ok());
        assert_eq!(accepted, ITEMS.iter().any(|Row(known, ..)| *known == id), "{id}");
    }
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
    let flown = |item: &MissionItem| format!("{:?}", to_guidance(item, Some(&origin), 0.0));
    for Row(id, parameters, uses) in ITEMS {
        let usual = item(*id, *parameters);
        assert_eq!(check(&usual), Ok(()), "{id}");
        for (place, use_of) in uses.iter().enumerate() {
            for value in ASKING.into_iter().chain([0.0, NAN]) {
                if value.is_infinite() && [4, 5].contains(&place) {
                    // An infinite coordinate cannot be converted to an integer.
                    continue;
                }
                let mut asked = *parameters;
                asked[place] = value;
                let asked = item(*id, asked);
                let what = format!("{id}, parameter {}: {value}", place + 1);
                match (use_of, check(&asked)) {
                    (No, Ok(())) => assert!(value == 0.0 || value.is_nan(), "{what} is ignored"),
                    (No, Err(invalid)) => {
                        assert!(!(value == 0.0 || value.is_nan()), "{what}: {invalid:?}");
                        assert_eq!(usize::from(invalid.result.0), 6 + place, "{what}: {invalid:?}");
                    }
                    (_, Err(_)) => (),
                    // The mission service, not the guidance, counts the repetitions of a jump.
                    (Yes, Ok(())) if (*id, place) == (177, 1) => (),
                    (_, Ok(())) if flown(&asked) != flown(&usual) => (),
                    (But(values), Ok(())) if values.contains(&value) => (),
                    (_, Ok(())) => {
                        assert!(value == 0.0 || value.is_nan() || value == parameters[place], "{what} is ignored");
                    }
                }
            }
        }
    }
}
