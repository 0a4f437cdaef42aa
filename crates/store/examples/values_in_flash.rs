//! Stores a value that survives a restart, here in RAM instead of flash: `cargo run -p afbc-store --example
//! values_in_flash`.
#![allow(clippy::unwrap_used, reason = "an example should say what went wrong")]

use afbc_store::{Ram, RecordName, Store};

fn main() {
    let mass = RecordName::new("V_MASS").unwrap();
    let mut store = Store::open(Ram::<1024>::BLANK, 0, 42).unwrap();
    store.make_room().unwrap();
    store.set(mass, 0, Some(0.5_f32.to_bits())).unwrap();

    let mut store = Store::open(store.into_flash(), 0, 42).unwrap(); // after a restart
    let mass_kg = store.get(mass).unwrap().map(|(_, bits)| f32::from_bits(bits));
    println!("V_MASS = {mass_kg:?} kg, of {:?}", store.found());
    assert_eq!(mass_kg, Some(0.5));
}
