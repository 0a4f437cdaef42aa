//! `--write PAGE`: a table in a document, between two marker lines.

use super::terminal::Failure;
use afbc_report::markers;
use std::fs;
use std::path::Path;

/// Writes what `table` returns between the lines `markers` of the page at `path`, which is read first.
pub(crate) fn write(
    path: &Path,
    markers: [&str; 2],
    table: impl FnOnce() -> Result<String, Failure>,
) -> Result<(), Failure> {
    let name = path.display();
    let page = fs::read_to_string(path).map_err(|error| format!("{name}: cannot be read ({error})"))?;
    let Some((before, _, after)) = markers::parts(&page, markers) else {
        let [begin, end] = markers;
        return Err(format!("{name}: no place for the table; add the lines {begin} and {end}").into());
    };
    let page = format!("{before}{}{after}", table()?);
    fs::write(path, page).map_err(|error| format!("{name}: cannot be written ({error})"))?;
    Ok(())
}
