//! Texts of files, by which scenarios and vehicles are made again elsewhere: `pickle` carries them.

use afbc_files::read::FileError;
use std::path::Path;

/// The text of a file, and what it is called.
#[derive(Clone)]
pub(crate) struct Source {
    /// Path of the file, to which paths in it are relative.
    pub(crate) file: String,
    pub(crate) text: String,
    /// Name of what it describes, unless it gives one itself.
    pub(crate) name: String,
}

impl Source {
    /// Reads what `path` names: a built-in file of this `kind`, whose text is looked up by its name, or a file.
    pub(crate) fn at(
        path: &Path,
        kind: &str,
        built_in: impl Fn(&str) -> Option<&'static str>,
    ) -> Result<Self, FileError> {
        let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
        if let Some((name, text)) = plain.and_then(|name| Some((name, built_in(name)?))) {
            return Ok(Source { file: format!("built-in {name}"), text: text.into(), name: name.into() });
        }
        let text = afbc_files::read::text(path, kind)?;
        let file = std::path::absolute(path).unwrap_or_else(|_| path.into()).display().to_string();
        let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        Ok(Source { file, text, name })
    }

    /// Returns the three texts.
    pub(crate) fn into_texts(self) -> (String, String, String) {
        (self.file, self.text, self.name)
    }
}
