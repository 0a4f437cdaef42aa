//! A figure with its caption.

use crate::explore::{Explorable, ExplorableScene};

/// A figure with its caption.
pub(crate) struct Picture {
    /// File name without `.svg`.
    pub(crate) name: &'static str,
    /// Caption in one sentence or a few.
    pub(crate) caption: String,
    /// The picture as SVG.
    pub(crate) svg: String,
    /// The same to be explored on a page.
    pub(crate) explorable: Option<Explorable>,
}

impl Picture {
    /// Returns the flights in space alone; none of another figure.
    pub(crate) fn into_scene(self) -> Option<ExplorableScene> {
        match self.explorable? {
            Explorable::Scene(scene) => Some(scene),
            Explorable::Chart(_) => None,
        }
    }
}

/// Caption of figures with a cross.
pub(super) const CROSS: &str = " Cross: a vehicle was lost.";
