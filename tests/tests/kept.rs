//! A vehicle's file and its parameters are two views of one declaration: from the file through a station's file and a
//! store, every bit of what the firmware flies is the same.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc_files::Flash;
use afbc_onboard::parameters::{Kept, ParameterTable, RecordChange};
use afbc_onboard::{Configuration, Prepared};
use afbc_reader::params::{Format, read, written};
use afbc_store::{RecordName, Store, hash};
use afbc_types::with_rotors;
use afbc_vehicles::{BUILT_IN, Vehicle};
use std::fs;
use std::path::Path;

fn kept<const N: usize>(vehicle: &Vehicle, rotors: Configuration<N>, format: Format) {
    let original: Configuration<N> = vehicle.configuration().unwrap();
    let all = ParameterTable::new(original.clone());
    let text = written(format, &vehicle.name, all.iter().map(|it| (it.name, it.value, it.kind.number())));
    // Into the store of an image with other values: all that the file says has to be kept.
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{format:?}.store", vehicle.name));
    let _ = fs::remove_file(&path);
    let mut table = ParameterTable::new(rotors.clone());
    let mut store = Store::open(Flash::open(&path).unwrap(), 0, hash(b"image")).unwrap();
    store.make_room().unwrap();
    for entry in read("a.params", &text).unwrap() {
        let name = RecordName::new(&entry.name).unwrap();
        table.put(name, entry.value).unwrap();
        Kept::NOW.keep(&mut store, RecordChange::Set(name, Some(entry.value))).unwrap();
    }
    assert_eq!(table.check(), Ok(()));
    drop(store);
    let (mut found, mut notices) = (ParameterTable::new(rotors), Vec::new());
    let mut store = Store::open(Flash::known(&path).unwrap(), 0, hash(b"image")).unwrap();
    Kept::NOW.load(&mut found, &mut store, |notice| notices.push(notice)).unwrap();
    assert_eq!(notices, []);
    // Debug shows every bit but that of a NaN, and there is none.
    assert_eq!(format!("{:?}", found.configuration()), format!("{original:?}"), "{}", vehicle.name);
    let flown = |configuration: &Configuration<N>| format!("{:?}", Prepared::new(configuration).unwrap());
    assert_eq!(flown(found.configuration()), flown(&original));
}

#[test]
fn from_a_vehicles_file_through_parameters_and_store_nothing_changes() {
    let vehicles: Vec<Vehicle> = BUILT_IN.iter().map(|vehicle| vehicle.read().unwrap()).collect();
    for vehicle in &vehicles {
        with_rotors!(vehicle.rotors.len(), N => {
            // Another image with the same rotors: where they are is no parameter.
            let mut other: Configuration<N> = vehicle.configuration().unwrap();
            other.airframe.parameters.mass_kg *= 0.97;
            other.settings.bumpless = !other.settings.bumpless;
            other.estimation.gyro_noise_rad_s_rthz *= 2.0;
            other.gains.z.gamma += 0.1;
            kept(vehicle, other.clone(), Format::Qgc);
            kept(vehicle, other, Format::Mavproxy);
        });
    }
}

/// A program that is killed while it sets a value leaves what a cut of power leaves; two programs cannot share a store.
#[test]
fn a_store_in_a_file_is_whole_and_belongs_to_one_program() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared.store");
    let _ = fs::remove_file(&path);
    let mut store = Store::open(Flash::open(&path).unwrap(), 0, 1).unwrap();
    store.make_room().unwrap();
    store.set(RecordName::new("A").unwrap(), 0, Some(7)).unwrap();
    assert_eq!(Flash::known(&path).unwrap_err().to_string(), "in use by another program");
    drop(store);
    // A write cut in the middle: the second half of the record is missing.
    let mut bytes = fs::read(&path).unwrap();
    let end = bytes.iter().rposition(|byte| *byte != 0xFF).unwrap() + 1;
    let begin = end - 28;
    let record = bytes.get(begin..end).unwrap().to_vec();
    bytes.get_mut(end..end + 14).unwrap().copy_from_slice(record.get(..14).unwrap());
    fs::write(&path, bytes).unwrap();
    let mut store = Store::open(Flash::known(&path).unwrap(), 0, 1).unwrap();
    assert_eq!(store.found().damaged, 1);
    assert_eq!(store.get(RecordName::new("A").unwrap()).unwrap(), Some((0, 7)));
    store.make_room().unwrap();
    store.set(RecordName::new("A").unwrap(), 0, Some(8)).unwrap();
    drop(store);
    let mut store = Store::open(Flash::known(&path).unwrap(), 0, 1).unwrap();
    assert_eq!((store.found().damaged, store.get(RecordName::new("A").unwrap()).unwrap()), (0, Some((0, 8))));
}
