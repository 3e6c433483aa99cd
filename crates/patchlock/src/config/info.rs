//! What is known of a method without its settings.

/// What a method does with a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetworkUse {
    /// It has no use for one.
    Unused,
    /// It is right more often with one.
    Optional,
    /// It does not begin without one.
    Required,
}

/// What is known of a method without its settings: [`Method::info`](crate::Method::info).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct MethodInfo {
    /// The name, which is also that of its group of settings.
    pub name: &'static str,
    /// What it is, as a phrase for people who choose a preset.
    pub purpose: &'static str,
    /// The family of trackers that it belongs to, as TraX asks for it.
    pub family: &'static str,
    /// A description of the tracker, as TraX asks for it.
    pub title: &'static str,
    /// What it does with a network.
    pub network: NetworkUse,
    /// Whether its scores are probabilities that the box is right.
    pub score_is_probability: bool,
    /// Megabytes that a target takes with the default settings.
    pub megabytes: usize,
}
