//! Stores with any initial content, wear, full stores, and two owners.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

mod common;

use afbc_store::{Error, Ram, RecordName, Store, StoreCondition, hash};
use common::{Cuttable, Erasing};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Size of a sector of the STM32F405.
const SECTOR: usize = 16 * 1024;

fn name(number: u32) -> RecordName {
    RecordName::new(&format!("P{number}")).unwrap()
}

fn blank<const N: usize>() -> Cuttable<N> {
    Cuttable::new(1, Erasing::Forwards)
}

#[test]
fn names_are_short_and_printable() {
    assert_eq!(RecordName::new("A_ROLL_CENTRE_16").unwrap().as_str(), "A_ROLL_CENTRE_16");
    assert!(["", "SEVENTEEN_LETTERS", "WITH SPACE", "NÄH"].iter().all(|name| RecordName::new(name).is_none()));
    assert_ne!(hash(b"paper"), hash(b"racer"));
}

/// Ten thousand changes of 130 parameters, with a restart whenever the store needs one.
#[test]
fn ten_thousand_changes_erase_a_sector_few_times() {
    let mut store = Store::open(blank::<SECTOR>(), 0, 1).unwrap();
    store.make_room().unwrap();
    let mut starts = 0;
    for i in 0..10_000_u32 {
        if store.set(name(i * 7 % 130), 0, Some(i)) == Err(Error::NeedsErase) {
            starts += 1;
            store = Store::open(store.into_flash(), 0, 1).unwrap();
            store.make_room().unwrap();
            store.set(name(i * 7 % 130), 0, Some(i)).unwrap();
        }
    }
    // A sector has 583 places, of which 131 are copies, so a start makes room for some 900 changes in two sectors.
    let erases = store.into_flash().erases;
    assert!(starts <= 13 && erases.iter().all(|erases| *erases <= 13), "{starts} starts, {erases:?} erases");
}

/// The same with a restart after every change: most starts must not move the store to the other sector.
#[test]
fn a_start_after_every_change_erases_a_sector_few_times() {
    let mut flash = blank::<SECTOR>();
    for i in 0..10_000_u32 {
        let mut store = Store::open(flash, 0, 1).unwrap();
        store.make_room().unwrap();
        store.set(name(i % 20), 0, Some(i)).unwrap();
        flash = store.into_flash();
    }
    // A move happens when half a sector is full: 292 places, of which 21 are copies.
    assert!(flash.erases.iter().all(|erases| *erases <= 20), "{:?} erases", flash.erases);
}

#[test]
fn the_same_value_is_not_written_again() {
    let mut store = Store::open(blank::<480>(), 0, 1).unwrap();
    store.make_room().unwrap();
    store.set(name(0), 2, Some(9)).unwrap();
    let before = store.into_flash();
    let mut store = Store::open(before.clone(), 0, 1).unwrap();
    store.make_room().unwrap();
    store.set(name(0), 2, Some(9)).unwrap();
    store.set(name(1), 2, None).unwrap();
    let after = store.into_flash();
    assert_eq!((after.bytes, after.done), (before.bytes, before.done));
}

#[test]
fn a_full_store_says_so_and_keeps_what_it_has() {
    let mut store = Store::open(Ram::<480>::BLANK, 0, 1).unwrap();
    store.make_room().unwrap();
    let most = Store::<Ram<480>>::NAMES_MAX;
    let set = |store: &mut Store<Ram<480>>, number: u32, bits| match store.set(name(number), 0, bits) {
        Err(Error::NeedsErase) => {
            store.make_room().unwrap();
            store.set(name(number), 0, bits)
        }
        done => done,
    };
    (0..most).for_each(|number| set(&mut store, number, Some(number)).unwrap());
    // The rounds use every sector in turn. The store refuses a new name. Known names can be changed and deleted.
    for round in 0..40 {
        assert_eq!(set(&mut store, most + round, Some(1)), Err(Error::Full), "{round}");
        set(&mut store, round % most, Some(round)).unwrap();
    }
    set(&mut store, 0, None).unwrap();
    set(&mut store, most, Some(1)).unwrap();
    let expected: BTreeMap<RecordName, u32> = (1..=most)
        .map(|number| {
            (name(number), if number == most { 1 } else { (0..40).rev().find(|i| i % most == number).unwrap() })
        })
        .collect();
    let mut found = BTreeMap::new();
    let mut store = Store::open(store.into_flash(), 0, 1).unwrap();
    store.visit(|name, _, bits| _ = found.insert(name, bits)).unwrap();
    assert_eq!(found, expected);
    // A reset makes room even in a full store.
    store.make_room().unwrap();
    store.reset().unwrap();
    store.visit(|name, _, _| panic!("{name}")).unwrap();
}

