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
    /// What the caller can choose otherwise instead, if that would settle it.
    pub setting: Option<Setting>,
}

/// A choice of the caller's that settles a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// The unit of the model's coordinates; the symbols of those that are likely.
    Unit(&'static [&'static str]),
    /// The largest reflectance.
    MaxReflectance,
    /// The point of view.
    Camera,
}

impl Finding {
    /// A finding that no choice of the caller's settles.
    #[must_use]
    pub fn new(
        severity: Severity,
        place: impl Into<String>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let (place, message, remedy) = (place.into(), message.into(), remedy.into());
        Self { severity, place, message, remedy, setting: None }
    }

    /// The finding with a choice that settles it.
    #[must_use]
    pub fn settled_by(self, setting: Setting) -> Self {
        Self { setting: Some(setting), ..self }
    }
}
