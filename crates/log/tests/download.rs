//! Tests that logs on a card are listed, downloaded and erased in operation: while another log is written, and on a
//! card that stalls, is pulled out or is full. The bytes are compared with those read by another FAT library.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

mod room;

use afbc_log::storage::StorageState;
use afbc_mavlink::LogRequest;
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use room::station::Station;
use room::ulog::read;
use room::{Card, adds_up, fat16, fat32, mount};
use std::io::Write;

#[test]
fn logs_are_listed_and_downloaded() {
    for card in [fat16(), fat32()] {
        for name in ["LOG0007.ULG", "LOGBOOK.ULG", "OTHER.BIN"] {
            mount(&mut card.0.lock().unwrap().bytes).root_dir().create_file(name).unwrap();
        }
        let mut station = Station::new(&card);
        assert!(station.list().is_empty());
        (0..3).for_each(|number| station.fly(300 + 100 * number));
        mount(&mut card.0.lock().unwrap().bytes).root_dir().remove("LOG0007.ULG").unwrap();
        mount(&mut card.0.lock().unwrap().bytes).root_dir().remove("LOGBOOK.ULG").unwrap();
        station.is_served_as_it_is_kept();
        // Downloads some parts of the logs, then bytes and logs that do not exist.
        let held = station.room.logs();
        for (log, offset, bytes) in [(0, 1, 90), (1, 449, 1), (2, 511, 1_000), (0, 100_000, 449), (1, 450, 451)] {
            let (from, to) = (offset as usize, (offset + bytes) as usize);
            assert_eq!(station.download(log, offset, bytes), held[usize::from(log)].1[from..to]);
        }
        let end = held[2].1.len() as u32;
        assert_eq!(station.download(2, end - 10, u32::MAX).len(), 10);
        for (log, offset) in [(2, end), (2, end + 1), (2, u32::MAX), (3, 0), (u16::MAX, 7)] {
            assert!(station.download(log, offset, 900).is_empty());
        }
    }
}

/// The log being written is not served, and a download costs it no records.
#[test]
fn a_download_beside_a_log() {
    let card = fat32();
    let mut station = Station::new(&card);
    (0..2).for_each(|_| station.fly(500));
    let held = station.room.logs();
    station.room.armed = true;
    station.room.run(300);
    // The log of the present flight is not counted.
    assert_eq!(station.list().len(), 2);
    for (log, (_, bytes)) in held.iter().enumerate() {
        assert!(station.download(log as u16, 0, u32::MAX) == *bytes);
    }
    station.room.armed = false;
    station.room.run(1_500);
    let logs = station.room.logs();
    let written = read(&logs[2].1);
    assert!(logs.len() == 3 && written.whole == logs[2].1.len());
    let [first, last] = adds_up(&written).unwrap();
    let missing_ms: u64 = written.dropouts.iter().map(|(ms, _)| ms).sum();
    assert!(missing_ms < 50 && last - first > 3_000_000, "{missing_ms} ms of {} us", last - first);
    assert!(station.download(2, 0, 90).is_empty());
    station.is_served_as_it_is_kept();
}

/// All logs except the one being written are erased. Their space is free again, up to one cluster per log.
#[test]
fn erased_logs_leave_room() {
    for card in [fat16(), fat32()] {
        let mut other = vec![0x5A; 70_000];
        other[7] = 1;
        let free = |card: &Card| {
            let mut disk = card.0.lock().unwrap();
            let volume = mount(&mut disk.bytes);
            let used = volume.root_dir().iter().map(|entry| entry.unwrap().len()).sum::<u64>();
            (used, u64::from(volume.cluster_size()))
        };
        mount(&mut card.0.lock().unwrap().bytes)
            .root_dir()
            .create_file("OTHER.BIN")
            .unwrap()
            .write_all(&other)
            .unwrap();
        let mut station = Station::new(&card);
        (0..3).for_each(|_| station.fly(300));
        assert!(free(&card).0 > 300_000);
        station.room.armed = true;
        station.room.run(500);
        assert!(station.erase());
        station.room.armed = false;
        station.room.run(1_500);
        let logs = station.room.logs();
        let [(name, bytes)] = logs.as_slice() else { panic!("{} logs", logs.len()) };
        assert_eq!(name, "LOG004.ULG");
        let log = read(bytes);
        assert_eq!(log.whole, bytes.len());
        adds_up(&log).unwrap();
        // Counts the used clusters in the allocation table.
        let (used, cluster) = free(&card);
        let mut disk = card.0.lock().unwrap();
        let volume = mount(&mut disk.bytes);
        let total = u64::from(volume.stats().unwrap().total_clusters());
        let mut counted = 0;
        let mut file = volume.root_dir().create_file("FILL.BIN").unwrap();
        while file.write_all(&vec![0; cluster as usize]).is_ok() {
            counted += 1;
        }
        let taken = total - counted;
        assert!(taken <= used.div_ceil(cluster) + 8, "{taken} clusters of {used} bytes");
        let mut kept = Vec::new();
        std::io::Read::read_to_end(&mut volume.root_dir().open_file("OTHER.BIN").unwrap(), &mut kept).unwrap();
        assert!(kept == other);
    }
}

