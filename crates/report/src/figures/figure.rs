//! A picture.

/// One picture.
pub(crate) struct Figure {
    /// File name without `.svg`.
    pub(crate) name: &'static str,
    /// What there is to see, in one sentence.
    pub(crate) caption: String,
    /// The picture.
    pub(crate) svg: String,
}

/// Said of figures with a cross.
pub(super) const CROSS: &str = " A cross: where a vehicle was lost.";
