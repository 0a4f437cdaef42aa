//! Tests logs on a card that stalls, fails, fills, is pulled out, or loses power. The logs are read by another FAT
//! library and by the specification of ULog.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

mod room;

use afbc_comms::services::storage::LogStore;
use afbc_log::storage::{LogMode, StorageState, log_name};
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use room::ulog::read;
use room::{Card, Room, TICK_US, VOLUME, adds_up, fat16, fat32, logs, mount};
use std::io::Write;

/// Longest time until written data can be read back \[us\].
const SYNCED_US: u64 = 1_000_000;

/// A card that is never slow keeps every tick after the log's beginning.
#[test]
fn all_is_kept() {
    for card in [fat16(), fat32()] {
        let mut room = Room::new(&card);
        room.run(1_000);
        room.change(7.0);
        room.run(1_000);
        room.mode = LogMode::Armed;
        room.run(200);
        let logs = room.logs();
        let [(name, bytes)] = logs.as_slice() else { panic!("{} logs", logs.len()) };
        assert_eq!(name, "LOG001.ULG");
        let log = read(bytes);
        assert_eq!(log.whole, bytes.len(), "the end is whole");
        let [first, last] = adds_up(&log).unwrap();
        // The log's beginning is written slowly, over some hundreds of ticks.
        assert!((250_000..500_000).contains(&first) && last == 2_000_000, "{first} {last}");
        assert!(log.dropouts.is_empty(), "{:?}", log.dropouts);
        assert_eq!(log.changes, [("EST_GATE".to_owned(), 7.0)]);
        assert!(room.told.is_empty(), "{:?}", room.told);
    }
}

/// Each mode logs at the times that PX4 defines for it.
#[test]
fn modes_are_those_of_px4() {
    let armed_at = |ms: u64| (2_000..4_000).contains(&ms) || (7_000..8_000).contains(&ms);
    // Spans from arming or power-up to one second after disarming \[ms\].
    let spans = [
        (LogMode::Armed, vec![[2_000, 4_999], [7_000, 8_999]]),
        (LogMode::BootUntilDisarm, vec![[1, 4_999], [7_000, 8_999]]),
        (LogMode::Boot, vec![[1, 10_000]]),
    ];
    for (mode, spans) in spans {
        let card = fat16();
        let mut room = Room::new(&card);
        room.mode = mode;
        for ms in 1..10_000 {
            room.armed = armed_at(ms);
            room.tick(false);
        }
        assert_eq!(room.wanted, spans.iter().map(|[from, to]| to - from).sum::<u64>(), "{mode:?}");
        let logs = room.logs();
        assert_eq!(logs.len(), spans.len(), "{mode:?}");
        for ((_, bytes), [from, to]) in logs.iter().zip(spans) {
            let [first, last] = adds_up(&read(bytes)).unwrap();
            assert!((first / 1000).abs_diff(from) < 400 && (last / 1000).abs_diff(to) < 600, "{mode:?} {first} {last}");
        }
    }
}

/// After a power cut following any written block, the volume can be read, and the log up to one second before the cut.
#[test]
fn a_cut_leaves_a_log_up_to_the_last_second() {
    for card in [fat16(), fat32()] {
        let mut disk = card.0.lock().unwrap().bytes.clone();
        let mut room = Room::new(&card);
        room.run(3_500);
        let written = std::mem::take(&mut card.0.lock().unwrap().written);
        let (mut cuts, mut read_to_us) = (0, 0);
        let mut begun_us = None;
        for (at_us, number, block) in &written {
            let start = *number as usize * 512;
            disk[start..start + 512].copy_from_slice(block);
            let logs = logs(&mut disk);
            if let Some((_, bytes)) = logs.first() {
                begun_us.get_or_insert(*at_us);
                let log = read(bytes);
                assert!(bytes.len() - log.whole < 512, "its end is a part of a record");
                let last_us = log.samples_us.last().copied().unwrap_or(0);
                assert!(last_us >= read_to_us, "what could be read before");
                // The log's beginning contains no samples.
                if *at_us > begun_us.unwrap() + SYNCED_US + 300_000 {
                    assert!(last_us + SYNCED_US > *at_us, "cut at {at_us} us, read up to {last_us}");
                }
                (cuts, read_to_us) = (cuts + 1, last_us);
            }
        }
        assert!(cuts > 500 && read_to_us > 2_500_000, "{cuts} cuts, {read_to_us} us");
    }
}

