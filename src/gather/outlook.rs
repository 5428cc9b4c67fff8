//! What surrounds a patch, as a few rays tell.

/// What rays from all over a patch meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outlook {
    /// How far around it its light may change, m.
    pub reach: f64,
    /// Share of the rays that meet something within its radius.
    pub near: f32,
}
