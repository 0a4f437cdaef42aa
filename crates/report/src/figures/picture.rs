//! A figure with its caption.

use crate::explore::Explorable;

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

/// Caption of figures with a cross.
pub(super) const CROSS: &str = " Cross: a vehicle was lost.";