/// The logs on a full card can be downloaded and erased. Then the card takes logs again.
#[test]
fn a_full_card_is_emptied() {
    let card = fat16();
    {
        let mut disk = card.0.lock().unwrap();
        let volume = mount(&mut disk.bytes);
        let free = u64::from(volume.stats().unwrap().free_clusters()) * u64::from(volume.cluster_size());
        let mut file = volume.root_dir().create_file("OTHER.BIN").unwrap();
        file.write_all(&vec![0xA5; (free - 400_000) as usize]).unwrap();
    }
    let mut station = Station::new(&card);
    (0..3).for_each(|_| station.fly(1_000));
    assert_eq!(station.room.told, [StorageState::Full.text().unwrap()]);
    // Gives the keeper time to look at the card again.
    station.room.run(1_500);
    station.is_served_as_it_is_kept();
    assert!(station.erase());
    assert!(station.room.logs().is_empty());
    station.fly(400);
    assert_eq!(station.room.logs().len(), 1);
    assert_eq!(station.room.told.last(), StorageState::Ready.text().as_ref());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// With random stalls, failures and pulls, each request is answered, and each byte served is the log's.
    #[test]
    fn whatever_the_card_does_there_is_an_answer(
        seed: u64, is_fat32: bool, steps in prop::collection::vec((0_u8..6, any::<u32>()), 1..25),
    ) {
        let card = if is_fat32 { fat32() } else { fat16() };
        let mut station = Station::new(&card);
        (0..2).for_each(|_| station.fly(200));
        let held = station.room.logs();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        card.0.lock().unwrap().takes_us = Box::new(move || match random.next_u32() % 1_000 {
            0 => 500_000,
            1..=9 => 60_000,
            part => u64::from(part),
        });
        for (step, number) in steps {
            match step {
                0 => card.0.lock().unwrap().is_there = false,
                1 => card.0.lock().unwrap().is_there = true,
                2 => card.0.lock().unwrap().fails_in = Some(number % 40),
                3 => station.room.armed = number % 2 == 0,
                4 => {
                    station.ask_for(LogRequest::List { first: 0, last: 9 }, 300);
                    station.transfer.hear(LogRequest::End);
                }
                _ => {
                    let (log, offset) = ((number % 2) as u16, number / 2 % 80_000);
                    let wanted = 1 + number % 5_000;
                    let found = station.ask_for(LogRequest::Data { log, offset, bytes: wanted }, 300);
                    // A silent card does not mean the end of the log: the request is cancelled instead.
                    let is_whole = !station.transfer.is_busy();
                    station.transfer.hear(LogRequest::End);
                    let found = Station::<Card>::joined(log, offset, found);
                    let bytes = &held[usize::from(log)].1[offset as usize..(offset + wanted) as usize];
                    prop_assert!(bytes.starts_with(&found));
                    prop_assert!(!is_whole || found.len() == bytes.len() || found.is_empty());
                }
            }
            station.room.run(u64::from(number % 300));
        }
        {
            let mut disk = card.0.lock().unwrap();
            (disk.is_there, disk.fails_in, disk.takes_us) = (true, None, Box::new(|| 300));
        }
        station.room.armed = false;
        station.room.run(4_000);
        let now = station.room.logs();
        for (before, after) in held.iter().zip(&now) {
            prop_assert_eq!(before, after);
        }
        station.is_served_as_it_is_kept();
        prop_assert!(station.erase());
        prop_assert!(station.room.logs().is_empty());
    }
}
