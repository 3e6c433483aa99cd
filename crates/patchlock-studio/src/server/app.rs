//! What all requests share.

use std::sync::Arc;

use super::access::Access;
use super::camera::Recordings;
use super::clips::Clips;
use super::code::TokenExchange;
use super::options::Options;

/// The state of a server.
pub struct App {
    /// What requests are checked against.
    pub access: Arc<Access>,
    /// The code in the address of the browser.
    pub code: Arc<TokenExchange>,
    pub clips: Clips,
    /// What the caller has decided.
    pub options: Options,
    /// What the camera of the page has recorded.
    pub recordings: Recordings,
}
