//! `--write PAGE`: a table in a document, between two marker lines.

use super::terminal::Failure;
use afbc_files::place;
use afbc_report::markers;
use std::fs;
use std::path::Path;

/// Writes what `table` returns between the lines `markers` of the page at `path`, which must be there; everything else
/// of it stays, also what is changed before the table is ready.
pub(crate) fn write(
    path: &Path,
    markers: [&str; 2],
    table: impl FnOnce() -> Result<String, Failure>,
) -> Result<(), Failure> {
    let name = path.display();
    let with = |table: &str| {
        let page = fs::read_to_string(path).map_err(|error| format!("{name}: cannot be read ({error})"))?;
        let Some((before, _, after)) = markers::parts(&page, markers) else {
            let [begin, end] = markers;
            return Err(format!("{name}: no place for the table; add the lines {begin} and {end}"));
        };
        Ok(format!("{before}{table}{after}"))
    };
    // Before the flights, too.
    with("")?;
    let page = with(&table()?)?;
    // Through a link, the page and not the link.
    let written = fs::canonicalize(path).and_then(|path| place(&path, |out| out.write_all(page.as_bytes())));
    Ok(written.map_err(|error| format!("{name}: cannot be written ({error})"))?)
}