/// A card that stalls for half a second costs records, and the log contains a dropout of that length.
#[test]
fn a_stall_is_a_dropout() {
    let card = fat16();
    let mut room = Room::new(&card);
    room.run(1_000);
    let mut calls = 0;
    card.0.lock().unwrap().takes_us = Box::new(move || {
        calls += 1;
        if calls == 100 { 500_000 } else { 300 }
    });
    room.run(2_000);
    let logs = room.logs();
    let log = read(&logs[0].1);
    let [_, last] = adds_up(&log).unwrap();
    let missing_ms: u64 = log.dropouts.iter().map(|(ms, _)| ms).sum();
    assert!((300..600).contains(&missing_ms), "{missing_ms} ms");
    assert!(last > 2_000_000 && logs.len() == 1);
}

/// A full card ends its log, which can be read, and is reported once.
#[test]
fn a_full_card_ends_the_log() {
    let card = fat16();
    {
        let mut disk = card.0.lock().unwrap();
        let volume = mount(&mut disk.bytes);
        let free = u64::from(volume.stats().unwrap().free_clusters()) * u64::from(volume.cluster_size());
        let mut file = volume.root_dir().create_file("OTHER.BIN").unwrap();
        file.write_all(&vec![0xA5; (free - 150_000) as usize]).unwrap();
    }
    let mut room = Room::new(&card);
    room.run(6_000);
    assert_eq!(room.told, [StorageState::Full.text().unwrap()]);
    let logs = room.logs();
    assert_eq!(logs.len(), 1);
    let log = read(&logs[0].1);
    assert!((100_000..150_000).contains(&logs[0].1.len()), "{}", logs[0].1.len());
    adds_up(&log).unwrap();
    let mut disk = card.0.lock().unwrap();
    let volume = mount(&mut disk.bytes);
    let others = volume.root_dir().iter().filter(|entry| entry.as_ref().unwrap().len() > 1_000_000).count();
    assert_eq!(others, 1, "the other file is there");
}

/// A card that is pulled and inserted again holds a log from before and one from after. The missing card is reported
/// once.
#[test]
fn a_card_that_comes_back_gets_another_log() {
    let card = fat32();
    let mut room = Room::new(&card);
    room.run(1_500);
    card.0.lock().unwrap().is_there = false;
    room.run(3_000);
    card.0.lock().unwrap().is_there = true;
    room.run(2_500);
    let logs = room.logs();
    assert_eq!(logs.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["LOG001.ULG", "LOG002.ULG"]);
    let ends: Vec<_> = logs.iter().map(|(_, bytes)| adds_up(&read(bytes)).unwrap()).collect();
    assert!(ends[0][1] > 500_000 && ends[0][1] < 1_500_000 + 300_000, "{ends:?}");
    assert!(ends[1][0] > 4_500_000 && ends[1][0] < 6_500_000, "{ends:?}");
    assert_eq!(room.told, ["Log: no card", "Log: ready"]);
}

/// Other files are left alone, and new logs are numbered after the last log.
#[test]
fn numbers_go_on() {
    let card = fat16();
    for name in ["LOG007.ULG", "LOG9.ULG", "LOGBOOK.ULG", "LOG12X.ULG", "LOG1000.TXT"] {
        mount(&mut card.0.lock().unwrap().bytes).root_dir().create_file(name).unwrap();
    }
    let mut room = Room::new(&card);
    room.run(1_500);
    assert!(room.logs().iter().any(|(name, bytes)| name == "LOG008.ULG" && !bytes.is_empty()));
    for (number, name) in [(1, "LOG001.ULG"), (42, "LOG042.ULG"), (999, "LOG999.ULG"), (1_000, "LOG1000.ULG")] {
        assert_eq!(log_name(number).unwrap().to_string(), name);
    }
    assert_eq!(log_name(99_999).unwrap().to_string(), "LOG99999.ULG");
    assert!(log_name(100_000).is_none());
}

/// Cards without a volume, cards with a foreign partition and missing cards are reported.
#[test]
fn cards_without_a_volume_are_told() {
    let blank = fat16();
    blank.0.lock().unwrap().bytes.fill(0);
    let other = fat16();
    other.0.lock().unwrap().bytes[450] = 0x07;
    let none = fat16();
    none.0.lock().unwrap().is_there = false;
    for (card, text) in [(blank, StorageState::Foreign), (other, StorageState::Foreign), (none, StorageState::Absent)] {
        let mut room = Room::new(&card);
        room.run(3_000);
        assert_eq!(room.told, [text.text().unwrap()]);
        assert!(card.0.lock().unwrap().written.is_empty());
    }
    assert!(StorageState::ALL.iter().all(|state| state.text().is_none_or(|text| text.len() <= 50)));
    for (number, state) in StorageState::ALL.into_iter().enumerate() {
        assert_eq!((state as usize, StorageState::of(number as u8)), (number, state));
    }
}

