//! Texts of files, from which `pickle` makes scenarios and vehicles again in another process.

use afbc_files::read::FileError;
use std::path::Path;

/// The text of a file and its names.
#[derive(Clone)]
pub(crate) struct PickledFile {
    /// Path of the file, to which paths in the text are relative.
    pub(crate) file: String,
    pub(crate) text: String,
    /// Name of the scenario or vehicle, unless the text gives one.
    pub(crate) name: String,
}

impl PickledFile {
    /// Reads a built-in file of this `kind` if `path` is a plain name known to `built_in`, or else the file at `path`.
    pub(crate) fn at(
        path: &Path,
        kind: &str,
        built_in: impl Fn(&str) -> Option<&'static str>,
    ) -> Result<Self, FileError> {
        let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
        if let Some((name, text)) = plain.and_then(|name| Some((name, built_in(name)?))) {
            return Ok(PickledFile { file: format!("built-in {name}"), text: text.into(), name: name.into() });
        }
        let text = afbc_files::read::text(path, kind)?;
        let file = std::path::absolute(path).unwrap_or_else(|_| path.into()).display().to_string();
        let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        Ok(PickledFile { file, text, name })
    }

    /// Returns file, text and name.
    pub(crate) fn into_texts(self) -> (String, String, String) {
        (self.file, self.text, self.name)
    }
}
