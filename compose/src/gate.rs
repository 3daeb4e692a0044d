//! The gates that every output passes.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// `Some` while a call is watched: where the panic hook leaves the message.
    static WATCHED: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs a call into a library that may panic; the panic's message (with its place) is the error. Nothing is printed.
pub(crate) fn no_panic<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let watched = WATCHED.with_borrow_mut(|message| {
                let Some(message) = message else {
                    return false;
                };
                let payload = info.payload();
                let text = payload
                    .downcast_ref::<&str>()
                    .map(|text| (*text).to_owned())
                    .or_else(|| payload.downcast_ref::<String>().cloned())
                    .unwrap_or_else(|| "no message".to_owned());
                *message = text;
                true
            });
            if !watched {
                before(info);
            }
        }));
    });
    let outer = WATCHED.with_borrow_mut(|message| message.replace(String::new()));
    let outcome = catch_unwind(AssertUnwindSafe(call));
    let message = WATCHED.with_borrow_mut(|message| std::mem::replace(message, outer));
    outcome.map_err(|_| message.unwrap_or_default())
}
