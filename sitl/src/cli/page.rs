//! `--write PAGE`: writes a table between two marker lines of a document.

use super::terminal::CommandError;
use afbc_files::write_atomically;
use afbc_report::markers;
use std::fs;
use std::path::Path;

/// Writes the result of `table` between the lines `markers` of the page at `path`, which must exist. The rest of the
/// page stays, including edits made while the table is computed.
pub(crate) fn write(
    path: &Path,
    markers: [&str; 2],
    table: impl FnOnce() -> Result<String, CommandError>,
) -> Result<(), CommandError> {
    let name = path.display();
    let with = |table: &str| {
        let page = fs::read_to_string(path).map_err(|error| format!("{name}: cannot be read ({error})"))?;
        let Some((before, _, after)) = markers::parts(&page, markers) else {
            let [begin, end] = markers;
            return Err(format!("{name}: the page has no place for the table; add the lines {begin} and {end}"));
        };
        Ok(format!("{before}{table}{after}"))
    };
    // The page is checked before the flights, too.
    with("")?;
    let page = with(&table()?)?;
    // If the path is a symbolic link, its target is written, and the link stays.
    let written = fs::canonicalize(path).and_then(|path| write_atomically(&path, |out| out.write_all(page.as_bytes())));
    Ok(written.map_err(|error| format!("{name}: cannot be written ({error})"))?)
}
