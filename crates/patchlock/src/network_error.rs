//! What is wrong with a network.

/// Why a network cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// The bytes are not an ONNX file.
    #[error("it is not an ONNX file: {0}")]
    NotOnnx(String),
    /// Something exceeds its limit.
    #[error("{what} is {value}; allowed: at most {max}")]
    TooLarge {
        /// What exceeds the limit, such as "the number of bytes".
        what: &'static str,
        /// The value.
        value: u64,
        /// The largest that is allowed.
        max: u64,
    },
    /// An operator is not one of those that the known trackers use.
    #[error("it uses the operator `{name}`; allowed: {allowed}")]
    Operator {
        /// The operator's name.
        name: String,
        /// The allowed operators.
        allowed: String,
    },
    /// The graph is damaged.
    #[error("its graph is damaged: {0}")]
    Graph(String),
    /// The files are not those of a known family.
    #[error("{given}; known are {known}")]
    Family {
        /// What was given: the inputs and outputs of each file.
        given: String,
        /// The known families, with the inputs and outputs of their files.
        known: String,
    },
    /// A file of the family is missing.
    #[error("it is only the {given} of {family}; the {missing} is missing")]
    Incomplete {
        /// The family.
        family: &'static str,
        /// The part that was given.
        given: &'static str,
        /// The part that was not.
        missing: &'static str,
    },
    /// The configuration needs a network but has none.
    #[cfg_attr(
        feature = "network",
        error("the method `network` needs a network, and the configuration has none")
    )]
    #[cfg_attr(
        not(feature = "network"),
        error(
            "the method `network` needs a network, which only a build with the feature `network` has"
        )
    )]
    None,
    /// A saved state belongs to another network.
    #[error("the saved state needs the network with SHA-256 {needed}; given: {}", given.as_deref().unwrap_or("none"))]
    Other {
        /// The hash of the network that the state was saved with.
        needed: String,
        /// The hash of the network of the configuration.
        given: Option<String>,
    },
    /// The runtime cannot be used, or refused the network.
    #[error("the runtime {runtime} failed: {reason}")]
    Runtime {
        /// The runtime.
        runtime: String,
        /// What it said.
        reason: String,
    },
}

/// The error for a damaged graph.
#[cfg(feature = "network")]
pub(crate) fn graph(reason: impl Into<String>) -> NetworkError {
    NetworkError::Graph(reason.into())
}

/// Checks a number against its limit.
#[cfg(feature = "network")]
pub(crate) fn at_most(what: &'static str, value: u64, max: u64) -> Result<(), NetworkError> {
    if value <= max { Ok(()) } else { Err(NetworkError::TooLarge { what, value, max }) }
}
