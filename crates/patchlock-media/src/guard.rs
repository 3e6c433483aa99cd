//! Decoder libraries may panic on damaged data. [`decoding`] turns that into a value, so that one
//! file does not end the program.

use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
    static AFTER_EACH: RefCell<Option<Box<dyn FnMut()>>> = const { RefCell::new(None) };
}

/// A decoder library panicked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the decoder failed: the data are damaged")]
pub struct DecoderPanic;

/// Calls `decode`. State that it changes must not be used after a panic.
pub fn decoding<T>(decode: impl FnOnce() -> T) -> Result<T, DecoderPanic> {
    let outer = DECODING.replace(true);
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    DECODING.set(outer);
    AFTER_EACH.with_borrow_mut(|call| call.iter_mut().for_each(|call| call()));
    decoded.map_err(|_| DecoderPanic)
}

/// Calls this from now on after each piece of work of a decoder on this thread: a picture, mostly.
#[cfg(target_os = "linux")]
pub fn after_each(call: impl FnMut() + 'static) {
    AFTER_EACH.set(Some(Box::new(call)));
}

/// Keeps the panics of decoders, which become errors, from being printed; all others are printed as
/// before. For programs: it changes the panic hook of the process, at the first call only.
pub fn silence_decoders() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !DECODING.get() {
                others(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error() {
        silence_decoders();
        assert_eq!(decoding(|| 3), Ok(3));
        assert_eq!(decoding(|| -> u8 { panic!("as a decoder does") }), Err(DecoderPanic));
        assert!(!DECODING.get());
    }
}
