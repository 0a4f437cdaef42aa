//! A vehicle's file and its parameters are two views of one declaration. From the file through a station's parameter
//! file and a store, every bit of the firmware's configuration stays the same.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc_files::FlashFile;
use afbc_files::read::params::{ParameterFormat, read, written};
use afbc_onboard::parameters::{Kept, ParameterTable, RecordChange};
use afbc_onboard::{Configuration, Prepared};
use afbc_store::{RecordName, Store, hash};
use afbc_types::with_rotors;
use afbc_vehicles::{BUILT_IN, Vehicle};
use std::fs;
use std::path::Path;

fn kept(vehicle: &Vehicle, other: Configuration, format: ParameterFormat) {
    let original = vehicle.configuration().unwrap();
    let all = ParameterTable::new(original.clone());
    let text = written(format, &vehicle.name, all.iter().map(|it| (it.name, it.value, it.kind.number())));
    // The store belongs to an image with other values, so it must keep all values of the file.
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{format:?}.store", vehicle.name));
    let _ = fs::remove_file(&path);
    let mut table = ParameterTable::new(other.clone());
    let mut store = Store::open(FlashFile::open(&path).unwrap(), 0, hash(b"image")).unwrap();
    store.make_room().unwrap();
    for entry in read("a.params", &text).unwrap() {
        let name = RecordName::new(&entry.name).unwrap();
        table.put(name, entry.value).unwrap();
        Kept::NOW.keep(&mut store, RecordChange::Set(name, Some(entry.value))).unwrap();
    }
    assert_eq!(table.check(), Ok(()));
    drop(store);
    let (mut found, mut notices) = (ParameterTable::new(other), Vec::new());
    let mut store = Store::open(FlashFile::open_existing(&path).unwrap(), 0, hash(b"image")).unwrap();
    Kept::NOW.load(&mut found, &mut store, |notice| notices.push(notice)).unwrap();
    assert_eq!(notices, []);
    // Debug output shows every bit except those of NaN, which does not occur.
    assert_eq!(format!("{:?}", found.configuration()), format!("{original:?}"), "{}", vehicle.name);
    with_rotors!(original.rotors.count(), N => {
        let flown = |configuration| format!("{:?}", Prepared::<N>::new(configuration).unwrap());
        assert_eq!(flown(found.configuration()), flown(&original));
    });
}

#[test]
fn from_a_vehicles_file_through_parameters_and_store_nothing_changes() {
    let vehicles: Vec<Vehicle> = BUILT_IN.iter().map(|vehicle| vehicle.read().unwrap()).collect();
    for vehicle in &vehicles {
        // The other image has the same rotors, since their positions are not parameters.
        let mut other = vehicle.configuration().unwrap();
        other.parameters.mass_kg *= 0.97;
        other.settings.bumpless = !other.settings.bumpless;
        other.estimation.gyro_noise_rad_s_rthz *= 2.0;
        other.gains.z.gamma += 0.1;
        kept(vehicle, other.clone(), ParameterFormat::Qgc);
        kept(vehicle, other, ParameterFormat::Mavproxy);
    }
}

/// A program that is killed while it sets a value leaves the same store as a loss of power. Two programs cannot share a
/// store.
#[test]
fn a_store_in_a_file_is_whole_and_belongs_to_one_program() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared.store");
    let _ = fs::remove_file(&path);
    let mut store = Store::open(FlashFile::open(&path).unwrap(), 0, 1).unwrap();
    store.make_room().unwrap();
    store.set(RecordName::new("A").unwrap(), 0, Some(7)).unwrap();
    assert_eq!(FlashFile::open_existing(&path).unwrap_err().to_string(), "another program uses the file");
    drop(store);
    // The write was cut in the middle: the second half of the record is missing.
    let mut bytes = fs::read(&path).unwrap();
    let end = bytes.iter().rposition(|byte| *byte != 0xFF).unwrap() + 1;
    let begin = end - 28;
    let record = bytes.get(begin..end).unwrap().to_vec();
    bytes.get_mut(end..end + 14).unwrap().copy_from_slice(record.get(..14).unwrap());
    fs::write(&path, bytes).unwrap();
    let mut store = Store::open(FlashFile::open_existing(&path).unwrap(), 0, 1).unwrap();
    assert_eq!(store.found().damaged, 1);
    assert_eq!(store.get(RecordName::new("A").unwrap()).unwrap(), Some((0, 7)));
    store.make_room().unwrap();
    store.set(RecordName::new("A").unwrap(), 0, Some(8)).unwrap();
    drop(store);
    let mut store = Store::open(FlashFile::open_existing(&path).unwrap(), 0, 1).unwrap();
    assert_eq!((store.found().damaged, store.get(RecordName::new("A").unwrap()).unwrap()), (0, Some((0, 8))));
}

/// A loss of power may leave a parameter in the store under its former and its present name. It then has one of the two
/// values in the end, even if the stored values do not fit together.
#[test]
fn a_parameter_under_two_names_has_one_of_its_values() {
    let kept = Kept { renamed: &[("V_WEIGHT", "V_MASS")], ..Kept::NOW };
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("renamed.store");
    let _ = fs::remove_file(&path);
    let mut store = Store::open(FlashFile::open(&path).unwrap(), 0, 1).unwrap();
    store.make_room().unwrap();
    for (name, value) in [("V_WEIGHT", 0.47_f32), ("V_MASS", 0.5), ("A_Z_THETAMAX", 0.01)] {
        store.set(RecordName::new(name).unwrap(), kept.edition, Some(value.to_bits())).unwrap();
    }
    let paper = afbc_vehicles::built_in("paper").unwrap().read().unwrap();
    let (mut table, mut notices) = (ParameterTable::new(paper.configuration().unwrap()), 0);
    kept.load(&mut table, &mut store, |_| notices += 1).unwrap();
    let mass_kg = table.get(RecordName::new("V_MASS").unwrap()).unwrap().value;
    assert!([0.47, 0.5].contains(&mass_kg) && table.check().is_ok(), "{mass_kg} kg");
    assert_eq!(notices, 1, "the bound with which it could not hover");
}
