//! Cuts a file into records.

/// First bytes of every ULog, before its version.
const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Length of the header \[bytes\]: magic, version, time.
pub(crate) const HEADER: usize = 16;
/// This many valid records in a row are no accident.
const CHAIN: usize = 4;

/// Returns true if `bytes` begin like a ULog.
pub(crate) fn is_ulog(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Where the records of a file end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecordsEnd {
    /// The last record ends with the file.
    Whole,
    /// The file ends within the record that begins at this byte.
    Cut(usize),
    /// No record can be found from this byte on.
    Lost(usize),
}

/// A piece of a file.
pub(crate) enum FilePiece<'a> {
    /// A record, including its length and kind.
    Record(&'a [u8]),
    /// This many bytes that are no record.
    Junk(usize),
}

/// A record's kind, content and whole length, or the reason for which there is none.
enum RecordCut<'a> {
    Record(u8, &'a [u8], usize),
    /// The record is longer than the rest of the file.
    Long,
    None,
}

fn cut(rest: &[u8]) -> RecordCut<'_> {
    let &[low, high, kind, ref content @ ..] = rest else { return RecordCut::Long };
    let length = usize::from(u16::from_le_bytes([low, high]));
    match content.get(..length) {
        _ if !b"FDIMPQARSOLCB".contains(&kind) => RecordCut::None,
        Some(content) => RecordCut::Record(kind, content, 3 + length),
        None => RecordCut::Long,
    }
}

/// Returns true if several records follow one another from here on, or if all bytes up to the end are records.
fn chains(mut rest: &[u8]) -> bool {
    for _ in 0..CHAIN {
        match cut(rest) {
            RecordCut::Record(_, _, length) => rest = rest.get(length..).unwrap_or_default(),
            _ => return false,
        }
        if rest.is_empty() {
            break;
        }
    }
    true
}

/// The only known incompatible flag: data were appended at the offsets in the flags record.
const APPENDED: u64 = 1;

/// Returns the offsets at which the file's parts begin, and the file's length. A file with appended data has several
/// parts.
///
/// # Errors
/// A message, if the file is too short or its flags say that this reader does not know its format.
fn parts(bytes: &[u8]) -> Result<Vec<usize>, String> {
    let after = bytes.get(HEADER..).ok_or("the log ends within its first 16 bytes; copy it from the vehicle again")?;
    let mut parts = vec![HEADER];
    // Logs of version 0 have no flags.
    if let RecordCut::Record(b'B', content, _) = cut(after) {
        let mut words =
            content.chunks_exact(8).filter_map(|word| word.first_chunk()).map(|word| u64::from_le_bytes(*word));
        let incompatible = words.nth(1).unwrap_or_default();
        if incompatible & !APPENDED != 0 {
            return Err(format!(
                "the log's format is newer than this program: its incompatible flags are {incompatible:#x}; read the \
                 log with the tools of the program that wrote it, or with a newer version of this program"
            ));
        }
        for place in words.take(3).filter(|_| incompatible & APPENDED != 0) {
            let place = usize::try_from(place).unwrap_or(usize::MAX);
            if place < bytes.len() && parts.last().is_some_and(|last| *last < place) {
                parts.push(place);
            }
        }
    }
    parts.push(bytes.len());
    Ok(parts)
}

/// Calls `take` with every piece after the header and the piece's offset in the file.
///
/// # Errors
/// One line, if the file is too short or in a newer format; `take` is not called then.
pub(crate) fn each(bytes: &[u8], mut take: impl FnMut(FilePiece<'_>, usize)) -> Result<RecordsEnd, String> {
    let parts = parts(bytes)?;
    let mut end = RecordsEnd::Whole;
    for (from, to) in parts.iter().zip(parts.iter().skip(1)) {
        // The logger died at the end of a part that is followed by another.
        if let RecordsEnd::Cut(at) | RecordsEnd::Lost(at) = end {
            take(FilePiece::Junk(from - at), at);
        }
        end = each_of_part(bytes.get(..*to).unwrap_or_default(), *from, &mut take);
    }
    Ok(end)
}

fn each_of_part(bytes: &[u8], mut at: usize, take: &mut impl FnMut(FilePiece<'_>, usize)) -> RecordsEnd {
    loop {
        let rest = bytes.get(at..).unwrap_or_default();
        if rest.is_empty() {
            return RecordsEnd::Whole;
        }
        let found = cut(rest);
        if let RecordCut::Record(_, _, length) = found {
            take(FilePiece::Record(rest.get(..length).unwrap_or_default()), at);
            at += length;
            continue;
        }
        match (1..rest.len()).find(|next| chains(rest.get(*next..).unwrap_or_default())) {
            Some(next) => {
                take(FilePiece::Junk(next), at);
                at += next;
            }
            None if matches!(found, RecordCut::Long) => return RecordsEnd::Cut(at),
            None => return RecordsEnd::Lost(at),
        }
    }
}
