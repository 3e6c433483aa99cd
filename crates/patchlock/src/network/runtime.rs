//! What runs a network: the built-in runtime, or an installed library of onnxruntime.

#[cfg(feature = "onnxruntime")]
use crate::network_error::NetworkError;
use std::fmt;
#[cfg(feature = "onnxruntime")]
use std::path::Path;

/// What runs a network. The default is the built-in runtime.
#[derive(Debug, Clone, Default)]
pub struct Runtime {
    kind: RuntimeKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum RuntimeKind {
    #[default]
    BuiltIn,
    #[cfg(feature = "onnxruntime")]
    OnnxRuntime,
}

impl Runtime {
    /// The built-in runtime: pure Rust, the same outputs, bit for bit, on any number of threads.
    /// A processor with other vector instructions may round the last bits of its sums differently.
    ///
    /// It allocates in each frame, and frees it again; what the process holds does not grow.
    pub fn built_in() -> Self {
        Self::default()
    }

    /// An installed library of onnxruntime, version 1.17 or later, such as `libonnxruntime.so`. A
    /// process uses one library: that of the first call.
    ///
    /// The library is code that runs in this process; load only one that you trust.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`] if there is no such library, or the process uses another one.
    #[cfg(feature = "onnxruntime")]
    pub fn onnxruntime(library: &Path) -> Result<Self, NetworkError> {
        super::onnxruntime::load(library)?;
        Ok(Self { kind: RuntimeKind::OnnxRuntime })
    }

    pub(super) fn kind(&self) -> RuntimeKind {
        self.kind
    }
}

impl fmt::Display for Runtime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.kind {
            RuntimeKind::BuiltIn => "built-in",
            #[cfg(feature = "onnxruntime")]
            RuntimeKind::OnnxRuntime => "onnxruntime",
        })
    }
}
