//! What is worth knowing about a model.

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Said for information.
    Note,
    /// The result may not be what the user expects.
    Warning,
}

/// Something worth knowing about a model: where, what, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// Where it is: a material, a surface, a line.
    pub place: String,
    /// What was found, and what was assumed.
    pub message: String,
    /// What the user can do about it; empty if nothing needs doing.
    pub remedy: String,
}
