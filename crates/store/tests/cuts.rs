//! A power cut at every bit of every write and in every erase: afterwards the store holds the old values or the new
//! one, and still works.
#![allow(clippy::panic, clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, missing_docs)] // tests

mod common;

use afbc_store::{Error, RecordName, Store};
use common::{Cuttable, Erasing, PowerCut};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Small sectors, so that a few changes fill them: 17 places.
const SECTOR: usize = 480;
const OWNER: u32 = 7;

type Values = BTreeMap<RecordName, (u16, u32)>;
type Flash = Cuttable<SECTOR>;

/// Action of a vehicle on its store.
#[derive(Clone, Copy, Debug)]
enum Act {
    Set(u8, Option<u32>),
    Reset,
    /// The power goes off between two writes and returns.
    Restart,
}

/// Returns the name of a value. The third and seventh survive a reset.
fn name(number: u8) -> RecordName {
    let prefix = if number % 4 == 2 { "" } else { "P" };
    RecordName::new(&format!("{prefix}_NUMBER_{number}")).unwrap()
}

fn values(store: &mut Store<Flash>) -> Values {
    let mut values = Values::new();
    store
        .visit(|name, edition, bits| assert!(!name.outlasts() && values.insert(name, (edition, bits)).is_none()))
        .unwrap();
    for name in [2, 6].map(name) {
        values.extend(store.get(name).unwrap().map(|value| (name, value)));
    }
    values.iter().for_each(|(name, value)| assert_eq!(store.get(*name), Ok(Some(*value))));
    values
}

/// Returns `values` after `act`.
fn after(mut values: Values, act: Act) -> Values {
    match act {
        Act::Set(number, Some(bits)) => drop(values.insert(name(number), (3, bits))),
        Act::Set(number, None) => drop(values.remove(&name(number))),
        Act::Reset => values.retain(|name, _| name.outlasts()),
        Act::Restart => (),
    }
    values
}

/// Opens the store and makes room; returns the flash if the power is cut.
fn boot(flash: Flash) -> Result<Store<Flash>, Flash> {
    // Opening writes nothing, so the power is still on.
    let mut store = Store::open(flash, 0, OWNER).unwrap();
    match store.make_room() {
        Ok(()) => Ok(store),
        Err(Error::Flash(PowerCut)) => Err(store.into_flash()),
        Err(error) => panic!("{error:?}"),
    }
}

/// Carries out `acts` on `flash` until the power is cut. Returns the flash, and the values that the store may hold
/// then: those before the interrupted act, and those after it.
fn live(flash: Flash, acts: &[Act]) -> (Flash, [Values; 2]) {
    let mut held = Values::new();
    let mut store = match boot(flash) {
        Ok(store) => store,
        Err(flash) => return (flash, [held.clone(), held]),
    };
    for act in acts {
        let next = after(held.clone(), *act);
        let done = match *act {
            Act::Set(number, bits) => match store.set(name(number), 3, bits) {
                Err(Error::NeedsErase) => store.make_room().and_then(|()| store.set(name(number), 3, bits)),
                done => done,
            },
            Act::Reset => match store.reset() {
                Err(Error::NeedsErase) => store.make_room().and_then(|()| store.reset()),
                done => done,
            },
            Act::Restart => match boot(store.into_flash()) {
                Ok(started) => {
                    store = started;
                    Ok(())
                }
                Err(flash) => return (flash, [held.clone(), held]),
            },
        };
        match done {
            Ok(()) => held = next,
            Err(Error::Flash(PowerCut)) => return (store.into_flash(), [held, next]),
            Err(error) => panic!("{act:?}: {error:?}"),
        }
    }
    (store.into_flash(), [held.clone(), held])
}

