//! diag
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
use afbc_hil::Station;
use pil::exercise::bytes_of_tick;
use pil::{Emulator, FirmwareImage};
fn main() {
    for slower in 0..3u32 {
        let elf = FirmwareImage::Pil.find().unwrap();
        let mut emulator = Emulator::start_slower(&elf, slower).unwrap();
        let mut station = Station::default();
        let mut last = 0;
        let mut lens = Vec::new();
        for tick in 0..2500u64 {
            let bytes = bytes_of_tick(&mut station, tick);
            let reply = emulator.exchange(&bytes).unwrap();
            lens.push((reply.time_us, bytes.len(), reply.bytes.len(), reply.instructions));
            if last > 0 && (reply.time_us - last).abs_diff(1000) > 40 {
                println!("slower {slower}: tick {tick} at {} gap {}", reply.time_us, reply.time_us - last);
                for l in &lens[lens.len().saturating_sub(4)..] {
                    println!("   {l:?}");
                }
            }
            last = reply.time_us;
        }
        let mut by: Vec<_> = lens.iter().map(|l| l.2).collect();
        by.sort();
        println!("slower {slower} bytes max {:?}", &by[by.len() - 5..]);
    }
}
