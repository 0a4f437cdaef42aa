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

/// Calls `take` with every piece after the header, and the byte at which it begins.
pub(crate) fn each(bytes: &[u8], mut take: impl FnMut(Piece<'_>, usize)) -> End {
    let mut at = HEADER;
    loop {
        let rest = bytes.get(at..).unwrap_or_default();
        if rest.is_empty() {
            return End::Whole;
        }
        let found = cut(rest);
        if let Cut::Record(kind, content, length) = found {
            let record = rest.get(..length).unwrap_or_default();
            take(if is_sound(kind, content) { Piece::Record(record) } else { Piece::Junk(length) }, at);
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

/// True if the parser can look at this content: it takes for granted that some kinds are long enough.
fn is_sound(kind: u8, content: &[u8]) -> bool {
    match kind {
        b'A' => content.len() > 3,
        b'P' => content.first().is_some_and(|key| content.len() == usize::from(*key) + 5),
        _ => true,
    }
}
