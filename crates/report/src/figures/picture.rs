//! A figure with its caption.

/// A figure with its caption.
pub(crate) struct Picture {
    /// File name without `.svg`.
    pub(crate) name: &'static str,
    /// Caption in one sentence or a few.
    pub(crate) caption: String,
    /// The picture as SVG.
    pub(crate) svg: String,
}

/// Caption of figures with a cross.
pub(super) const CROSS: &str = " Cross: a vehicle was lost.";
