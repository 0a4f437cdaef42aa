//! The records of a file, cut.

/// First bytes of every log, before its version.
const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Length of the header: magic, version, time.
pub(crate) const HEADER: usize = 16;
/// Number of records one after the other that are no accident.
const CHAIN: usize = 4;

/// True if `bytes` begin as a log does.
pub(crate) fn is_ulog(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Where records end before the file does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// With the last byte.
    Whole,
    /// Within the record that begins at this byte.
    Cut(usize),
    /// With what is no record, from this byte on.
    Lost(usize),
}

/// A piece of a file.
pub(crate) enum Piece<'a> {
    /// A record, with length and kind.
    Record(&'a [u8]),
    /// So many bytes that are none.
    Junk(usize),
}

/// A record's kind, content and whole length, or why there is none.
enum Cut<'a> {
    Record(u8, &'a [u8], usize),
    /// It is longer than the file.
    Long,
    None,
}

fn cut(rest: &[u8]) -> Cut<'_> {
    let &[low, high, kind, ref content @ ..] = rest else { return Cut::Long };
    let length = usize::from(u16::from_le_bytes([low, high]));
    match content.get(..length) {
        _ if !b"FDIMPQARSOLCB".contains(&kind) => Cut::None,
        Some(content) => Cut::Record(kind, content, 3 + length),
        None => Cut::Long,
    }
}

/// True if several records follow one another from here on, or up to the end.
fn chains(mut rest: &[u8]) -> bool {
    for _ in 0..CHAIN {
        match cut(rest) {
            Cut::Record(_, _, length) => rest = rest.get(length..).unwrap_or_default(),
            _ => return false,
        }
        if rest.is_empty() {
            break;
        }
    }
    true
}

/// Incompatible flags that are known: data are appended at places that the record of flags names.
const APPENDED: u64 = 1;

/// The places in a file at which its parts begin, and its length: the whole, or more where data were appended.
///
/// # Errors
/// If it is too short, or says that this reader does not know its format.
fn parts(bytes: &[u8]) -> Result<Vec<usize>, String> {
    let after = bytes.get(HEADER..).ok_or("cut within the first 16 bytes; copy it from the vehicle again")?;
    let mut parts = vec![HEADER];
    // Logs of version 0 have no flags.
    if let Cut::Record(b'B', content, _) = cut(after) {
        let mut words =
            content.chunks_exact(8).filter_map(|word| word.first_chunk()).map(|word| u64::from_le_bytes(*word));
        let incompatible = words.nth(1).unwrap_or_default();
        if incompatible & !APPENDED != 0 {
            return Err(format!(
                "in a newer format than this program knows: its incompatible flags are {incompatible:#x}; read it with \
                 the tools of the program that wrote it, or with a newer version of this one"
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

/// Calls `take` with every piece after the header, and the byte at which it begins.
///
/// # Errors
/// One line, before anything is taken, if the file is too short or in a newer format.
pub(crate) fn each(bytes: &[u8], mut take: impl FnMut(Piece<'_>, usize)) -> Result<End, String> {
    let parts = parts(bytes)?;
    let mut end = End::Whole;
    for (from, to) in parts.iter().zip(parts.iter().skip(1)) {
        // The writer of a part that is followed by another has died there.
        if let End::Cut(at) | End::Lost(at) = end {
            take(Piece::Junk(from - at), at);
        }
        end = each_of_part(bytes.get(..*to).unwrap_or_default(), *from, &mut take);
    }
    Ok(end)
}

fn each_of_part(bytes: &[u8], mut at: usize, take: &mut impl FnMut(Piece<'_>, usize)) -> End {
    loop {
        let rest = bytes.get(at..).unwrap_or_default();
        if rest.is_empty() {
            return End::Whole;
        }
        let found = cut(rest);
        if let Cut::Record(_, _, length) = found {
            take(Piece::Record(rest.get(..length).unwrap_or_default()), at);
            at += length;
            continue;
        }
        match (1..rest.len()).find(|next| chains(rest.get(*next..).unwrap_or_default())) {
            Some(next) => {
                take(Piece::Junk(next), at);
                at += next;
            }
            None if matches!(found, Cut::Long) => return End::Cut(at),
            None => return End::Lost(at),
        }
    }
}
