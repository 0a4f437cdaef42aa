//! Tests which volumes a card may have: each number of their first block at its limit, by Microsoft's specification of
//! FAT (fatgen103) and the card's size.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

mod room;

use afbc_log::storage::{CardError, FlashFailed, LogKeeper, StorageState};
use room::{Card, Storage, VOLUME, fat16, fat32};

/// Offsets of the numbers in a volume's first block, and their lengths \[bytes\].
const BYTES_PER_SECTOR: (usize, usize) = (11, 2);
const SECTORS_PER_CLUSTER: (usize, usize) = (13, 1);
const RESERVED: (usize, usize) = (14, 2);
const TABLES: (usize, usize) = (16, 1);
const ROOT_ENTRIES: (usize, usize) = (17, 2);
const TOTAL_16: (usize, usize) = (19, 2);
const TABLE_16: (usize, usize) = (22, 2);
const TOTAL_32: (usize, usize) = (32, 4);
const TABLE_32: (usize, usize) = (36, 4);
const VERSION: (usize, usize) = (42, 2);
const ROOT_CLUSTER: (usize, usize) = (44, 4);
const INFO_SECTOR: (usize, usize) = (48, 2);
const SIGNATURE: (usize, usize) = (510, 2);

fn number(card: &Card, (at, bytes): (usize, usize)) -> u32 {
    let disk = card.0.lock().unwrap();
    disk.bytes[VOLUME * 512 + at..][..bytes].iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// Returns the storage's state for a card with these bytes changed.
fn with_bytes(card: &Card, changes: &[(usize, &[u8])]) -> StorageState {
    let before = card.0.lock().unwrap().bytes.clone();
    for (at, bytes) in changes {
        card.0.lock().unwrap().bytes[*at..at + bytes.len()].copy_from_slice(bytes);
    }
    let mut keeper = card.keeper();
    keeper.poll(1_000_000);
    let mut disk = card.0.lock().unwrap();
    assert!(disk.written.is_empty(), "looking writes nothing");
    disk.bytes = before;
    keeper.state()
}

/// Returns true if a card is accepted whose volume has these numbers in its first block.
fn takes(card: &Card, numbers: &[((usize, usize), u32)]) -> bool {
    let numbers: Vec<_> = numbers.iter().map(|((at, bytes), value)| (*at, *bytes, value.to_le_bytes())).collect();
    let changes: Vec<_> = numbers.iter().map(|(at, bytes, value)| (VOLUME * 512 + at, &value[..*bytes])).collect();
    match with_bytes(card, &changes) {
        StorageState::Ready => true,
        StorageState::Foreign => false,
        other => panic!("{other:?}"),
    }
}

/// The first partition must have a FAT type and begin after block 0 and on the card. The partition table must be
/// signed.
#[test]
fn partitions_are_checked() {
    for card in [fat16(), fat32()] {
        assert_eq!(with_bytes(&card, &[]), StorageState::Ready);
        let blocks = (card.0.lock().unwrap().bytes.len() / 512) as u32;
        for kind in [0x04_u8, 0x06, 0x0E, 0x0B, 0x0C] {
            assert_eq!(with_bytes(&card, &[(450, &[kind]), (446, &[0x80])]), StorageState::Ready, "{kind:#x}");
        }
        let starts = [0, blocks, blocks + 1, u32::MAX].map(u32::to_le_bytes);
        let mut changes: Vec<(usize, &[u8])> =
            vec![(450, &[0x07]), (450, &[0]), (446, &[0x01]), (446, &[0x81]), (510, &[0]), (511, &[0x55])];
        changes.extend(starts.iter().map(|start| (454, start.as_slice())));
        for change in changes {
            assert_eq!(with_bytes(&card, &[change]), StorageState::Foreign, "{change:?}");
        }
    }
}

#[test]
fn shapes_are_checked() {
    for card in [fat16(), fat32()] {
        let total = number(&card, TOTAL_32).max(number(&card, TOTAL_16));
        let refused = [
            (SIGNATURE, 0x55AA),
            (BYTES_PER_SECTOR, 1_024),
            (SECTORS_PER_CLUSTER, 0),
            (SECTORS_PER_CLUSTER, 3),
            (RESERVED, 0),
            (TABLES, 0),
            (TABLES, 3),
        ];
        for change in refused {
            assert!(!takes(&card, &[change]), "{change:?}");
        }
        // The volume ends where the card ends; one more block is too much. Either field may hold the size, if it is
        // large enough.
        assert!(takes(&card, &[(TOTAL_16, 0), (TOTAL_32, total)]));
        assert!(!takes(&card, &[(TOTAL_16, 0), (TOTAL_32, total + 1)]));
        assert!(!takes(&card, &[(TOTAL_16, 0), (TOTAL_32, total + 0x1_0000)]));
        if total <= 0xFFFF {
            assert!(takes(&card, &[(TOTAL_16, total), (TOTAL_32, 0)]));
            assert!(!takes(&card, &[(TOTAL_16, total + 1), (TOTAL_32, 0)]));
            // No blocks are left for clusters.
            assert!(!takes(&card, &[(RESERVED, total)]));
        }
    }
}

/// The number of clusters makes a volume FAT12, which is refused, FAT16 or FAT32. Each of the last two needs its own
/// kind of first block.
#[test]
fn clusters_tell_the_kind() {
    let card = fat16();
    let per_cluster = number(&card, SECTORS_PER_CLUSTER);
    let root = number(&card, ROOT_ENTRIES) * 32 / 512;
    let before = number(&card, RESERVED) + number(&card, TABLES) * number(&card, TABLE_16) + root;
    let total = |clusters: u32| [(TOTAL_16, 0), (TOTAL_32, before + clusters * per_cluster)];
    assert!(takes(&card, &total(4_085)) && !takes(&card, &total(4_084)));
    assert!(!takes(&card, &[(TOTAL_16, 0), (TOTAL_32, before + 4_085 * per_cluster - 1)]));
    assert!(!takes(&card, &[(ROOT_ENTRIES, 0)]));

    let card = fat32();
    assert_eq!(number(&card, SECTORS_PER_CLUSTER), 1);
    let before = number(&card, RESERVED) + number(&card, TABLES) * number(&card, TABLE_32);
    let total = |clusters: u32| [(TOTAL_32, before + clusters)];
    assert!(takes(&card, &total(65_525)) && !takes(&card, &total(65_524)));
    let ends = number(&card, TOTAL_32) - before + 2;
    let refused = [
        (ROOT_ENTRIES, 16),
        (VERSION, 1),
        (ROOT_CLUSTER, 0),
        (ROOT_CLUSTER, 1),
        (ROOT_CLUSTER, ends),
        (INFO_SECTOR, 0),
        (INFO_SECTOR, number(&card, RESERVED)),
    ];
    for change in refused {
        assert!(!takes(&card, &[change]), "{change:?}");
    }
}

/// The table must have an entry for each cluster, and two more. A shorter one would be read beyond its end.
#[test]
fn tables_hold_all_clusters() {
    for (card, per_sector, table) in [(fat16(), 256, TABLE_16), (fat32(), 128, TABLE_32)] {
        let total = number(&card, TOTAL_32).max(number(&card, TOTAL_16));
        let holds = |sectors: u32| {
            let root = (number(&card, ROOT_ENTRIES) * 32).div_ceil(512);
            let data = total - number(&card, RESERVED) - number(&card, TABLES) * sectors - root;
            sectors * per_sector >= data / number(&card, SECTORS_PER_CLUSTER) + 2
        };
        let least = (1..).find(|sectors| holds(*sectors)).unwrap();
        assert!(!takes(&card, &[(table, least - 1)]), "{least} sectors");
        assert!(takes(&card, &[(table, least)]), "{least} sectors");
    }
}

#[test]
fn failures_are_told_apart() {
    let told = [CardError::Absent, CardError::Failed, CardError::Endless].map(|error| error.to_string());
    assert_eq!(told, ["no card", "the card has failed", "the volume is damaged"]);
    assert_eq!(FlashFailed.to_string(), "the flash has failed");
}
