//! The black box of flights: replaying our own log repeats the estimator's work, and a log that was cut off is read up
//! to the cut.

use afbc_hil::{Host, MessagePeriods, Station, place};
use afbc_onboard::Link;
use afbc_replay::{EstimatorStart, Sensor};
use afbc_scenario::{Scenario, built_in};
use std::cell::RefCell;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Flies a built-in scenario with the firmware's code and returns its log.
fn flown(name: &str, duration_s: f64) -> Vec<u8> {
    let scenario = built_in(name).unwrap().read().unwrap();
    let contenders = vec![afbc_hil::firmware(&scenario).unwrap()];
    let scenario = Scenario { duration_s, contenders, ..scenario };
    let mut host = Host::linked(scenario.vehicle_file.as_ref(), Link::DEFAULT).unwrap();
    let log = Rc::new(RefCell::new(Vec::new()));
    let kept = Rc::clone(&log);
    host.log(place(&scenario), move |bytes| kept.borrow_mut().extend_from_slice(bytes));
    let goes_on = |_: &_| ControlFlow::Continue(());
    let end = afbc_hil::fly(&scenario, &mut Station::new(), &mut host, MessagePeriods::LOCKSTEP, goes_on).unwrap();
    assert!(end.lost.is_none() && end.disarmed, "{name}: {end:?}");
    log.take()
}

fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("black_box");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The replayed estimates equal the logged ones, outdoors with receiver, barometer and magnetometer, and indoors with
/// motion capture. The bounds are rounding errors: of a quaternion in f32, and of a state between two samples.
#[test]
fn a_replay_is_the_flight() {
    for (name, sensors) in
        [("outdoor", &[Sensor::Gnss, Sensor::Barometer, Sensor::Magnetometer][..]), ("mocap", &[Sensor::Tracker])]
    {
        let recording = afbc_replay::read(&file(&format!("{name}.ulg"), &flown(name, 9.0))).unwrap();
        assert_eq!(recording.notes, Vec::<String>::new(), "{name}");
        for sensor in sensors {
            assert!(recording.sources.iter().any(|source| source.sensor == *sensor && source.used > 50), "{name}");
        }
        let replayed = afbc_replay::fly(&recording, Some(0.0)).unwrap();
        assert!(matches!(replayed.start, EstimatorStart::AtRest(_)), "{name}: {:?}", replayed.start);
        let figures = &replayed.figures;
        for (figure, most) in [(&figures.attitude, 1e-4), (&figures.velocity, 1e-6), (&figures.position, 1e-6)] {
            // There is a logged attitude every 12 ms and a logged motion every 20 ms, from the estimator's start on.
            assert!(figure.count > 400, "{name}: {figure:?}");
            assert!(figure.largest < most, "{name}: {figure:?}");
        }
    }
}

/// Length of a record's header \[bytes\].
const HEAD: usize = 3;

/// Returns the end of each record, and the number of IMU samples up to there.
fn ends(log: &[u8]) -> Vec<(usize, usize)> {
    let (mut at, mut samples, mut id) = (16, 0, None);
    let mut ends = Vec::new();
    while at < log.len() {
        let content = &log[at + HEAD..at + HEAD + usize::from(u16::from_le_bytes([log[at], log[at + 1]]))];
        match log[at + 2] {
            b'A' if &content[3..] == b"sensor_combined" => id = Some([content[1], content[2]]),
            b'D' if Some([content[0], content[1]]) == id => samples += 1,
            _ => {}
        }
        at += HEAD + content.len();
        ends.push((at, samples));
    }
    ends
}

/// A log that was cut at any byte, as by a loss of power, is read up to its last whole record.
#[test]
fn a_cut_log_is_read_up_to_there() {
    let log = flown("mocap", 0.5);
    let ends = ends(&log);
    let first = ends.iter().find(|(_, samples)| *samples > 0).unwrap().0;
    let all = afbc_replay::read(&file("whole.ulg", &log)).unwrap();
    // Cuts at every byte of the first milliseconds, and at some of the rest.
    for cut in (first..first + 1_500).chain((first + 1_500..log.len()).step_by(9_973)) {
        let read = afbc_replay::read(&file("cut.ulg", &log[..cut])).unwrap();
        let (end, samples) = ends[ends.partition_point(|(end, _)| *end <= cut) - 1];
        assert_eq!((read.imu.len(), &read.imu[..]), (samples, &all.imu[..samples]), "{cut}");
        assert_eq!(read.notes.is_empty(), end == cut, "{cut}: {:?}", read.notes);
    }
}