/// Checks that the store opens with one of `allowed`, and still works.
fn comes_up(mut flash: Flash, allowed: &[Values; 2], context: &str) {
    flash.power_up();
    // Checks the values before anything is erased, as a program that only reads them would see them.
    let mut store = Store::open(flash, 0, OWNER).unwrap();
    let found = values(&mut store);
    assert!(allowed.contains(&found), "{context}: {found:?}, neither of {allowed:?}");
    store.make_room().unwrap();
    assert_eq!(values(&mut store), found, "{context}: room was made");
    // Every value can be changed twice, and is there after a restart.
    let mut expected = found;
    for act in (0..6).flat_map(|number| [Act::Set(number, Some(1)), Act::Set(number, Some(u32::from(number) + 10))]) {
        expected = after(expected, act);
        let Act::Set(number, bits) = act else { unreachable!() };
        if store.set(name(number), 3, bits) == Err(Error::NeedsErase) {
            store.make_room().unwrap();
            store.set(name(number), 3, bits).unwrap();
        }
    }
    let mut store = Store::open(store.into_flash(), 0, OWNER).unwrap();
    assert_eq!(values(&mut store), expected, "{context}: afterwards");
}

/// Returns acts that fill the sectors several times, delete values, reset and restart in between.
fn day() -> Vec<Act> {
    let mut acts: Vec<Act> = (0..24).map(|i| Act::Set(i % 5, Some(u32::from(i) * 0x0101_0101))).collect();
    acts.extend([Act::Set(2, None), Act::Restart, Act::Set(1, Some(0)), Act::Set(1, Some(u32::MAX)), Act::Reset]);
    acts.extend((0..20).map(|i| Act::Set(i % 4, Some(u32::MAX - u32::from(i)))));
    acts.extend([Act::Restart, Act::Set(3, None), Act::Reset, Act::Set(0, Some(5))]);
    acts
}

/// Returns the number of bits and erase steps that the flash has carried out after `acts`.
fn length(seed: u64, erasing: Erasing, acts: &[Act]) -> u64 {
    live(Flash::new(seed, erasing), acts).0.done
}

#[test]
fn a_cut_at_every_bit_leaves_the_old_value_or_the_new_one() {
    let acts = day();
    for (seed, erasing) in (1..).zip(Erasing::ALL) {
        let bits = length(seed, erasing, &acts);
        assert!(bits > 5_000, "{bits}");
        for cut in 0..=bits {
            let flash = Flash { left: Some(cut), ..Flash::new(seed, erasing) };
            let (flash, allowed) = live(flash, &acts);
            comes_up(flash, &allowed, &format!("{erasing:?}, cut after {cut} of {bits}"));
        }
    }
}

/// The start after a power cut is interrupted as well.
#[test]
fn a_cut_during_the_repair_does_no_harm() {
    let acts = day();
    for (seed, erasing) in (11..).zip(Erasing::ALL) {
        let bits = length(seed, erasing, &acts);
        for cut in (0..=bits).step_by(7) {
            let (mut flash, allowed) = live(Flash { left: Some(cut), ..Flash::new(seed, erasing) }, &acts);
            for again in [0, 1, 5, 20, 63, 64, 65, 100, 150, 300] {
                flash.power_up();
                flash.left = Some(again);
                let mut store = Store::open(flash, 0, OWNER).unwrap();
                let _ = store.make_room();
                flash = store.into_flash();
            }
            comes_up(flash, &allowed, &format!("{erasing:?}, cut after {cut} of {bits} and ten times more"));
        }
    }
}

/// Draws sequences of acts.
fn acts() -> impl Strategy<Value = Vec<Act>> {
    let act = prop_oneof![
        12 => (0..8_u8, any::<u32>()).prop_map(|(number, bits)| Act::Set(number, Some(bits))),
        2 => (0..8_u8).prop_map(|number| Act::Set(number, None)),
        1 => Just(Act::Reset),
        1 => Just(Act::Restart),
    ];
    prop::collection::vec(act, 1..60)
}

proptest! {
    #[test]
    fn any_sequence_survives_any_cut(
        acts in acts(), share in 0.0..1.0_f64, seed in any::<u64>(), way in 0..4_usize,
    ) {
        let erasing = Erasing::ALL[way];
        let cut = (share * length(seed, erasing, &acts) as f64) as u64;
        let (flash, allowed) = live(Flash { left: Some(cut), ..Flash::new(seed, erasing) }, &acts);
        comes_up(flash, &allowed, &format!("cut after {cut}"));
    }
}