#[test]
fn values_of_another_vehicle_do_not_count_and_are_not_lost_by_reading() {
    let mut store = Store::open(Ram::<480>::BLANK, 0, 1).unwrap();
    store.make_room().unwrap();
    store.set(name(0), 0, Some(9)).unwrap();
    let mut other = Store::open(store.into_flash(), 0, 2).unwrap();
    other.make_room().unwrap();
    assert_eq!(
        (other.found(), other.get(name(0))),
        (StoreCondition { of_another: true, ..StoreCondition::default() }, Ok(None))
    );
    // Back on the first vehicle, its value is there.
    let mut store = Store::open(other.into_flash(), 0, 1).unwrap();
    assert_eq!((store.found(), store.get(name(0))), (StoreCondition::default(), Ok(Some((0, 9)))));
    // The first vehicle's values are lost when the other vehicle sets something.
    let mut other = Store::open(store.into_flash(), 0, 2).unwrap();
    other.set(name(1), 0, Some(5)).unwrap();
    let mut other = Store::open(other.into_flash(), 0, 2).unwrap();
    assert_eq!((other.get(name(0)), other.get(name(1))), (Ok(None), Ok(Some((0, 5)))));
    let mut store = Store::open(other.into_flash(), 0, 1).unwrap();
    assert_eq!((store.found().of_another, store.get(name(0))), (true, Ok(None)));
}

/// Opens a store in `bytes`, checks that it works, and returns its content.
fn works(bytes: Vec<u8>) -> (StoreCondition, Vec<(RecordName, u32)>) {
    let mut store = Store::open(Cuttable { bytes, ..blank::<480>() }, 0, 1).unwrap();
    let (found, mut held) = (store.found(), Vec::new());
    store.visit(|name, _, bits| held.push((name, bits))).unwrap();
    store.make_room().unwrap();
    for number in 0..40 {
        let set = |store: &mut Store<_>| store.set(name(number % 3), 0, Some(number));
        if set(&mut store) == Err(Error::NeedsErase) {
            store.make_room().unwrap();
            set(&mut store).unwrap();
        }
    }
    let mut store = Store::open(store.into_flash(), 0, 1).unwrap();
    (37..40).for_each(|number| assert_eq!(store.get(name(number % 3)), Ok(Some((0, number)))));
    (found, held)
}

proptest! {
    #[test]
    fn garbage_is_no_store(bytes in prop::collection::vec(any::<u8>(), 960), zeros in any::<bool>()) {
        let bytes = if zeros { bytes.iter().map(|byte| byte & (byte >> 1)).collect() } else { bytes };
        prop_assert_eq!(works(bytes), (StoreCondition { foreign: true, ..StoreCondition::default() }, vec![]));
    }

    /// A store finds only values that were written, for any flipped bits in its flash.
    #[test]
    fn flipped_bits_make_no_value(flips in prop::collection::vec(0..960_usize * 8, 1..40), sets in 1..60_u32) {
        let mut store = Store::open(blank::<480>(), 0, 1).unwrap();
        store.make_room().unwrap();
        for number in 0..sets {
            if store.set(name(number % 5), 0, Some(number)).is_err() {
                store.make_room().unwrap();
                store.set(name(number % 5), 0, Some(number)).unwrap();
            }
        }
        let mut bytes = store.into_flash().bytes;
        flips.iter().for_each(|bit| bytes[bit / 8] ^= 1 << (bit % 8));
        for (found, bits) in works(bytes).1 {
            prop_assert!(bits < sets && found == name(bits % 5), "{found} = {bits}");
        }
    }
}