/// Makes a card stall at random.
fn hostile(card: &Card, seed: u64) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    card.0.lock().unwrap().takes_us = Box::new(move || match random.next_u32() % 1_000 {
        0 => 500_000,
        1..=5 => 60_000,
        part => u64::from(part),
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// With random stalls, failures, pulls and missing ticks, each file is a valid log whose dropouts cover what is
    /// missing.
    #[test]
    fn whatever_the_card_does_logs_add_up(
        seed: u64, is_fat32: bool, steps in prop::collection::vec((0_u8..8, 50_u64..900, 0_u32..400), 1..12),
    ) {
        let card = if is_fat32 { fat32() } else { fat16() };
        hostile(&card, seed);
        let mut room = Room::new(&card);
        for (step, ticks, calls) in steps {
            match step {
                0 => card.0.lock().unwrap().fails_in = Some(calls),
                1 => card.0.lock().unwrap().is_there = false,
                2 => (0..calls % 5).for_each(|_| room.tick(true)),
                3 => room.change(3.0 + calls as f32 / 100.0),
                _ => card.0.lock().unwrap().is_there = true,
            }
            room.run(ticks);
        }
        // Gives the queued blocks time to be written.
        card.0.lock().unwrap().is_there = true;
        room.mode = LogMode::Armed;
        room.run(3_000);
        for (_, bytes) in room.logs() {
            let log = read(&bytes);
            prop_assert!(bytes.len() - log.whole < 512);
            adds_up(&log);
        }
    }

    /// Random damage to a volume's tables and directory causes no panic and no endless work, and block 0 stays
    /// unchanged.
    #[test]
    fn a_damaged_volume_ends_nothing_else(
        is_fat32: bool,
        damage in prop::collection::vec((0_usize..1_200, 0_usize..512, any::<u8>()), 1..60),
        in_head in prop::collection::vec((0_usize..64, any::<u8>()), 0..4),
    ) {
        let card = if is_fat32 { fat32() } else { fat16() };
        {
            let bytes = &mut card.0.lock().unwrap().bytes;
            for (block, at, value) in damage {
                bytes[(VOLUME + block) * 512 + at] = value;
            }
            for (at, value) in in_head {
                bytes[VOLUME * 512 + at] = value;
            }
        }
        let head = card.0.lock().unwrap().bytes[..512].to_vec();
        let mut room = Room::new(&card);
        room.run(600);
        // Lists, reads and erases the logs of the damaged volume.
        for step in 0..300_u32 {
            room.run(2);
            let _ = match step / 50 {
                0 | 4 => room.stored.count_logs().is_ready(),
                1 => room.stored.log((step % 7) as u16).is_ready(),
                2 | 5 => room.stored.read_log((step / 8 % 3) as u16, 400 * (step % 8), &mut [0; 90]).is_ready(),
                _ => room.stored.erase_logs().is_ready(),
            };
        }
        prop_assert_eq!(&card.0.lock().unwrap().bytes[..512], &head[..]);
        prop_assert!(card.0.lock().unwrap().calls < 4 << 20);
    }
}

/// A directory whose cluster chain loops does not cause endless work.
#[test]
fn a_circle_ends() {
    let card = fat32();
    {
        let bytes = &mut card.0.lock().unwrap().bytes;
        let reserved = usize::from(u16::from_le_bytes([bytes[VOLUME * 512 + 14], bytes[VOLUME * 512 + 15]]));
        let table = (VOLUME + reserved) * 512;
        // The root directory's cluster 2 points back to itself and is full of entries.
        bytes[table + 8..table + 12].copy_from_slice(&2_u32.to_le_bytes());
        let volume = VOLUME * 512;
        let size = u32::from_le_bytes(bytes[volume + 36..volume + 40].try_into().unwrap()) as usize;
        let root = table + 2 * size * 512;
        for entry in 0..16 {
            bytes[root + 32 * entry..root + 32 * entry + 11].copy_from_slice(b"FULL    BIN");
        }
    }
    let mut room = Room::new(&card);
    card.0.lock().unwrap().takes_us = Box::new(|| 1);
    room.run(2 * SYNCED_US / TICK_US);
    assert!(matches!(room.told.as_slice(), ["Log: storage has failed"]), "{:?}", room.told);
}
