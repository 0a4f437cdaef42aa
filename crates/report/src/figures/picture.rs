//! A figure with its caption.

use crate::explore::{Explorable, ExplorableScene};

/// A figure with its caption.
pub(crate) struct Picture {
    /// File name without `.svg`.
    pub(crate) name: &'static str,
    /// Caption in one or a few sentences.
    pub(crate) caption: String,
    /// The picture as SVG.
    pub(crate) svg: String,
    /// Data of the interactive version.
    pub(crate) explorable: Option<Explorable>,
}

impl Picture {
    /// Returns the interactive view of flights in space; `None` for other figures.
    pub(crate) fn into_scene(self) -> Option<ExplorableScene> {
        match self.explorable? {
            Explorable::Scene(scene) => Some(scene),
            Explorable::Chart(_) => None,
        }
    }
}

/// Caption of figures with a cross.
pub(super) const CROSS: &str = " Cross: a vehicle was lost.";
