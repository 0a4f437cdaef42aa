//! Tables that a command writes into a page, between two marker lines.

/// Splits a page into everything up to the first marker's line, the part between the markers, and the rest. Returns
/// `None` if a marker is missing.
pub fn parts<'a>(page: &'a str, [begin, end]: [&str; 2]) -> Option<(&'a str, &'a str, &'a str)> {
    let from = page.find(begin)? + begin.len() + 1;
    let to = page.find(end).filter(|&to| to >= from)?;
    Some((page.get(..from)?, page.get(from..to)?, page.get(to..)?))
}
